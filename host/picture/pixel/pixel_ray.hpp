// The ray of a pixel in double precision, and what lies behind all.
#pragma once

#include <algorithm>
#include <array>

#include "vdvr/expert/grid.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Inside grid and clip from `first` to `last`, world lengths from the eye; nowhere where first >= last.
struct PixelRay {
  Vec3 from{}, direction{};
  double first = 0, last = 0;
  [[nodiscard]] Vec3 at(double t) const {
    return {from[0] + t * direction[0], from[1] + t * direction[1], from[2] + t * direction[2]};
  }
};
PixelRay pixel_ray(const RenderOptions& options, const Grid& grid, std::int64_t x, std::int64_t y);
/// Of a base cell: what opacities are per.
inline double length_unit(const Grid& g) { return *std::min_element(g.spacing.begin(), g.spacing.end()); }
std::array<double, 3> background_of_pixel(const RenderOptions& options, std::int64_t y);

}  // namespace vdvr
