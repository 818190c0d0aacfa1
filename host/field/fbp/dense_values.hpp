// The filtered projections on a lattice denser than the detector both ways: columns first, then rows by
// transforms as well, so that each value errs by some u of the largest.
#pragma once

#include "host/field/fbp/filter_projections.hpp"

namespace vdvr {

class DenseValues {
 public:
  /// Whether the device has what it takes and the detector at least so many rows.
  static bool suit(const opencl::State& state, const ParallelGeometry& geometry, std::int64_t fewest_rows);

  /// Columns and rows at even rates. Refers to all but these.
  DenseValues(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
              const UpsampledColumns& columns, const UpsampledColumns& rows);

  /// float values[column / 16][view][row][16] of these views, until the next call. Cost: that of the
  /// upsampler's columns, and of transforms of their rows. Memory: the values, and a sixth of them on the
  /// way.
  const opencl::DeviceArray<float>& operator()(std::int64_t first, std::int64_t views);
  [[nodiscard]] std::uint64_t bytes(std::int64_t views) const;

  /// Which rows of whole columns, and how they lie: `phases` of them to a row of the detector, or all in one.
  struct WholeColumns {
    std::int64_t first = 0, rows = 0, phases = 1, phase_stride = 0;
  };
  /// The same as float out[view][column][row % phases][row / phases], rows counted from the first wanted one,
  /// phases `phase_stride` apart, 0 beyond the last. Enqueues only.
  void join(const opencl::DeviceArray<float>& out, std::int64_t first, std::int64_t views,
            const WholeColumns& wanted);

  [[nodiscard]] const UpsampledColumns& columns() const { return columns_; }
  [[nodiscard]] const UpsampledColumns& rows() const { return rows_; }

 private:
  [[nodiscard]] std::int64_t chunks() const { return (columns_.count + 15) / 16; }
  void resize(opencl::DeviceArray<float>& array, std::uint64_t size, const char* what);

  opencl::State& state_;
  Upsampler& upsampler_;
  const FilteredScan& scan_;
  UpsampledColumns columns_, rows_;
  ColumnUpsampling along_v_;
  std::vector<double> own_rows_;
  opencl::DeviceArray<float> turned_, values_;
};

}  // namespace vdvr
