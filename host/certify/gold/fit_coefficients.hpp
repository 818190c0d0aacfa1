// Samples of a level, fitted to the trilinear filter: what a brick of that level stores need not lie on F
// (docs/error-bounds.md, section on coefficients).
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

/// Every spacing-th node of blocks of gold per axis: float[block][cy][cx][cz], node n at n / spacing + reach.
struct LevelSamples {
  VdvrLattice shape{};
  opencl::DeviceArray<float> samples;
  opencl::DeviceArray<float>
      along;  ///< interpolated along z: [block][cy][cx][gold_stride], node z at z + halo
};

/// Every step looks one sample spacing further, so that a block needs steps * spacing nodes of halo. Base
/// samples gain from many steps (most bricks read them), those of finer levels hardly after two.
constexpr int base_fit_steps = 12, level_fit_steps = 2;

/// Fits lattices of one batch of blocks; keeps its buffers from one to the next.
class LatticeFit {
 public:
  LatticeFit(opencl::State& state, const GoldBlocks& blocks);

  /// `spacing` along x, y, z; `steps` = 0: gold itself at the nodes. `curvature`: F lies about that many
  /// second differences below gold's interpolant, on average over a gold cell of the grid that is certified.
  /// `margin`: the blocks' margins. Right on the boxes wanted, and undefined further out, where halo >=
  /// steps * spacing; along an axis with less halo samples near the rim rest on the gold that is there. Valid
  /// until the next call. Cost: per step about two evaluations of the interpolant per gold node of the boxes,
  /// widened by as many spacings less a half; with a spacing of 2 on every axis, as base samples have it, a
  /// tenth of that. Memory: (3 + 1 / spacing z) / (spacing x spacing y) of the gold, and as much as the gold.
  const LevelSamples& operator()(const opencl::DeviceArray<float>& gold,
                                 const opencl::DeviceArray<float>& margin, const std::vector<NodeBox>& wanted,
                                 const Index3& spacing, int steps, float curvature);
  /// What the last call gave.
  [[nodiscard]] const LevelSamples& last() const { return level_; }

 private:
  void shape_for(const Index3& spacing);
  [[nodiscard]] VdvrGoldBlocks blocks_on_device() const;
  void mark(const std::vector<NodeBox>& wanted, int steps);
  void reserve(std::uint64_t gold, int steps);
  void fit(const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin, float curvature);
  void pool_and_shift(const opencl::DeviceArray<float>& margin);
  void fit_at_twice(const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                    int steps, float curvature);
  [[nodiscard]] cl_int samples_each() const;
  [[nodiscard]] opencl::Range parts_of_columns() const;
  void mark_last_steps(const std::vector<NodeBox>& wanted, int steps);

  opencl::State& state_;
  opencl::Defines defines_;  // of fit_coefficients.cl
  const GoldBlocks& blocks_;
  LevelSamples level_;
  [[nodiscard]] cl_uint runs_between(std::int64_t low, std::int64_t high) const;

  std::vector<cl_uint> host_wanted_, host_needed_;
  std::vector<cl_int> host_last_;
  opencl::DeviceArray<float> before_, errors_, low_, high_;
  opencl::DeviceArray<float> targets_, here_, there_;  // of fit_at_twice
  opencl::DeviceArray<cl_uint> wanted_;
  // Marked columns: of gold whose nodes take part, and of the lattice.
  struct Columns {
    std::int64_t count = 0;
    opencl::DeviceArray<VdvrMarkedColumn> on_device;
  };
  void list(Columns& columns, const std::vector<cl_uint>& runs, std::int64_t deep, std::int64_t wide);
  Columns nodes_, samples_;
  opencl::DeviceArray<cl_int> last_;
};

}  // namespace vdvr
