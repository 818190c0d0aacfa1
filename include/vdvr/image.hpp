// An 8-bit RGB picture and its PNG form.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace vdvr {

/// std::uint8_t rgb[y][x][3], row 0 on top.
struct Image {
  std::int64_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Written whole or not at all. Throws ResourceError (disk) or FileError (folder missing, not writable).
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace vdvr
