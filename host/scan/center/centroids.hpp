// The centre from the views' centroids.
#pragma once

#include <optional>

#include "vdvr/expert/find_center.hpp"

namespace vdvr::center {

/// The centroid of an object that every view sees whole moves as c + x cos(theta) + y sin(theta), of any arc.
/// Nothing where the detector's edges are not empty, the total of the line integrals varies from view to view
/// (the object is cut, or the air is not 0), or the arc is too short to tell c from the motion.
std::optional<CenterWitness> from_centroids(const ProjectionSet& scan);

}  // namespace vdvr::center
