// Finer columns of detector rows in double precision, at a cost that grows with the columns times their
// logarithm (docs/geometry.md). Its errors are bounded by projection_bounds.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "shared/chunks.h"

namespace vdvr {

/// Taps on half columns (detector columns and the values half-way between) around a place between two of
/// them; the nodes are 1 - taps / 2 .. taps / 2, the place lies between 0 and 1.
constexpr int half_column_taps = 32;
/// A sinc in a Kaiser window: frequencies up to pi / 2 a node pass, those above 3 pi / 2 do not.
std::vector<double> taps_between_half_columns(double place, int taps = half_column_taps);

/// What the transforms err: a value half-way between columns is this times the largest norm of a row of its
/// view off, before it is used; that of a detector column is exact.
double half_column_error(std::int64_t columns);

class ColumnUpsampling {
 public:
  /// Whether the device has what it takes: double precision.
  static bool is_possible(const opencl::State& state);
  /// `rate`: finer columns to a detector column, even. Cost: a transform's spectrum, summed directly.
  ColumnUpsampling(opencl::State& state, std::int64_t columns, int rate);

  /// float in, out [16 rows in a chunk], columns of `columns` at detector positions of upsampled_columns.
  /// Each value is rounded once. Cost: views * chunks * 16 * (2 transforms of three to six times the columns,
  /// and 32 multiply-adds a finer column). Enqueues only. Memory: what the work-items transform, at most 256
  /// MiB.
  void operator()(const opencl::DeviceArray<float>& out, const VdvrChunks& out_places,
                  const opencl::DeviceArray<float>& in, const VdvrChunks& in_places,
                  const UpsampledColumns& columns, std::int64_t views, std::int64_t chunks);

 private:
  opencl::State& state_;
  std::int64_t columns_, length_;
  int rate_;
  opencl::DeviceArray<double> root_, spectrum_, taps_, scratch_;
};

}  // namespace vdvr
