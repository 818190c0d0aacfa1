// The slack T + P of every gold node of a batch of blocks, to either side: P and the remainder of T by base
// cell, second differences by gold cell (docs/error-bounds.md). Called by gold_stream.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/bound_table.hpp"
#include "host/fit_coefficients.hpp"
#include "host/gold_settings.hpp"
#include "host/projection_bounds.hpp"

namespace vdvr {

/// A slab: a run of base cells in z, and the size of its blocks.
struct SlabShape {
  std::int64_t cell_z = 0, cells_x = 0, cells_y = 0, cells_z = 0;
  double z_first = 0;
  std::int64_t stride = 0;  ///< of the slack's columns
};

class NodeSlack {
 public:
  /// `rounding`: the part of gold's fp32 error that differs from sample to sample; `arithmetic`: all of it.
  NodeSlack(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
            const GoldSettings& settings, double arithmetic, double rounding);

  /// Room for `together` blocks of a slab, and no tables yet.
  void begin(const SlabShape& slab, std::int64_t together);
  void end();
  /// above, below[block][y][x][stride] and p[block][cell z][y][x] of blocks whose first bricks are given. P
  /// of a base cell is computed once: later passes read it.
  void operator()(const GoldBlocks& blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                  const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                  opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below,
                  opencl::DeviceArray<float>& p);

  /// What the last call computed of base cells, in the order of its blocks; empty where it knew them all.
  [[nodiscard]] std::vector<float> new_cells(
      const SlabShape& slab, const std::vector<std::array<std::int64_t, 3>>& first_brick) const;
  /// Takes what new_cells() gave for the same blocks in an earlier process.
  void restore(const SlabShape& slab, const std::vector<std::array<std::int64_t, 3>>& first_brick,
               const std::vector<float>& cells);

  /// What rounding adds to every slack.
  [[nodiscard]] double rounding() const { return settings_.grid_only ? 0 : 1.5 * rounding_; }
  /// Seconds spent on tables since the last call.
  double take_table_seconds();

 private:
  [[nodiscard]] bool known(const std::array<std::int64_t, 3>& first) const;
  void look_up(std::int64_t blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
               opencl::DeviceArray<float>& p);
  void launch(const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
              const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
              opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below);

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  FieldSups sups_;
  const GoldSettings& settings_;
  double arithmetic_, rounding_, remainder_;
  std::vector<float> cell_p_;       // P per base cell once computed, [z][y][x]; negative: not yet
  std::vector<float> cell_addend_;  // 2.5 P and the remainder of T, alike
  bool computed_ = false;           // some cell, in the last call
  SlabShape slab_;
  std::optional<BoundTable> projection_, remainders_;  // of the slab, made when the first cell asks
  opencl::DeviceArray<float> addend_, cell_remainder_, cells_above_, cells_below_, rows_;
  double table_seconds_ = 0;
};

}  // namespace vdvr
