// The slack T + P of every gold node of a batch of blocks, to either side: P and the remainder of T by base
// cell, second differences by gold cell (docs/error-bounds.md). Called by gold_stream.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/gold/cell_bounds.hpp"
#include "host/gold/fit_coefficients.hpp"

namespace vdvr {

class NodeSlack {
 public:
  /// `rounding`: the part of gold's fp32 error that differs from sample to sample; `arithmetic`: all of it.
  /// `cells` and `settings` are referred to.
  NodeSlack(opencl::State& state, CellBounds& cells, const FilteredScan& scan, const FieldSups& sups,
            const GoldSettings& settings, double arithmetic, double rounding);

  /// Room for `together` blocks of a slab.
  void begin(const SlabShape& slab, std::int64_t together);
  void end();
  /// above, below[block][y][x][stride] and p[block][cell z][y][x] of blocks whose first bricks are given.
  void operator()(const GoldBlocks& blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                  const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                  opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below,
                  opencl::DeviceArray<float>& p);

  /// What rounding adds to every slack.
  [[nodiscard]] double rounding() const { return settings_.grid_only ? 0 : 1.5 * rounding_; }

 private:
  void launch(const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
              const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
              opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below);

  opencl::State& state_;
  CellBounds& cells_;
  const GoldSettings& settings_;
  double arithmetic_, rounding_, remainder_;
  SlabShape slab_;
  opencl::DeviceArray<float> addend_, cells_above_, cells_below_, rows_;
};

}  // namespace vdvr
