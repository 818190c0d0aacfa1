// Angular weights w_k of filtered back-projection (docs/geometry.md). Called by filter_projections.cpp,
// fdk_weights.cpp and exact_field.cpp.
#pragma once

#include <numbers>
#include <vector>

namespace vdvr {

struct ViewWeights {
  std::vector<double> weight;  ///< per view, radians; they add to the period unless a gap was capped
  bool limited_angle = false;  ///< a gap above four medians was capped
  int grouped_views = 0;       ///< views that share their weight with a coincident one
};

/// Half the gap to both neighbouring angles modulo `period`: pi, as parallel rays have it, or 2 pi, to which
/// the weights then add. Views closer than 1e-3 of the median gap form a group that shares its weight, also
/// across the seam between 0 and the period.
ViewWeights view_weights(const std::vector<double>& theta_rad, double period = std::numbers::pi);

}  // namespace vdvr
