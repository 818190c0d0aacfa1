// Signs of views that split a scan into halves.
#pragma once

#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// +1 and -1 in turn by the order of the views' angles; opposite views of parallel beam, which see the same
/// rays, have one sign.
std::vector<int> alternating_signs(const ProjectionSet& scan);

}  // namespace vdvr
