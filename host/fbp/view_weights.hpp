// Angular weights w_k of filtered back-projection (docs/geometry.md). Called by filter_projections.cpp and
// exact_field.cpp.
#pragma once

#include <string>
#include <vector>

namespace vdvr {

struct ViewWeights {
  std::vector<double> weight;  ///< per view, radians; they add to pi unless a gap was capped
  bool limited_angle = false;  ///< a gap above four medians was capped
  int grouped_views = 0;       ///< views that share their weight with a coincident one
};

/// Half the gap to both neighbouring angles modulo pi. Views closer than 1e-3 of the median gap form a group
/// that shares its weight, also across the 0/pi seam.
ViewWeights view_weights(const std::vector<double>& theta_rad);

}  // namespace vdvr
