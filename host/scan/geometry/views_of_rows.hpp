// Rows of a series of heights as the views saw them, for what compares neighbouring or opposite views.
#pragma once

#include <cstdint>
#include <optional>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Rows of a series as an ordinary scan without weights by height: of the views alone that see all of them.
/// Nothing where every view sees all heights, as of any
/// other scan.
std::optional<ProjectionSet> views_of_rows(const ProjectionSet& scan, std::int64_t first, std::int64_t rows);
/// Of as many rows about the middle, up to 16, as are seen from every direction.
std::optional<ProjectionSet> views_of_middle(const ProjectionSet& scan);

}  // namespace vdvr
