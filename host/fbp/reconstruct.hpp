// Uniform reconstruction from filtered projections, and what gold shares with it. Called by reconstruct.cpp,
// plan.cpp, gold_stream.cpp.
#pragma once

#include <string>
#include <vector>

#include "host/fbp/filter_projections.hpp"
#include "vdvr/grid.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {

/// Detector row positions of `count` heights.
std::vector<double> detector_rows(const ParallelGeometry& geometry, double first_z, double step,
                                  std::int64_t count);

/// Samples whose coverage margin across z is below minus this are stored as 0: no covered point is
/// interpolated from them, at any level and after closing.
double kept_margin(const Grid& grid, int rate);

/// The upsampled columns that cover every sample that may be kept.
UpsampledColumns columns_for(const ParallelGeometry& geometry, const Grid& grid, int upsampling);

Volume reconstruct_field(opencl::State& state, const FilteredScan& filtered, Upsampler& upsampler,
                         const Grid& grid, int upsampling, Interpolation interpolation,
                         const Progress& progress, StageSeconds* seconds = nullptr);

}  // namespace vdvr
