// Damage to files; see mutations.hpp. Plain 64-bit arithmetic on mt19937_64 instead of the standard
// distributions, whose results differ between libraries.
#include "tests/fuzz/mutations.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <random>

namespace vdvr::fuzz {
namespace {

class Damage {
 public:
  Damage(std::string bytes, std::uint64_t seed) : bytes_(std::move(bytes)), random_(seed) {}
  std::string take() { return std::move(bytes_); }
  std::uint64_t below(std::uint64_t n) { return n == 0 ? 0 : random_() % n; }

  void flip_bits() {
    for (std::uint64_t n = 1 + below(8); n-- > 0 && !bytes_.empty();) {
      char& c = bytes_[below(bytes_.size())];
      c = static_cast<char>(c ^ (1 << below(8)));
    }
  }
  void truncate() { bytes_.resize(below(bytes_.size() + 1)); }
  void copy_block() {
    const auto [from, length] = block();
    const std::string part = bytes_.substr(from, length);
    bytes_.replace(below(bytes_.size() + 1), length, part);
  }
  void double_block() {
    const auto [from, length] = block();
    bytes_.insert(below(bytes_.size() + 1), bytes_.substr(from, length));
  }
  void remove_block() {
    const auto [from, length] = block();
    bytes_.erase(from, length);
  }
  void fill_block() {
    const auto [from, length] = block();
    constexpr std::array<char, 4> fills{'\0', '\xff', '\x7f', ' '};
    std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(from), length, fills[below(fills.size())]);
  }
  void overwrite_size() {
    constexpr std::array<std::uint64_t, 16> edges{0,
                                                  1,
                                                  2,
                                                  0x7f,
                                                  0x80,
                                                  0xff,
                                                  0x7fff,
                                                  0xffff,
                                                  0x10000,
                                                  0x7fffffff,
                                                  0x80000000,
                                                  0xffffffff,
                                                  0x100000000,
                                                  0x7fffffffffffffff,
                                                  0x8000000000000000,
                                                  0xffffffffffffffff};
    std::uint64_t value = edges[below(edges.size())];
    if (below(4) == 0) value = below(bytes_.size() * 4 + 4);
    const std::size_t width = std::size_t{1} << below(4);
    if (bytes_.size() < width) return;
    std::array<char, 8> le{};
    std::memcpy(le.data(), &value, le.size());
    if (below(4) == 0) std::reverse(le.begin(), le.begin() + static_cast<std::ptrdiff_t>(width));
    std::uint64_t at = below(bytes_.size() - width + 1);
    if (below(2) == 0) at -= at % width;
    std::copy_n(le.begin(), width, bytes_.begin() + static_cast<std::ptrdiff_t>(at));
  }
  void splice(const std::string& other) {
    bytes_ = bytes_.substr(0, below(bytes_.size() + 1)) + other.substr(below(other.size() + 1));
  }
  void change_number() {
    static const std::vector<std::string> numbers{"0",
                                                  "-1",
                                                  "1",
                                                  "2147483648",
                                                  "4294967296",
                                                  "9223372036854775807",
                                                  "99999999999999999999999",
                                                  "1e9",
                                                  "1e999",
                                                  "-1e9",
                                                  "1e-999",
                                                  "nan",
                                                  "inf",
                                                  "0x10",
                                                  "",
                                                  "null",
                                                  "[]",
                                                  "\"text\"",
                                                  "{}",
                                                  "true",
                                                  "0.5.5"};
    const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < std::min<std::size_t>(bytes_.size(), 1 << 16); ++i)
      if (digit(bytes_[i]) && (i == 0 || !digit(bytes_[i - 1]))) starts.push_back(i);
    if (starts.empty()) return;
    const std::size_t at = starts[below(starts.size())];
    std::size_t end = at;
    while (end < bytes_.size() && (digit(bytes_[end]) || bytes_[end] == '.' || bytes_[end] == 'e')) ++end;
    bytes_.replace(at, end - at, numbers[below(numbers.size())]);
  }
  void change_line() {
    const std::size_t at = below(bytes_.size() + 1);
    const std::size_t first = at == 0 ? std::string::npos : bytes_.rfind('\n', at - 1);
    const std::size_t begin = first == std::string::npos ? 0 : first + 1;
    const std::size_t end = std::min(bytes_.find('\n', begin), bytes_.size());
    const std::string line = bytes_.substr(begin, end - begin) + "\n";
    if (below(2) == 0) bytes_.erase(begin, std::min(line.size(), bytes_.size() - begin));
    else bytes_.insert(begin, line);
  }
  // HDF5's old filter message holds, before each filter's name, its number, the name's length, flags and the
  // count of parameters, two bytes each; the parameters follow the name.
  void edit_filter() {
    std::vector<std::pair<std::size_t, std::size_t>>
        entries;  // where the message begins, where parameters do
    for (const std::string name : {"shuffle", "deflate", "fletcher32"})
      for (std::size_t at = bytes_.find(name); at != std::string::npos; at = bytes_.find(name, at + 1))
        if (at >= 8) entries.emplace_back(at - 8, at + (name.size() + 8) / 8 * 8);
    if (entries.empty()) return overwrite_size();
    const auto [message, parameters] = entries[below(entries.size())];
    // HDF5's own (0 is none, 4 needs a licence, 5 and 6 pack bits), then registered and reserved ones.
    constexpr std::array<std::uint16_t, 12> numbers{0, 1, 2, 3, 4, 5, 6, 7, 305, 32000, 32004, 0xffff};
    constexpr std::array<std::uint16_t, 8> edges{0, 1, 2, 0x10, 0xff, 0x100, 0x7fff, 0xffff};
    const std::uint64_t field = below(5);
    const std::uint16_t value = field == 0 ? numbers[below(numbers.size())] : edges[below(edges.size())];
    const std::size_t at = field < 4 ? message + 2 * field : parameters + 2 * below(4);
    if (at + sizeof(value) > bytes_.size()) return;
    bytes_[at] = static_cast<char>(value & 0xff);
    bytes_[at + 1] = static_cast<char>(value >> 8);
  }
  void nest() {
    const std::size_t depth = 1 + below(100000);
    bytes_.insert(below(bytes_.size() + 1), std::string(depth, below(2) == 0 ? '[' : '{'));
  }

