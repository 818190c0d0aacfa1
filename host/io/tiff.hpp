// Greyscale TIFF files as arrays of double, one image or a stack of them. Strips and tiles, uint8/16/32,
// int8/16/32, float32/64, any compression the installed libtiff decodes. libtiff's messages become FileError;
// nothing is printed. Called by host/raw/scan_folder.cpp and host/io/volume_stack.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace vdvr::io {

struct TiffImage {
  std::int64_t rows = 0, columns = 0;
  bool is_integer = false;
  std::vector<double> samples;  ///< [row][column]
};

/// Throws FileError: missing, not TIFF, truncated, several images, several samples per pixel, unsupported
/// type.
TiffImage read_tiff(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);

/// What a file of several images says about itself.
struct TiffStack {
  std::int64_t images = 0;
  std::string description;                              ///< ImageDescription of the first image
  double pixels_per_unit_x = 0, pixels_per_unit_y = 0;  ///< 0 where the file does not say
};
/// Hands out every image of a file in order. `begin` is called once, before the first. Throws FileError as
/// read_tiff, also where images differ in size.
void read_tiff_stack(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                     const std::function<void(const TiffStack&)>& begin,
                     const std::function<void(std::int64_t index, TiffImage image)>& take);

}  // namespace vdvr::io
