// Values as bytes of this machine and back, for journal records and for what processes of a crew say to one
// another.
//
// A struct has one list of its members, for both ways:
//
//   void members(auto& way, Of<Grid> auto& g) { way(g.cells, g.origin); }
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "vdvr/error.hpp"

namespace vdvr {

using Bytes = std::vector<std::byte>;

/// Numbers, enumerations, and arrays of them.
template <class T>
inline constexpr bool has_plain_bytes = std::is_arithmetic_v<T> ||
                                        (std::is_trivially_copyable_v<T> &&
                                         std::has_unique_object_representations_v<T>);
template <class T, std::size_t n>
inline constexpr bool has_plain_bytes<std::array<T, n>> = has_plain_bytes<T>;

/// T, or const T: what is read into, or written.
template <class S, class T>
concept Of = std::same_as<std::remove_const_t<S>, T>;

/// Of a vector its length, then its elements.
class ByteWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }
  template <class T>
  void put(const T& value) {
    if constexpr (has_plain_bytes<T>) append(&value, sizeof value);
    else members(*this, value);
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    if constexpr (has_plain_bytes<T>) append(values.data(), values.size() * sizeof(T));
    else
      for (const T& value : values) put(value);
  }
  void put(const std::string& text) { put(std::vector<char>(text.begin(), text.end())); }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class A, class B>
  void put(const std::pair<A, B>& both) {
    (*this)(both.first, both.second);
  }
  Bytes take() { return std::move(bytes_); }

 private:
  // Inlined as often as messages have members, it makes GCC 12 warn of sizes that cannot be.
  [[gnu::noinline]] void append(const void* from, std::size_t n) {
    if (n == 0) return;
    const std::size_t before = bytes_.size();
    bytes_.resize(before + n);
    std::memcpy(bytes_.data() + before, from, n);
  }
  Bytes bytes_;
};

/// Throws FileError where a record is shorter than what is asked of it.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : rest_(bytes) {}
  template <class... T>
  void operator()(T&... values) {
    (read(values), ...);
  }
  template <class T>
  T get() {
    T value{};
    read(value);
    return value;
  }
  [[nodiscard]] bool empty() const { return rest_.empty(); }

 private:
  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) value = get<std::uint8_t>() != 0;
    else if constexpr (has_plain_bytes<T>) copy(&value, sizeof value);
    else members(*this, value);
  }
  template <class T>
  void read(std::vector<T>& values) {
    const auto n = get<std::uint64_t>();
    if constexpr (has_plain_bytes<T>) {
      if (n > rest_.size() / sizeof(T)) fail();
      values.resize(n);
      copy(values.data(), n * sizeof(T));
    } else {
      values.clear();
      for (std::uint64_t i = 0; i < n; ++i) values.push_back(get<T>());
    }
  }
  void read(std::string& text) {
    const auto letters = get<std::vector<char>>();
    text.assign(letters.begin(), letters.end());
  }
  template <class T>
  void read(std::optional<T>& value) {
    value.reset();
    if (get<bool>()) value = get<T>();
  }
  template <class A, class B>
  void read(std::pair<A, B>& both) {
    (*this)(both.first, both.second);
  }
  [[noreturn]] static void fail() {
    throw FileError("a journal record is shorter than it says; start again without `resume`");
  }
  void copy(void* to, std::size_t n) {
    if (n > rest_.size()) fail();
    if (n > 0) std::memcpy(to, rest_.data(), n);
    rest_ = rest_.subspan(n);
  }
  std::span<const std::byte> rest_;
};

}  // namespace vdvr
