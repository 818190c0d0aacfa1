#include "apps/vdvr/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace vdvr::cli {
namespace {

constexpr const char* replacement = "\xEF\xBF\xBD";

struct CodePoint {
  char32_t value;
  std::size_t bytes;
};

// RFC 3629: no overlong forms, no surrogates, nothing above U+10FFFF.
std::optional<CodePoint> decoded(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return CodePoint{first, 1};
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < bytes) return {};
  char32_t value = first & (0x7Fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0u) != 0x80u) return {};
    value = value << 6 | (byte(i) & 0x3Fu);
  }
  constexpr char32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  if (value < least[bytes] || value > 0x10FFFF || (value >= 0xD800 && value < 0xE000)) return {};
  return CodePoint{value, bytes};
}

bool is_allowed(char32_t c) {
  if (c < 0x20) return c == '\t' || c == '\n';
  return !(c >= 0x7F && c < 0xA0) && !(c >= 0xFDD0 && c <= 0xFDEF) && (c & 0xFFFEu) != 0xFFFEu;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto c = decoded(text);
    const std::size_t bytes = c ? c->bytes : 1;
    if (!c || !is_allowed(c->value)) out += replacement;
    else if (c->value == '&') out += "&amp;";
    else if (c->value == '<') out += "&lt;";
    else if (c->value == '>') out += "&gt;";
    else if (c->value == '"') out += "&quot;";
    else if (c->value == '\'') out += "&#39;";
    else out += text.substr(0, bytes);
    text.remove_prefix(bytes);
  }
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= left ? digits[group >> (18 - 6 * k) & 63u] : '=';
  }
  return out;
}

std::string shell_line(const std::vector<std::string>& words) {
  constexpr std::string_view plain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789%+,-./:=@_";
  std::string out;
  for (const std::string& word : words) {
    if (!out.empty()) out += ' ';
    if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) {
      out += word;
      continue;
    }
    out += '\'';
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    out += '\'';
  }
  return out;
}

std::string pairs_table(const Pairs& pairs) {
  std::string html = "<table class=\"pairs\"><tbody>\n";
  for (const auto& [name, value] : pairs)
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", name, value);
  return html + table_end;
}

std::string table_head(const std::vector<std::string>& columns, bool bars) {
  std::string html = fmt::format("<table><thead><tr><th>{}</th>", columns.front());
  for (std::size_t i = 1; i < columns.size(); ++i) html += fmt::format("<th class=\"n\">{}</th>", columns[i]);
  return html + (bars ? "<th></th>" : "") + "</tr></thead><tbody>\n";
}

std::string table_row(const std::string& name, const std::vector<std::string>& numbers,
                      const std::string& bar) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const std::string& number : numbers) html += fmt::format("<td class=\"n\">{}</td>", number);
  return html + (bar.empty() ? "" : fmt::format("<td class=\"b\">{}</td>", bar)) + "</tr>\n";
}

std::string code(const std::string& text) { return fmt::format("<code>{}</code>", escaped(text)); }

std::string percent(double value, double whole) {
  return fmt::format("{}\xE2\x80\xAF%",
                     whole > 0 ? fmt::format("{:.3g}", 100 * value / whole) : "\xE2\x80\x93");
}

std::string number_text(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "\xE2\x80\x93";
}

std::string number_html(double value, const std::string& member) {
  if (!std::isfinite(value)) return number_text(value);
  const std::string of = member.empty() ? "" : fmt::format(" data-member=\"{}\"", escaped(member));
  return fmt::format("<data value=\"{}\"{}>{}</data>", value, of, number_text(value));
}

std::string count_html(std::uint64_t count) {
  const std::string digits = std::to_string(count);
  std::string out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += "\xE2\x80\xAF";
    out += digits[i];
  }
  return fmt::format("<data value=\"{}\">{}</data>", count, out);
}

}  // namespace vdvr::cli
