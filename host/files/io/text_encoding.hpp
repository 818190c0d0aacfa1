// Text as editors save it: UTF-8 with or without a byte order mark, UTF-16 with one, Latin-1.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace vdvr {

/// UTF-8, without a byte order mark. Bytes that are no UTF-8 are taken as Windows-1252, of which Latin-1 is
/// the printable part; UTF-16 is known by its mark.
std::string utf8_of(std::string text);

/// The whole file as UTF-8. Throws FileError ("path: what cannot be opened"), also for a file of more than
/// `most` bytes.
std::string read_text(const std::filesystem::path& path, const std::string& what, std::uintmax_t most);

/// Takes what `text` begins with, which is not empty: a code point in well-formed UTF-8 by RFC 3629 (no
/// overlong forms, no surrogates, nothing above U+10FFFF); or nothing, and one byte.
std::optional<char32_t> next_code_point(std::string_view& text);

/// "; a decimal comma? write 0.5" where the word is a number with one; else empty.
std::string comma_hint(const std::string& word);

}  // namespace vdvr
