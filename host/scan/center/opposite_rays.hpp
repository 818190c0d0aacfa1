// The centre of a cone-beam scan of a full turn.
#pragma once

#include <optional>

#include "host/scan/center/opposite_views.hpp"

namespace vdvr::center {

/// In the plane of the orbit every ray is measured from both of its ends: column u at angle theta, and column
/// 2 c - u at theta + 180 degrees - 2 gamma(u). Of the row that lies nearest to that plane, as the matrices
/// say; centres within a quarter of the detector about theirs. Nothing without a full turn.
std::optional<OppositeViews> from_opposite_rays(const ProjectionSet& scan);

}  // namespace vdvr::center
