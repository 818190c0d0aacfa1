// Pictures: 8-bit RGB with its PNG form, floats with their NumPy form, and moving ones as APNG and GIF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "vdvr/export.hpp"

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
/// Frames of one size, shown `frame_ms` each, for ever. APNG is lossless; a viewer without it shows frame 0.
VDVR_API void write_apng(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms);
/// One palette of 255 colours for all frames, median cut over their pixels, ordered dither (which stands
/// still from frame to frame). Sides up to 65535. GIF counts time in hundredths of a second.
VDVR_API void write_gif(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms);

}  // namespace vdvr
