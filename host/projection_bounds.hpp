// Bounds that rest on the filtered projections: sups per view, P per base cell, the constant part of T,
// amplitude bounds (docs/error-bounds.md). Called by plan.cpp and gold_stream.cpp.
#pragma once

#include <string>
#include <vector>

#include "host/back_project.hpp"
#include "host/filter_projections.hpp"
#include "vdvr/certificate.hpp"
#include "vdvr/grid.hpp"

namespace vdvr {

/// What a scan allows to be said before any gold sample exists; sums over the views, weights included.
struct FieldSups {
  double value = 0;     ///< sum over views of sup |q|
  double second_u = 0;  ///< of sup |q_uu|
  double second_v = 0;  ///< of sup |q_vv|
  double sampled_second_u =
      0;  ///< of the largest |q_uu| at the detector's own samples: what the paper's Eq. 7 takes
  double sampled_second_v = 0;
};

/// Cost: three derivatives on a grid 4 times denser than the detector both ways.
FieldSups field_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan);

/// Bounds the growth of sample errors by band-limited interpolation of n samples (Lebesgue constant of the
/// mirror extension).
double lebesgue_constant(std::int64_t n);

/// T's part that does not come from second differences of gold: their distance from the second derivatives,
/// and how far those rise inside a gold cell.
double gold_remainder(const FilteredScan& scan, const FieldSups& sups, const Grid& grid, int rate);

/// fp32 rounding of the whole chain from filter to back-projection, largest over the samples of such blocks.
double arithmetic_bound(Upsampler& upsampler, const FilteredScan& scan, const FieldSups& sups,
                        const UpsampledColumns& columns, const ColumnBlocks& blocks,
                        const std::string& u_filter);

/// Derivative maxima under the shadow of a base cell centred on each column, for the slab whose rows are the
/// gold rows -1 .. cells_z * rate + 1 of its base cells.
struct BoundTable {
  opencl::DeviceArray<cl_float2> values;  ///< [base cell z][view][column]
  UpsampledColumns columns;
  std::int64_t cells_z = 0;
  double factor = 0;  ///< times the summed maxima: the error of interpolating in u
};
/// `columns` is where derivatives are evaluated, at most as dense as the `upsampling` whose interpolation is
/// bounded.
BoundTable bound_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                       const UpsampledColumns& columns, int upsampling, const std::string& u_filter,
                       const std::vector<double>& rows, const Grid& grid, int rate, std::int64_t cells_z);

/// P of every base cell of blocks of cells_x x cells_y: float p[block][z][y][x]. `blocks.first` and
/// `blocks.step_*` are gold nodes. Enqueues; does not wait.
void project_bound(opencl::State& state, const FilteredScan& scan, const BoundTable& table,
                   const ColumnBlocks& blocks, std::int64_t cells_x, std::int64_t cells_y, int rate,
                   opencl::DeviceArray<float>& p);

/// Amplitude bounds: sum of |A| e, e = sum over the axes of 1 - cos(k d / 2), over the spectrum of the mirror
/// extension, for interpolation in u at each rate and for gold at each rate. Cost: views * rows * columns per
/// rate, on the host.
struct AmplitudeBounds {
  std::vector<std::pair<int, double>> projection, gold;
};
AmplitudeBounds amplitude_bounds(const FilteredScan& scan, const Grid& grid, const std::vector<int>& rates);

}  // namespace vdvr
