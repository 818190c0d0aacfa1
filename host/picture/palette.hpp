// A palette for pictures of 8 bits a pixel: median cut (P. Heckbert, Color Image Quantization for Frame
// Buffer Display, 1982) and an ordered dither.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vdvr/expert/image.hpp"

namespace vdvr {

struct Palette {
  std::vector<std::array<std::uint8_t, 3>> colours;  ///< 256 at most
  std::vector<std::uint8_t>
      nearest;  ///< [r / 4][g / 4][b / 4]: index of the nearest colour to the cell's middle
};

/// From at most about a million pixels, evenly spread over all pictures.
Palette palette_of(const std::vector<Image>& images);
/// Index of each pixel, [y][x].
std::vector<std::uint8_t> dithered(const Palette& palette, const Image& image);

}  // namespace vdvr
