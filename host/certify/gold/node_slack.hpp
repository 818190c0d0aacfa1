// The slack T + P of every gold node of a batch of blocks, to either side: P a constant, the remainder of T
// by brick, second differences by gold cell (docs/error-bounds.md).
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "host/certify/gold/fit_base.hpp"
#include "host/certify/gold/gold_source.hpp"

namespace vdvr {

/// Equal blocks of base cells.
struct SlabShape {
  std::int64_t cell_z = 0, cells_x = 0, cells_y = 0, cells_z = 0;
  double z_first = 0;
  std::int64_t stride = 0;  ///< of the slack's columns
};

/// What bricks of blocks whose first ones are given add to an eighth of second differences, to either side:
/// interpolation, rounding and the remainder of T. float[block][brick z][brick y][brick x], 0 beyond the
/// grid; the remainder must know them.
std::vector<float> brick_addends(const BrickRemainder& remainder, const GoldLattice& lattice,
                                 const GoldErrors& errors, const GoldSettings& settings, const Index3& block,
                                 const std::vector<std::array<std::int64_t, 3>>& first_brick);

/// The window, widened by what a node of gold may err beside P.
std::pair<double, double> widened_window(const GoldErrors& errors, const GoldSettings& settings);

/// What node_slack needs beside gold.
struct SlackShape {
  SlabShape slab;
  Index3 bricks{};  ///< of a block
  GoldErrors errors;
  float curvature = 0.125f;  ///< of the second differences
};

/// above, below float[block][y][x][slab.stride] of blocks whose first bricks are given, from gold, coverage
/// margins and what their bricks add. Enqueues. Cost: two passes over arrays of gold's size.
void node_slack(opencl::State& state, const GoldSettings& settings, const SlackShape& shape,
                const GoldBlocks& blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                const opencl::DeviceArray<float>& addend, opencl::DeviceArray<float>& above,
                opencl::DeviceArray<float>& below);

}  // namespace vdvr
