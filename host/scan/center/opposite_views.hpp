// The centre from views that look along the same rays from either side.
#pragma once

#include <optional>
#include <vector>

#include "vdvr/expert/find_center.hpp"

namespace vdvr::center {

/// One witness of all pairs, and of each half of them where there are two at least.
struct OppositeViews {
  CenterWitness all;
  std::vector<CenterWitness> halves;
  double rival = 1;  ///< likelihood of the next best centre that is no neighbour, in that of the best
};

/// p(theta + 180 degrees)(i) = p(theta)(2 c - i), of pairs of views within half a step of opposite.
std::optional<OppositeViews> from_opposite_views(const ProjectionSet& scan);

}  // namespace vdvr::center
