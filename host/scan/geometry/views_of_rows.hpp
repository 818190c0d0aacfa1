// Rows of a series of heights as the views saw them, for what compares neighbouring or opposite views.
#pragma once

#include <cstdint>
#include <optional>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Whether views see a part of the heights each: of a helix, not of stands whose views were joined, and of no
/// other scan.
bool views_see_parts(const ParallelGeometry& geometry);
/// Where they do, rows as an ordinary scan without weights by height: of the views alone that see all of
/// them.
std::optional<ProjectionSet> views_of_rows(const ProjectionSet& scan, std::int64_t first, std::int64_t rows);
/// Of as many rows about the middle, up to 16, as are seen from every direction.
std::optional<ProjectionSet> views_of_middle(const ProjectionSet& scan);

}  // namespace vdvr
