// How the kernels that carry columns of z are launched, by device class: never changes what they compute
// beyond rounding.
#pragma once

#include <array>
#include <cstdint>

#include "vdvr/device.hpp"

namespace vdvr {

/// One row of the recorded table (host/base/opencl/column_tuning.cpp); bench/back_project_bench times
/// candidates.
struct ColumnTuning {
  int lanes = 16;   ///< samples of z per work-item: VDVR_LANES
  int tile = 8;     ///< columns of a back-projection's work-item: VDVR_TILE, 1 or 8
  int vectors = 1;  ///< of z per work-item of a back-projection: VDVR_VECTORS, 1 or 2
  int tiles = 1;    ///< of a work-item of a back-projection, along x: VDVR_TILES_X; along y as many columns
  std::array<std::uint64_t, 3> local{1, 16, 16};  ///< work-group
  /// Rows of at most so many columns are ramp-filtered by a matrix product, others by FFT.
  std::int64_t product_columns = 2048;
};

ColumnTuning column_tuning(const DeviceInfo& device);

/// Whether a work-item of many lanes becomes vector instructions: of processors, by PoCL's and Intel's
/// compilers. Others get a lane a work-item. Mesa's rusticl is one: it joins work-items itself, states a
/// vector width of 1, and does not finish the kernels of 16 lanes.
bool carries_lanes(const DeviceInfo& device);

}  // namespace vdvr
