// What bricks add to the uncertainty of pixels, to first order in the bounds (docs/pixel-bounds.md): where to
// refine. It is no bound.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "host/picture/rays/ray_walk.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {

/// Of one pixel, in the channel that is worst: bricks with their shares, levels of 255.
struct PixelShares {
  double sum = 0;
  std::array<double, 3> colour{};  ///< of V, on fine samples
  std::vector<std::pair<std::uint32_t, float>> bricks;
};

/// Of a row of a picture.
std::array<double, 3> background_of(const PictureViews& views, std::int64_t y);

/// [y][x]. Cost: `parts` values of V a cell of each ray, and some 20 of the transfer function each.
std::vector<PixelShares> pixel_shares(const RayField& field, const PictureViews& views, std::size_t view,
                                      int parts, const Progress& progress = {});

}  // namespace vdvr
