#include "vdvr/region_of_interest.hpp"

#include <algorithm>

namespace vdvr {

bool is_inside(const RegionOfInterest& region, const Vec3& point) {
  if (!region) return true;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(point[a] >= (*region)[a] && point[a] <= (*region)[a + 3])) return false;
  return true;
}

std::vector<std::uint8_t> bricks_of(const RegionOfInterest& region, const Grid& grid, int granularity) {
  const std::int64_t g = granularity;
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.cells[a] + g - 1) / g;
  std::vector<std::uint8_t> selected(static_cast<std::size_t>(n[0] * n[1] * n[2]), 1);
  if (!region) return selected;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const auto brick = static_cast<std::int64_t>(i);
    const Index3 p{brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto cells = static_cast<double>(grid.cells[a]);
      // Twice what section 8 of error-bounds.md charges for a rounded coordinate; the rest is for the bounds
      // computed here.
      const double margin = 0x1p-22 * cells * grid.spacing[a];
      const double low = grid.origin[a] + static_cast<double>(p[a] * g) * grid.spacing[a],
                   high = grid.origin[a] +
                          static_cast<double>(std::min(grid.cells[a], (p[a] + 1) * g)) * grid.spacing[a];
      if (high < (*region)[a] - margin || low > (*region)[a + 3] + margin) selected[i] = 0;
    }
  }
  return selected;
}

}  // namespace vdvr
