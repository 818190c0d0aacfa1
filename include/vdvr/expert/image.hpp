// Pictures: 8-bit RGB with its PNG form, and floats with their NumPy form.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "vdvr/api.hpp"

namespace vdvr {

/// std::uint8_t rgb[y][x][3], row 0 on top.
struct Image {
  std::int64_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// float values[y][x][channels], row 0 on top; NaN where there is nothing to say.
struct FloatImage {
  std::int64_t width = 0, height = 0;
  std::vector<float> values;
  std::int64_t channels = 1;
};

/// Each is written whole or not at all. Throws InputError (size), ResourceError (disk) or FileError (folder
/// missing, not writable).
VDVR_API void write_png(const std::filesystem::path& path, const Image& image);
/// The bytes of the same file. Throws InputError (size) or ResourceError (memory).
VDVR_API std::string png_bytes(const Image& image);
/// NumPy's format 1.0: float32, little-endian, shape (height, width) or, of several channels,
/// (height, width, channels), C order.
VDVR_API void write_npy(const std::filesystem::path& path, const FloatImage& image);

}  // namespace vdvr
