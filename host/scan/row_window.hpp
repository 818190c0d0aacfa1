// Some rows of a scan, taken for a scan of their own: what a plan of a large scan judges from.
#pragma once

#include <optional>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct RowWindow {
  ProjectionSet scan;
  Grid grid;                         ///< the cells that these rows cover, in the window's own coordinates
  std::int64_t first = 0, rows = 0;  ///< of the detector
};

/// Neighbouring rows of the detector that hold about `most_samples` and in which, of those that the grid
/// covers, as much goes on as in all of them; nothing where all rows are few enough, or where the grid has no
/// cell between them. Copies those rows. Cost: a look at twelve views.
std::optional<RowWindow> row_window(const ProjectionSet& scan, const Grid& grid, std::int64_t most_samples);

}  // namespace vdvr
