// Values as bytes of this machine, for journal records.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "vdvr/error.hpp"

namespace vdvr {

using Bytes = std::vector<std::byte>;

/// Numbers, and arrays of small integers.
template <class T>
inline constexpr bool has_plain_bytes = std::is_arithmetic_v<T> ||
                                        (std::is_trivially_copyable_v<T> &&
                                         std::has_unique_object_representations_v<T>);

class ByteWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(has_plain_bytes<T>, "structs may have padding, whose bytes are anything");
    append(&value, sizeof value);
  }
  /// Its length, then its elements.
  template <class T>
  void put(const std::vector<T>& values) {
    static_assert(has_plain_bytes<T>);
    put(static_cast<std::uint64_t>(values.size()));
    append(values.data(), values.size() * sizeof(T));
  }
  Bytes take() { return std::move(bytes_); }

 private:
  void append(const void* from, std::size_t n) {
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
  template <class T>
  T get() {
    static_assert(has_plain_bytes<T>);
    T value{};
    copy(&value, sizeof value);
    return value;
  }
  template <class T>
  std::vector<T> get_vector() {
    const auto n = get<std::uint64_t>();
    if (n > rest_.size() / sizeof(T)) fail();
    std::vector<T> values(n);
    copy(values.data(), n * sizeof(T));
    return values;
  }
  [[nodiscard]] bool empty() const { return rest_.empty(); }

 private:
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
