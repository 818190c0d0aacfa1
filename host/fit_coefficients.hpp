// Samples of a level, fitted to the trilinear filter: what a brick of that level stores need not lie on F
// (docs/error-bounds.md, section on coefficients). Called by host/gold_batch.cpp.
#pragma once

#include <cstdint>

#include "host/opencl/array.hpp"

namespace vdvr {

/// Blocks of gold on the device: gold float[block][y + halo][x + halo][gold_stride] with node z at z + halo,
/// margin float[block][y + halo][x + halo].
struct GoldBlocks {
  std::int64_t count = 0;
  std::int64_t nx = 0, ny = 0, nz = 0, halo = 1, gold_stride = 0;  ///< nodes without the halo
  float lowest = 0;                      ///< columns with a smaller margin are not tested
  std::int64_t z_first = 0, z_last = 0;  ///< tested nodes along z
};

/// Every `spacing`-th node of blocks of gold: float[block][cy][cx][stride], node n at n / spacing + reach.
struct LevelSamples {
  std::int64_t spacing = 1, reach = 0, cx = 0, cy = 0, cz = 0, stride = 0;
  opencl::DeviceArray<float> samples;
  opencl::DeviceArray<float>
      along;  ///< interpolated along z: [block][cy][cx][gold_stride], node z at z + halo
};

/// Every step looks one sample spacing further, so that a block needs steps * spacing nodes of halo. Base
/// samples gain from many steps (most bricks read them), those of finer levels hardly after two.
constexpr int base_fit_steps = 12, level_fit_steps = 2;

/// `steps` = 0: gold itself at the nodes. `curvature`: F lies about that many second differences below gold's
/// interpolant, on average over a gold cell of the grid that is certified. Right inside the blocks where halo
/// >= steps * spacing. Cost: per step about two evaluations of the interpolant per gold node. Memory: (2 + 2
/// / spacing) / spacing^2 of the gold.
LevelSamples fit_lattice(opencl::State& state, const GoldBlocks& blocks,
                         const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                         std::int64_t spacing, int steps, float curvature);

}  // namespace vdvr
