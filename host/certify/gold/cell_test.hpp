// Launcher of kernels/certify/gold/cell_test.cl: a stored field against F, brick by brick.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/volume/sampler/device_field.hpp"
#include "shared/cell_test.h"
#include "shared/gold_shape.h"

namespace vdvr {

/// Cells of gold in a brick: x, y, z of the first, and of what follows the last. All of them, as it is made.
struct CellBox {
  std::array<std::int16_t, 3> first{0, 0, 0}, end{INT16_MAX, INT16_MAX, INT16_MAX};
  bool operator==(const CellBox&) const = default;
};

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
  std::vector<float> passed;            ///< the largest total up to the tolerance, or up to 0
  std::vector<CellBox> open;            ///< around the cells of larger ones; first > end where there are none
  std::vector<std::uint32_t> violated;  ///< bits as in BrickMeasure
};

/// `selected` by brick of the grid; `boxes` per brick of the blocks: the cells to test; `brick_nodes`:
/// granularity * rate. Cost: about 50 operations a node, and the sampler.
CellTestResults cell_test(opencl::State& state, const DeviceField& field, const GoldOnDevice& gold,
                          const VdvrCellTest& test, const opencl::DeviceArray<std::uint8_t>& selected,
                          std::span<const CellBox> boxes, std::int64_t brick_nodes);

}  // namespace vdvr
