// One-image greyscale TIFF files as arrays of double. Strips and tiles, uint8/16/32, int8/16/32, float32/64,
// any compression the installed libtiff decodes. libtiff's messages become FileError; nothing is printed.
// Called by host/io/scan_folder.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace vdvr::io {

struct TiffImage {
  std::int64_t rows = 0, columns = 0;
  bool is_integer = false;
  std::vector<double> samples;  ///< [row][column]
};

/// Throws FileError: missing, not TIFF, truncated, several images, several samples per pixel, unsupported
/// type.
TiffImage read_tiff(const std::filesystem::path& path);

}  // namespace vdvr::io
