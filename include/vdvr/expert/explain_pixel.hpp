// What makes the bound of one pixel: bricks, and points of the transfer function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

struct BrickShare {
  std::size_t brick = 0;  ///< [bz][by][bx]
  double bound = 0;       ///< |V - F| in it
  double levels = 0;      ///< of the pixel's bound, to first order
};
struct PixelExplanation {
  std::vector<BrickShare> bricks;  ///< the largest first
  std::vector<double> of_points;   ///< levels by the point of the transfer function that is nearest
  double levels = 0;               ///< of all: near the bound of a soft transfer function, and no bound
};
/// To first order: the largest change of emission at each of an eighth of a cell, by what of it is seen and
/// what lies behind (docs/pixel-bounds.md, section 8). `windowed`: F may also lie where nothing shows, and
/// does so in bricks without a bound. On the host, without light.
VDVR_API PixelExplanation explain_pixel(const MixedVolume& volume, const std::vector<float>& bounds,
                                        const RenderOptions& options, std::int64_t x, std::int64_t y,
                                        bool windowed = false);

}  // namespace vdvr
