// Whether bricks that both store a sample at a point store the same bits.
#pragma once

#include <array>
#include <cstdint>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

struct Seams {
  std::int64_t different = 0;                  ///< samples, once per pair of bricks
  std::array<std::int64_t, 2> bricks{-1, -1};  ///< the first such pair
  Vec3 at{0, 0, 0};                            ///< and its point
};
/// Faces, edges and corners of all bricks. Cost: a few passes over the stored samples on brick boundaries.
Seams compare_seams(const MixedVolume& volume);

}  // namespace vdvr
