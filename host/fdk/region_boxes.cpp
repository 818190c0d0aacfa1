#include "host/fdk/region_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdvr {
namespace {

constexpr int boxes_across = 16, boxes_along = 4, directions = 256;

// At least as far from the axis as any point at most `reach` outside: the region is convex, so that points
// outside lead to points farther outside, and between two directions it ends at most 1 / cos as far away.
double outer_radius(const Coverage& coverage, double reach) {
  double outer = 0;
  for (int d = 0; d < directions; ++d) {
    const double phi = 2 * std::numbers::pi * d / directions, x = std::cos(phi), y = std::sin(phi);
    double inside = 0, outside = coverage.inner_radius() + reach;
    while (coverage.margin(x * outside, y * outside) >= -reach) outside *= 2;
    while (outside - inside > 1e-3 * outside) {
      const double middle = 0.5 * (inside + outside);
      (coverage.margin(x * middle, y * middle) >= -reach ? inside : outside) = middle;
    }
    outer = std::max(outer, outside);
  }
  return outer / std::cos(std::numbers::pi / directions);
}

}  // namespace

std::vector<RegionBox> region_boxes(const Coverage& coverage, double reach,
                                    const std::pair<double, double>& heights) {
  const double outer = outer_radius(coverage, reach), side = 2 * outer / boxes_across,
               tall = (heights.second - heights.first) / boxes_along;
  std::vector<RegionBox> boxes;
  for (int y = 0; y < boxes_across; ++y)
    for (int x = 0; x < boxes_across; ++x) {
      const double low_x = -outer + x * side, low_y = -outer + y * side;
      // The margin falls by at most the distance.
      if (coverage.margin(low_x + 0.5 * side, low_y + 0.5 * side) < -reach - side * 0.7072) continue;
      for (int z = 0; z < boxes_along; ++z) {
        const double low_z = heights.first + z * tall;
        boxes.push_back({{low_x, low_y, low_z}, {low_x + side, low_y + side, low_z + tall}});
      }
    }
  return boxes;
}

}  // namespace vdvr