 private:
  std::pair<std::size_t, std::size_t> block() {
    const std::size_t from = below(bytes_.size() + 1);
    const std::size_t longest = std::min<std::size_t>(bytes_.size() - from, below(8) == 0 ? 4096 : 64);
    return {from, below(longest + 1)};
  }

  std::string bytes_;
  std::mt19937_64 random_;
};

}  // namespace

std::string mutant(const std::vector<std::string>& seeds, Contents contents, std::uint64_t seed,
                   std::uint64_t index) {
  const bool text = contents == Contents::text;
  std::mt19937_64 pick(seed * 0x9e3779b97f4a7c15u + index);
  Damage d(seeds[pick() % seeds.size()], pick());
  for (std::uint64_t n = 1 + d.below(3); n-- > 0;) {
    if (contents == Contents::hdf5 && d.below(8) == 0) {
      d.edit_filter();
      continue;
    }
    switch (d.below(text ? 14 : 10)) {
      case 0:
      case 1:
        d.flip_bits();
        break;
      case 2:
        d.truncate();
        break;
      case 3:
        d.copy_block();
        break;
      case 4:
        d.double_block();
        break;
      case 5:
        d.remove_block();
        break;
      case 6:
        d.fill_block();
        break;
      case 7:
        d.splice(seeds[pick() % seeds.size()]);
        break;
      case 8:
      case 9:
        d.overwrite_size();
        break;
      case 10:
      case 11:
        d.change_number();
        break;
      case 12:
        d.change_line();
        break;
      default:
        if (d.below(8) == 0) d.nest();
        else d.change_number();
    }
  }
  return d.take();
}

}  // namespace vdvr::fuzz
