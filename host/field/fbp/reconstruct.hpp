// Uniform reconstruction from filtered projections, and what gold shares with it.
#pragma once

#include <vector>

#include "host/field/fbp/filter_projections.hpp"
#include "host/field/fbp/whole_volume.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/reconstruct.hpp"

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

/// Columns of z become rows of x, of one y: `columns` has nz samples of each x, `stride` apart; those of
/// kept[0] .. kept[1] go to target[z][x], planes `plane` apart.
void transpose_row(std::span<const float> columns, std::int64_t stride, std::int64_t nz,
                   std::array<std::int32_t, 2> kept, float* target, std::int64_t plane);

/// FBP of a scan; the grid is in its units. Cost and memory: as reconstruct_planes().
void reconstruct_parallel(opencl::State& state, const ScanInUnits& from, const Grid& grid,
                          const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                          StageWatch& watch);

}  // namespace vdvr
