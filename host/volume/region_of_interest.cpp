#include "vdvr/expert/region_of_interest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

bool is_inside(const RegionOfInterest& region, const Vec3& point) {
  if (!region) return true;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(point[a] >= (*region)[a] && point[a] <= (*region)[a + 3])) return false;
  return true;
}

namespace {

// Whether a brick's closed interval along an axis meets the region's.
bool meets(const std::array<double, 6>& region, const Grid& grid, std::size_t axis, double low, double high) {
  // Twice what section 8 of error-bounds.md charges for a rounded coordinate; the rest is for the bounds
  // computed here.
  const double margin = 0x1p-22 * static_cast<double>(grid.cells[axis]) * grid.spacing[axis];
  return !(high < region[axis] - margin || low > region[axis + 3] + margin);
}

// Of an axis, the first and the last brick that meet the region, by their numbers.
std::pair<std::int64_t, std::int64_t> bricks_along(const std::array<double, 6>& region, const Grid& grid,
                                                   const Bricks& bricks, std::size_t axis) {
  std::int64_t first = -1, last = -1;
  for (std::int64_t i = 0; i < bricks.along()[axis]; ++i) {
    Index3 p{};
    p[axis] = i;
    const auto [low, high] = bricks.box(p);
    if (!meets(region, grid, axis, low[axis], high[axis])) continue;
    if (first < 0) first = i;
    last = i;
  }
  if (first >= 0) return {first, last};
  throw InputError(fmt::format(
      "`roi` from {:.6g} to {:.6g} along {} meets no brick of the grid, which lies between {:.6g} and {:.6g}",
      region[axis], region[axis + 3], "xyz"[axis], grid.origin[axis],
      grid.origin[axis] + static_cast<double>(grid.cells[axis]) * grid.spacing[axis]));
}

}  // namespace

std::vector<std::uint8_t> bricks_of(const RegionOfInterest& region, const Grid& grid, int granularity) {
  const Bricks bricks(grid, granularity);
  std::vector<std::uint8_t> selected(static_cast<std::size_t>(bricks.size()), 1);
  if (!region) return selected;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const auto [low, high] = bricks.box(bricks.position(static_cast<std::int64_t>(i)));
    for (std::size_t a = 0; a < 3; ++a)
      if (!meets(*region, grid, a, low[a], high[a])) selected[i] = 0;
  }
  return selected;
}

Grid cropped_to(const std::array<double, 6>& region, const Grid& grid, int granularity) {
  const Bricks bricks(grid, granularity);
  Grid out = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    auto [first, last] = bricks_along(region, grid, bricks, a);
    // The grid's last brick can be thinner than the others, and no grid is thinner than its bricks.
    if (first == last && last + 1 == bricks.along()[a] && first > 0) --first;
    const std::int64_t begin = first * granularity;
    out.cells[a] = std::min((last + 1) * granularity, grid.cells[a]) - begin;
    out.origin[a] += static_cast<double>(begin) * grid.spacing[a];
  }
  return out;
}

}  // namespace vdvr
