// How small each brick's bound must be so that pixels hold theirs with few samples.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace vdvr {

/// Of one pixel that is above what it may be: bricks, and what each adds per unit of its bound.
struct PixelDemand {
  double allowed = 0;
  std::vector<std::pair<std::uint32_t, float>> slopes;
};

/// Bounds by brick, none above `bounds` nor below `finest` where these are not, under which every pixel's sum
/// of slope times bound is at most what it allows, and the sum over bricks of bound^(-3/2), which samples go
/// with, is about the least. Cost: some tens of passes over the demands.
std::vector<float> spend(const std::vector<float>& bounds, const std::vector<PixelDemand>& demands,
                         double finest);

}  // namespace vdvr
