// What the certificate allows along a chord: the integral of its bounds by brick.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

class BoundsAlong {
 public:
  /// `bounds` [bz][by][bx], infinite where nothing was tested.
  BoundsAlong(const MixedVolume& volume, const std::vector<float>& bounds, double z);
  /// At least the integral over the chord of ray (cos u - sin s, sin u + cos s); nothing where no brick was
  /// tested or none is.
  [[nodiscard]] double operator()(double cosine, double sine, double u, double first, double last) const;

 private:
  std::array<double, 2> origin_{}, side_{};  // of bricks along x and y
  std::array<std::int64_t, 2> bricks_{};
  std::array<double, 2> end_{};  // of the grid, in bricks
  std::vector<double> bound_;    // [by][bx] at this height; empty beside the grid
};

}  // namespace vdvr
