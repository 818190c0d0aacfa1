// Back-projection of cone-beam views onto a band of sample columns.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "host/field/fbp/dense_values.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// float values[view][column][row % rate][row / rate]: filtered views, `rate` columns and rows to a pixel,
/// with columns and rows of the mirror extension around them.
struct ConeTable {
  opencl::DeviceArray<float> values;
  int rate = 1;
  std::int64_t columns = 0, rows = 0, row_stride = 0;
  double first_column = 0, first_row = 0;  ///< detector places of the first ones
  std::int64_t first_view = 0, views = 0;
  bool vectors = true;  ///< of planes may read it
};

/// What samples that are wanted see of the detector, in pixels: a table has no more.
struct ConeReach {
  std::int64_t columns = 0;                  ///< beyond the detector on each side, mirrored
  std::int64_t first_row = 0, last_row = 0;  ///< mirrored beyond it
  bool vectors = true;  ///< of planes may read it: they reach further along rows than single ones
};

/// Whether vectors of planes pay: there are enough of them, and rows of the detector lie about as far apart.
bool planes_suit_vectors(const FilteredScan& scan, const Grid& grid);

/// Makes tables of a scan's views. Refers to the state and the scan.
class ConeTables {
 public:
  ConeTables(opencl::State& state, const FilteredScan& scan, int rate, const ConeReach& reach);
  /// Views [first, first + count). Cost: rate 1: a copy; else transforms of all rows and columns where the
  /// device has double precision and the table most of the detector's rows, or as Upsampler's.
  ConeTable operator()(std::int64_t first, std::int64_t views);
  /// Of a table, and of what it is made of on the way.
  [[nodiscard]] std::uint64_t bytes(std::int64_t views) const;

 private:
  void upsample(ConeTable& table);

  opencl::State& state_;
  const FilteredScan& scan_;
  int rate_;
  bool vectors_;
  UpsampledColumns columns_;
  std::int64_t first_row_ = 0, rows_ = 0, row_stride_ = 0;
  Upsampler upsampler_;
  std::optional<DenseValues> dense_;
};

/// Samples of `grid` with x, all rows from `first_y` and planes from `first_z`.
struct ConeBand {
  const Grid* grid = nullptr;
  std::int64_t first_y = 0, ny = 0, first_z = 0, nz = 0;
  /// [y][x]: first and last plane wanted, counted from first_z; others hold anything or what they held.
  std::vector<std::array<std::int32_t, 2>> wanted{};
  bool adds = false;    ///< to what `out` holds
  int depth_power = 2;  ///< samples are weighed with lambda to minus this: 2, or 4 for squared weights

  [[nodiscard]] std::int64_t nx() const { return grid->samples()[0]; }
};

/// float out[y][x][column_stride(nz)]. Enqueues; does not wait. Cost: wanted samples times views updates.
void cone_back_project(opencl::State& state, const FilteredScan& scan, const ConeTable& table,
                       const ConeBand& band, opencl::DeviceArray<float>& out);
/// The same with vectors of so many lanes.
void cone_back_project(opencl::State& state, const FilteredScan& scan, const ConeTable& table,
                       const ConeBand& band, opencl::DeviceArray<float>& out, int lanes);

}  // namespace vdvr
