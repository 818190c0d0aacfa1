// Uniform FDK on the device. Called by reconstruct_scan.cpp.
#pragma once

#include <cstdint>
#include <functional>

#include "host/fbp/whole_volume.hpp"
#include "host/opencl/state.hpp"
#include "host/scan/units.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {

/// The grid is in `units`. Cost: views * samples updates. Memory: a band of the volume and as many views as
/// the rest of --max-memory holds.
void reconstruct_cone(opencl::State& state, const ProjectionSet& scan, const Units& units, const Grid& grid,
                      const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                      StageWatch& watch);

/// The smallest box of cells around the covered region's cylinder, or what the options say.
Grid make_cone_grid(const ProjectionSet& scan, const GridOptions& options);

}  // namespace vdvr
