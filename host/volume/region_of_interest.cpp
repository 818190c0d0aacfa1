#include "vdvr/region_of_interest.hpp"

#include <algorithm>

#include "host/volume/bricks.hpp"

namespace vdvr {

bool is_inside(const RegionOfInterest& region, const Vec3& point) {
  if (!region) return true;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(point[a] >= (*region)[a] && point[a] <= (*region)[a + 3])) return false;
  return true;
}

std::vector<std::uint8_t> bricks_of(const RegionOfInterest& region, const Grid& grid, int granularity) {
  const Bricks bricks(grid, granularity);
  std::vector<std::uint8_t> selected(static_cast<std::size_t>(bricks.size()), 1);
  if (!region) return selected;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const auto [low, high] = bricks.box(bricks.position(static_cast<std::int64_t>(i)));
    for (std::size_t a = 0; a < 3; ++a) {
      const auto cells = static_cast<double>(grid.cells[a]);
      // Twice what section 8 of error-bounds.md charges for a rounded coordinate; the rest is for the bounds
      // computed here.
      const double margin = 0x1p-22 * cells * grid.spacing[a];
      if (high[a] < (*region)[a] - margin || low[a] > (*region)[a + 3] + margin) selected[i] = 0;
    }
  }
  return selected;
}

}  // namespace vdvr
