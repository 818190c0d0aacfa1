// The column onto which the rotation axis projects, found from the data (docs/inputs.md). Called by
// host/scan/read_scan.cpp.
#pragma once

#include <optional>
#include <string>

#include "vdvr/projections.hpp"

namespace vdvr {

struct CenterEstimate {
  double center = 0;   ///< column
  std::string method;  ///< one phrase for the user
  double quality = 0;  ///< in [0, 1]: share of the variance or energy that the mirror symmetry explains
};

/// Uses angles and data of `scan`, never its `center`. Searched are centres in the middle half of the
/// detector. Nothing where the views do not allow it or the symmetry explains less than half. Cost: about
/// columns^2 * 256 for opposite views; 8 * views * columns * 48 + 768 * views^2 for a half turn without them.
std::optional<CenterEstimate> find_center(const ProjectionSet& scan);

}  // namespace vdvr
