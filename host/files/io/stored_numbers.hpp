// Numbers as files hold them, of any kind and width, as double.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace vdvr::io {

enum class ScalarKind { unsigned_integer, signed_integer, floating };

template <typename T>
void convert_numbers(const unsigned char* from, std::int64_t count, bool swap, double* out) {
  for (std::int64_t i = 0; i < count; ++i) {
    std::array<unsigned char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from + static_cast<std::size_t>(i) * sizeof(T), sizeof(T));
    if (swap) std::reverse(bytes.begin(), bytes.end());
    out[i] = static_cast<double>(std::bit_cast<T>(bytes));
  }
}

/// `width`: bytes of one, 1, 2, 4 or 8; of floating ones 4 or 8. `swap`: they are not in this machine's
/// order.
inline void convert_numbers(ScalarKind kind, int width, const unsigned char* from, std::int64_t count,
                            bool swap, double* out) {
  const bool is_signed = kind == ScalarKind::signed_integer;
  if (kind == ScalarKind::floating)
    return width == 4 ? convert_numbers<float>(from, count, swap, out)
                      : convert_numbers<double>(from, count, swap, out);
  switch (width) {
    case 1:
      return is_signed ? convert_numbers<std::int8_t>(from, count, swap, out)
                       : convert_numbers<std::uint8_t>(from, count, swap, out);
    case 2:
      return is_signed ? convert_numbers<std::int16_t>(from, count, swap, out)
                       : convert_numbers<std::uint16_t>(from, count, swap, out);
    case 4:
      return is_signed ? convert_numbers<std::int32_t>(from, count, swap, out)
                       : convert_numbers<std::uint32_t>(from, count, swap, out);
    default:
      return is_signed ? convert_numbers<std::int64_t>(from, count, swap, out)
                       : convert_numbers<std::uint64_t>(from, count, swap, out);
  }
}

}  // namespace vdvr::io
