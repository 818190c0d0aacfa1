// What a region of interest certifies: the points of its closed box (docs/error-bounds.md, section 1).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// {x0, y0, z0, x1, y1, z1}; none: all of space.
using RegionOfInterest = std::optional<std::array<double, 6>>;

/// Whether a certificate with this region speaks of the point.
VDVR_API bool is_inside(const RegionOfInterest& region, const Vec3& point);

/// [bz][by][bx]: bricks that hold a point of the region, or that a sampler may read for one: its coordinate
/// in fp32 can end in the next brick.
VDVR_API std::vector<std::uint8_t> bricks_of(const RegionOfInterest& region, const Grid& grid,
                                             int granularity);

/// The grid's bricks that bricks_of selects, from the first to the last along each axis, as a grid of their
/// own: its samples and bricks are some of the grid's. Throws InputError where there are none.
VDVR_API Grid cropped_to(const std::array<double, 6>& region, const Grid& grid, int granularity);

}  // namespace vdvr
