// Boxes that cover what is certified of a cone-beam scan, for bounds that hold box by box. Called by
// projection_bounds.cpp and cone_tiles.cpp.
#pragma once

#include <vector>

#include "host/fbp/coverage.hpp"

namespace vdvr {

struct RegionBox {
  Vec3 low{}, high{};
};

/// Upright boxes that hold every point at most `reach` outside the covered region across z, and between the
/// heights. Some 16 across, four along z.
std::vector<RegionBox> region_boxes(const Coverage& coverage, double reach,
                                    const std::pair<double, double>& heights);

}  // namespace vdvr
