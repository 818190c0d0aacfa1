// Uniform FDK on the device.
#pragma once

#include "host/base/opencl/state.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/field/fbp/whole_volume.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

/// The grid is in the scan's units. Cost: views * samples updates. Memory: a band of the volume and as many
/// views as the rest of --max-memory holds.
void reconstruct_cone(opencl::State& state, const ScanInUnits& from, const Grid& grid,
                      const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                      StageWatch& watch);

/// What reconstruct_cone() does with filtered views: sum_k lambda_k^-depth_power q_k, with `rate` columns and
/// rows to a pixel. `depth_power`: 2 gives F; 4, of squared weights, its variance. Grid and views are in the
/// same units.
void back_project_views(opencl::State& state, const FilteredScan& filtered, const Grid& grid, int rate,
                        int depth_power, const Planes& planes, const Progress& progress, StageWatch& watch);

/// The smallest box of cells around the covered region's cylinder, or what the options say.
Grid make_cone_grid(const ProjectionSet& scan, const GridOptions& options);

}  // namespace vdvr
