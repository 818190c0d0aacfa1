// Text for HTML: whatever a name or a note holds, it stays text. Called by report.cpp, report_storage.cpp and
// report_chart.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vdvr::cli {

/// For element content and quoted attributes. What HTML does not allow (control characters, bytes that are no
/// UTF-8, noncharacters) becomes U+FFFD.
std::string escaped(std::string_view text);
std::string base64(std::string_view bytes);
/// Words as a POSIX shell takes them back.
std::string shell_line(const std::vector<std::string>& words);

/// A name and its value; both sides are HTML.
struct Pair {
  std::string name, value;
};
using Pairs = std::vector<Pair>;
std::string pairs_table(const Pairs& pairs);
/// The begin of a table of numbers: what its first column names, then the others; with `bars` one more.
std::string table_head(const std::vector<std::string>& columns, bool bars = false);
/// A row, in HTML; the last one is followed by `table_end`.
std::string table_row(const std::string& name, const std::vector<std::string>& numbers,
                      const std::string& bar = "");
inline constexpr const char* table_end = "</tbody></table>\n";

std::string code(const std::string& text);
/// "3.21 %"; an en dash of nothing.
std::string percent(double value, double whole);
/// "0.004536"; an en dash where it is not finite.
std::string number_text(double value);
/// The same with the value itself for programs: `member` says which of certificate.json it is, "" none.
std::string number_html(double value, const std::string& member = "");
/// "1 944 000", with thin spaces that do not break.
std::string count_html(std::uint64_t count);

}  // namespace vdvr::cli
