// Numbers in text files, read strictly: what is left over is a fault.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

namespace vdvr::io {

inline constexpr std::string_view blanks = " \t\r\n";

inline std::string_view without_blanks(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// The whole text as one finite number, whatever the locale; nothing where it is none.
inline std::optional<double> number_of(std::string_view text) {
  text = without_blanks(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || rest != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// Numbers with blanks between them; nothing where a word is none, or after more than `most`.
inline std::optional<std::vector<double>> numbers_of(std::string_view text, std::size_t most) {
  std::vector<double> values;
  for (std::size_t at = text.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
    const auto value = number_of(text.substr(at, end - at));
    if (!value || values.size() == most) return {};
    values.push_back(*value);
    at = text.find_first_not_of(blanks, end);
  }
  return values;
}

}  // namespace vdvr::io
