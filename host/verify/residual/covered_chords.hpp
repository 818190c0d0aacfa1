// The part of every measured ray of a row that lies in the covered region: a single interval, since the
// region is convex.
#pragma once

#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Of the ray of view j and column i, x = u cos - s sin, y = u sin + s cos, the part from first to last.
struct CoveredChords {
  std::vector<double> u;            ///< [view][column], in world units from the axis
  std::vector<double> first, last;  ///< [view][column]; first >= last where nothing is covered

  [[nodiscard]] double length(std::size_t ray) const { return last[ray] - first[ray]; }
};

/// `geometry.center` is the centre in use. Cost: views^2 * columns.
CoveredChords covered_chords(const ParallelGeometry& geometry);

}  // namespace vdvr
