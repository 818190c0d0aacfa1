// Which samples of a grid the scan covers, and the range of a field over them: what a tolerance in percent is
// of.
#pragma once

#include <cstdint>
#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Of the certificate's `not_covered`: what the count is of.
inline constexpr const char* kNotCoveredRule =
    "a point is covered when all its projections fall on the detector; samples further outside than the "
    "diagonals of a cell of the grid and of the base are stored as 0";

/// Samples of a plane [y][x] that lie on the detector in every view.
std::vector<std::uint8_t> covered_in_plane(const Grid& grid, const Coverage& coverage);

std::int64_t count_not_covered(const Grid& grid, const Coverage& coverage);

/// Smallest and largest covered sample, and where they lie. Where the grid has no covered sample, as in a
/// scan of one row, whose only plane lies between samples: of all samples.
struct CoveredRange {
  double low = 0, high = 0;
  Index3 low_at{0, 0, 0}, high_at{0, 0, 0};
  std::int64_t not_covered = 0;
};
CoveredRange covered_range(const Volume& volume, const Coverage& coverage);

}  // namespace vdvr
