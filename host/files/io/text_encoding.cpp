#include "host/files/io/text_encoding.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <utility>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// What Windows-1252 has where Latin-1 has control characters, 0x80 to 0x9f; 0 where it has nothing.
constexpr std::array<char32_t, 32> windows{0x20ac, 0,      0x201a, 0x192,  0x201e, 0x2026, 0x2020, 0x2021,
                                           0x2c6,  0x2030, 0x160,  0x2039, 0x152,  0,      0x17d,  0,
                                           0,      0x2018, 0x2019, 0x201c, 0x201d, 0x2022, 0x2013, 0x2014,
                                           0x2dc,  0x2122, 0x161,  0x203a, 0x153,  0,      0x17e,  0x178};
constexpr char32_t replacement = 0xfffd;

unsigned char byte(char c) { return static_cast<unsigned char>(c); }

void append(std::string& out, char32_t c) {
  const auto add = [&](char32_t bits) { out += static_cast<char>(bits); };
  if (c < 0x80) return add(c);
  if (c < 0x800) return add(0xc0 | c >> 6), add(0x80 | (c & 0x3f));
  if (c < 0x10000) return add(0xe0 | c >> 12), add(0x80 | (c >> 6 & 0x3f)), add(0x80 | (c & 0x3f));
  add(0xf0 | c >> 18), add(0x80 | (c >> 12 & 0x3f)), add(0x80 | (c >> 6 & 0x3f)), add(0x80 | (c & 0x3f));
}

bool is_utf8(std::string_view text) {
  while (!text.empty())
    if (!next_code_point(text)) return false;
  return true;
}

std::string of_utf16(const std::string& text, bool big_endian) {
  const auto unit = [&](std::size_t i) {
    const unsigned a = byte(text[i]), b = byte(text[i + 1]);
    return static_cast<char32_t>(big_endian ? a << 8 | b : b << 8 | a);
  };
  std::string out;
  for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
    char32_t c = unit(i);
    if (c >= 0xd800 && c < 0xe000) {
      const char32_t low = c < 0xdc00 && i + 3 < text.size() ? unit(i + 2) : 0;
      const bool pair = low >= 0xdc00 && low < 0xe000;
      c = pair ? 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00) : replacement;
      if (pair) i += 2;
    }
    append(out, c);
  }
  return out;
}

}  // namespace

std::optional<char32_t> next_code_point(std::string_view& text) {
  const std::string_view all = text;
  const unsigned char c = byte(all[0]);
  const std::size_t length = c < 0x80                ? 1
                             : c >= 0xc2 && c < 0xe0 ? 2
                             : c >= 0xe0 && c < 0xf0 ? 3
                             : c >= 0xf0 && c < 0xf5 ? 4
                                                     : 0;
  text.remove_prefix(1);
  if (length == 0 || length > all.size()) return {};
  char32_t value = length == 1 ? c : c & (0x7fu >> length);
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(all[k]) & 0xc0) != 0x80) return {};
    value = value << 6 | (byte(all[k]) & 0x3fu);
  }
  constexpr std::array<char32_t, 5> least{0, 0, 0x80, 0x800, 0x10000};
  if (value < least[length] || (value >= 0xd800 && value < 0xe000) || value > 0x10ffff) return {};
  text = all.substr(length);
  return value;
}

std::string utf8_of(std::string text) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) return of_utf16(text, text[0] == '\xfe');
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  if (is_utf8(text)) return text;
  std::string out;
  for (const char c : text) {
    const char32_t value = byte(c);
    const char32_t other = value >= 0x80 && value < 0xa0 ? windows[value - 0x80] : value;
    append(out, other == 0 && value != 0 ? replacement : other);
  }
  return out;
}

std::string read_text(const std::filesystem::path& path, const std::string& what, std::uintmax_t most) {
  std::error_code error;
  std::ifstream file(path, std::ios::binary);
  if (!std::filesystem::is_regular_file(path, error) || !file)
    throw FileError(fmt::format("{}: {} cannot be opened", path.string(), what));
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (bytes > most) throw FileError(fmt::format("{}: is too large for {}", path.string(), what));
  std::string text(bytes, '\0');
  if (!file.read(text.data(), static_cast<std::streamsize>(bytes)))
    throw FileError(fmt::format("{}: cannot be read", path.string()));
  return utf8_of(std::move(text));
}

std::string comma_hint(const std::string& word) {
  const std::size_t comma = word.find(',');
  if (comma == std::string::npos || word.find(',', comma + 1) != std::string::npos ||
      word.find('.') != std::string::npos || word.find_first_not_of("+-0123456789,eE") != std::string::npos ||
      word.find_first_of("0123456789") == std::string::npos)
    return "";
  std::string point = word;
  point[comma] = '.';
  return fmt::format("; a decimal comma? write {}", point);
}

}  // namespace vdvr
