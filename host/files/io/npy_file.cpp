// The .npy format, versions 1 to 3: magic, a dictionary of Python literals, plain numbers (NumPy,
// numpy.lib.format).
#include "host/files/io/npy_file.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <fstream>
#include <string>
#include <string_view>

#include "host/base/system/limits.hpp"
#include "host/files/io/stored_numbers.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t most_numbers = std::int64_t{1} << 26;
constexpr std::size_t most_axes = 4;

struct NpyHeader {
  std::string type;
  bool fortran = false;
  std::vector<std::int64_t> shape;
};

// {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), } and nothing else, in any order.
class HeaderReader {
 public:
  HeaderReader(const fs::path& path, std::string_view text) : path_(path), text_(text) {}

  NpyHeader read() {
    NpyHeader out;
    std::array<bool, 3> seen{};
    need('{');
    while (!take('}')) {
      const std::string key = quoted();
      need(':');
      const std::size_t which = key == "descr" ? 0 : key == "fortran_order" ? 1 : key == "shape" ? 2 : 3;
      if (which == 3 || seen[which]) fail(fmt::format("header member '{}'", key));
      seen[which] = true;
      if (which == 0) out.type = quoted();
      if (which == 1) out.fortran = truth();
      if (which == 2) out.shape = tuple();
      if (take(',')) continue;
      need('}');
      break;
    }
    skip_blanks();
    if (at_ != text_.size() || !seen[0] || !seen[1] || !seen[2])
      fail("the header is not a dictionary of descr, fortran_order and shape");
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(fmt::format("{}: is no .npy array that can be read: {}", path_.string(), what));
  }
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
  }
  bool take(char c) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void need(char c) {
    if (!take(c)) fail(fmt::format("the header has no '{}' at byte {}", c, at_));
  }
  std::string quoted() {
    const char quote = take('\'') ? '\'' : '"';
    if (quote == '"') need('"');
    const std::size_t end = text_.find(quote, at_);
    if (end == std::string_view::npos) fail("text without its end in the header");
    const std::string out(text_.substr(at_, end - at_));
    at_ = end + 1;
    return out;
  }
  bool truth() {
    skip_blanks();
    for (const auto& [word, value] : {std::pair<std::string_view, bool>{"True", true}, {"False", false}})
      if (text_.substr(at_, word.size()) == word) {
        at_ += word.size();
        return value;
      }
    fail("fortran_order is neither True nor False");
  }
  std::vector<std::int64_t> tuple() {
    std::vector<std::int64_t> out;
    need('(');
    while (!take(')')) {
      if (out.size() == most_axes) fail(fmt::format("more than {} axes", most_axes));
      out.push_back(length());
      if (take(',')) continue;
      need(')');
      break;
    }
    return out;
  }
  std::int64_t length() {
    skip_blanks();
    std::int64_t n = 0;
    const std::size_t first = at_;
    for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_)
      if ((n = 10 * n + (text_[at_] - '0')) > most_numbers) fail("an axis is too long");
    if (at_ == first) fail("shape holds something else than lengths");
    return n;
  }

  fs::path path_;
  std::string_view text_;
  std::size_t at_ = 0;
};

// The bytes of the header, and where the numbers begin.
std::pair<std::string_view, std::size_t> header_of(const fs::path& path, std::string_view bytes) {
  const std::string_view magic("\x93NUMPY", 6);
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i]));
  };
  if (bytes.size() < 12 || bytes.substr(0, magic.size()) != magic)
    throw FileError(path.string() + ": is no .npy file: its first bytes are others, or it is truncated");
  const std::size_t version = byte(6), start = version == 1 ? 10 : 12;
  if (version < 1 || version > 3)
    throw FileError(fmt::format("{}: .npy version {}; 1 to 3 can be read", path.string(), version));
  std::size_t length = byte(8) + (byte(9) << 8);
  if (version > 1) length += (byte(10) << 16) + (byte(11) << 24);
  if (length > bytes.size() - start) throw FileError(path.string() + ": is truncated within its header");
  return {bytes.substr(start, length), start + length};
}

// In C order what a file holds in Fortran order, whose first axis is the fastest.
std::vector<double> in_c_order(const std::vector<double>& values, const std::vector<std::int64_t>& shape) {
  std::vector<std::size_t> stride;
  for (std::size_t n = 1; const std::int64_t length : shape) {
    stride.push_back(n);
    n *= static_cast<std::size_t>(length);
  }
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::size_t rest = i, place = 0;
    for (std::size_t a = shape.size(); a > 0; --a) {
      const auto n = static_cast<std::size_t>(shape[a - 1]);
      place += rest % n * stride[a - 1];
      rest /= n;
    }
    out[i] = values[place];
  }
  return out;
}

std::string whole_file(const fs::path& path) {
  std::error_code error;
  std::ifstream file(path, std::ios::binary);
  if (!fs::is_regular_file(path, error) || !file)
    throw FileError(path.string() + ": no such file, or not readable");
  const std::uintmax_t size = fs::file_size(path, error);
  if (size > (most_numbers + (1 << 20)) * sizeof(double)) throw FileError(path.string() + ": is too large");
  std::string bytes(size, '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size)))
    throw FileError(path.string() + ": cannot be read");
  return bytes;
}

}  // namespace

NpyArray read_npy(const fs::path& path) {
  const std::string bytes = whole_file(path);
  const auto [text, start] = header_of(path, bytes);
  const NpyHeader header = HeaderReader(path, text).read();
  const bool wide = header.type == "<f8";
  if (!wide && header.type != "<f4")
    throw FileError(fmt::format("{}: numbers of type '{}'; save as little-endian float64 or float32",
                                path.string(), header.type));
  const std::string_view numbers = std::string_view(bytes).substr(start);
  const std::uint64_t needed = checked_bytes(header.shape, wide ? 8 : 4, path.string());
  if (needed != numbers.size())
    throw FileError(fmt::format("{}: {} numbers take {} bytes, {} are there", path.string(),
                                shape_text(header.shape), needed, numbers.size()));
  NpyArray out{header.shape, std::vector<double>(needed / (wide ? 8 : 4))};
  static_assert(std::endian::native == std::endian::little);
  convert_numbers(ScalarKind::floating, wide ? 8 : 4, reinterpret_cast<const unsigned char*>(numbers.data()),
                  static_cast<std::int64_t>(out.values.size()), false, out.values.data());
  if (header.fortran) out.values = in_c_order(out.values, out.shape);
  return out;
}

}  // namespace vdvr::io
