// Base samples fitted to the trilinear filter: what most bricks read need not lie on F
// (docs/error-bounds.md, section 13).
#pragma once

#include <cstdint>
#include <vector>

#include "host/base/opencl/work_groups.hpp"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Blocks of gold on the device: gold float[block][y + halo][x + halo][gold_stride] with node z at z + halo,
/// margin float[block][y + halo][x + halo].
struct GoldBlocks {
  std::int64_t count = 0;
  std::int64_t nx = 0, ny = 0, nz = 0, halo = 1, gold_stride = 0;  ///< nodes without the halo
  float lowest = 0;                      ///< columns with a smaller margin are not tested
  std::int64_t z_first = 0, z_last = 0;  ///< tested nodes along z
};

/// Nodes first .. last of a block, x, y, z, on which samples are wanted: closed.
struct NodeBox {
  std::int64_t block = 0;
  Index3 first{}, last{};
};

/// Every second node of blocks of gold: samples float[block][cy][cx][cz], node n at n / 2 + reach.
struct BaseLattice {
  VdvrLattice shape{};
  opencl::DeviceArray<float> samples;
};

/// Every step looks one sample further, so that a block needs twice as many nodes of halo. Most bricks read
/// base samples, so that they gain from many.
constexpr int base_fit_steps = 12;
/// Of the middle of the errors around a sample, what a step takes from it: 1 would overshoot, since a shift
/// moves the interpolant around the neighbours too.
constexpr float fit_share = 0.8f;

/// Fits the lattices of one batch of blocks of gold at twice the base's rate; keeps its buffers from one to
/// the next.
class BaseFit {
 public:
  BaseFit(opencl::State& state, const GoldBlocks& blocks) : state_(state), blocks_(blocks) {}

  /// `steps` = 0: gold itself at the nodes. `curvature`: F lies about that many second differences below
  /// gold's interpolant, on average over a gold cell of the grid that is certified. `margin`: the blocks'
  /// margins. Right on the boxes wanted, and undefined further out, where halo >= 2 steps; with less, samples
  /// near the rim rest on the gold that is there. Valid until the next call. Cost: per step about 27
  /// evaluations of the interpolant per sample of columns on the boxes, and as many around as steps follow.
  /// Memory: a quarter more than the gold.
  const BaseLattice& operator()(const opencl::DeviceArray<float>& gold,
                                const opencl::DeviceArray<float>& margin, const std::vector<NodeBox>& wanted,
                                int steps, float curvature);

 private:
  void shape();
  [[nodiscard]] VdvrGoldBlocks blocks_on_device() const;
  void mark_last_steps(const std::vector<NodeBox>& wanted, int steps);

  opencl::State& state_;
  const GoldBlocks& blocks_;
  BaseLattice base_;
  std::vector<cl_int> host_last_;
  opencl::DeviceArray<float> targets_, here_, there_;
  opencl::DeviceArray<cl_int> last_;
};

}  // namespace vdvr
