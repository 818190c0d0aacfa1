// Launcher of kernels/certify/gold/cell_test.cl: a stored field against F, brick by brick.
#pragma once

#include <cstdint>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/volume/sampler/device_field.hpp"
#include "shared/cell_test.h"
#include "shared/gold_shape.h"

namespace vdvr {

/// Blocks of gold on the device and what their cells add to second differences.
struct GoldOnDevice {
  const opencl::DeviceArray<float>& gold;        ///< [block][y + halo][x + halo][gold stride]
  const opencl::DeviceArray<float>& margin;      ///< [block][y + halo][x + halo]
  const opencl::DeviceArray<float>& addend;      ///< [block][brick z][brick y][brick x]
  const opencl::DeviceArray<float>& tolerances;  ///< the same: beyond which a part is violated
  const opencl::DeviceArray<cl_int4>& first_brick;
  VdvrGoldShape shape;
};

/// Per brick of the blocks, [block][z][y][x]; negative where no cell is tested.
struct CellTestResults {
  std::vector<float> total, error, slack;
  std::vector<std::uint32_t> violated;  ///< bits as in BrickMeasure
};

/// `selected` by brick of the grid; `brick_nodes`: granularity * rate. Cost: about 50 operations a node, and
/// the sampler.
CellTestResults cell_test(opencl::State& state, const DeviceField& field, const GoldOnDevice& gold,
                          const VdvrCellTest& test, const opencl::DeviceArray<std::uint8_t>& selected,
                          std::int64_t brick_nodes);

}  // namespace vdvr
