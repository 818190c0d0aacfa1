// The slack T + P of every gold node of a batch of blocks, to either side: P a constant, the remainder of T by brick,
// second differences by gold cell (docs/error-bounds.md). Called by gold_stream.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/gold/fit_coefficients.hpp"
#include "host/gold/gold_source.hpp"

namespace vdvr {

/// Equal blocks of base cells.
struct SlabShape {
  std::int64_t cell_z = 0, cells_x = 0, cells_y = 0, cells_z = 0;
  double z_first = 0;
  std::int64_t stride = 0;  ///< of the slack's columns
};

class NodeSlack {
 public:
  /// `errors`: of gold on `lattice`. `remainder` and `settings` are referred to.
  NodeSlack(opencl::State& state, const BrickRemainder& remainder, const GoldLattice& lattice, const GoldErrors& errors,
            const GoldSettings& settings);

  /// Room for `together` blocks of a slab.
  void begin(const SlabShape& slab, std::int64_t together);
  void end();
  /// above, below[block][y][x][stride] of blocks whose first bricks are given; the remainder must know them.
  void operator()(const GoldBlocks& blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                  const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                  opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below);

  /// What rounding adds to every slack.
  [[nodiscard]] double rounding() const { return settings_.grid_only ? 0 : errors_.curved_rounding; }

 private:
  void launch(const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
              const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
              opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below);

  opencl::State& state_;
  const BrickRemainder& remainder_;
  GoldLattice lattice_;
  GoldErrors errors_;
  const GoldSettings& settings_;
  SlabShape slab_;
  opencl::DeviceArray<float> addend_, cells_above_, cells_below_, rows_;
};

}  // namespace vdvr
