// Back-projection of an upsampled slab onto blocks of sample columns.
#pragma once

#include <array>
#include <vector>

#include "host/field/fbp/filter_projections.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr {

/// Equal blocks of nx x ny columns; block b's first column lies at `first[b]` (world x, y), the next at +
/// step.
struct ColumnBlocks {
  std::int64_t nx = 0, ny = 0;
  double step_x = 1, step_y = 1;
  std::vector<std::array<double, 2>> first;
  /// [block][y]: first and last column wanted; others keep what `out` held. Empty: all.
  std::vector<std::array<std::int32_t, 2>> wanted{};
  /// Of the slab's rows, a multiple of 16 first; -1: all.
  std::int64_t first_row = 0, rows = -1;
  /// Floats from one column of `out` to the next, and where in a column the first row goes, a multiple of 16;
  /// 0: column_stride(rows).
  std::int64_t out_stride = 0, out_row = 0;
};

/// float out[block][y][x][column_stride(rows)] = sum over the slab's views of q at t(x, y). Enqueues; does
/// not wait. Cost: blocks * ny * nx * z * views updates.
void back_project(opencl::State& state, const ParallelGeometry& geometry, const UpsampledSlab& slab,
                  const ColumnBlocks& blocks, Interpolation interpolation, opencl::DeviceArray<float>& out);

/// The same with launch parameters of the caller's, for tests and for tuning.
void back_project(opencl::State& state, const ParallelGeometry& geometry, const UpsampledSlab& slab,
                  const ColumnBlocks& blocks, Interpolation interpolation, opencl::DeviceArray<float>& out,
                  const ColumnTuning& tuning);

/// Views that are summed before their sum is added to the others': 64 multiply-adds. With six taps, whose
/// roundings what follows multiplies, sums of six products are summed, and what adding their runs rounds off
/// is summed beside them.
inline std::int64_t view_run(Interpolation interpolation) {
  return interpolation == Interpolation::six_taps ? 6 : interpolation == Interpolation::cubic ? 16 : 32;
}

/// Floats from one column of samples to the next: a multiple of 16, and an odd one, so that neighbours do not
/// share cache sets.
std::int64_t column_stride(std::int64_t rows);

/// A bound on the fp32 error of the positions s, in upsampled columns, for such blocks (docs/error-bounds.md,
/// section 7).
double position_error(const ParallelGeometry& geometry, const UpsampledColumns& columns,
                      const ColumnBlocks& blocks);

}  // namespace vdvr
