// The centre from half a turn without its end, which has no opposite views.
#pragma once

#include <optional>

#include "vdvr/expert/find_center.hpp"

namespace vdvr::center {

/// By the empty double wedge in the spectrum of the half turn and its mirror image. The views, or the first
/// half turn of them, must be spread evenly. It cannot tell centres apart that lie half a detector from each
/// other: of two, the one closer to `near`, by default to the detector's middle.
std::optional<CenterWitness> from_symmetry(const ProjectionSet& scan, std::optional<double> near);

/// By its ends: views that are one, two and three steps short of opposite, registered, and the line through
/// what these say.
std::optional<CenterWitness> from_ends(const ProjectionSet& scan);

}  // namespace vdvr::center
