// What commands say of a scan's cone-beam geometry. Called by info and by print_scan.
#pragma once

#include "apps/vdvr/output.hpp"

namespace vdvr::cli {

/// Smallest and largest of what differs from view to view; angles in degrees; the matrices as they are used.
Json cone_json(const ProjectionSet& scan);
/// Distances, pitches, angles and tilts, a few lines.
void print_cone(const ProjectionSet& scan);

}  // namespace vdvr::cli
