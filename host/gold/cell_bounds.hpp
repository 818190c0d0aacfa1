// P and the remainder of T by base cell, each computed once whichever gold asks (docs/error-bounds.md).
// Called by node_slack.cpp and gold_stream.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "host/bounds/bound_table.hpp"
#include "host/bounds/projection_bounds.hpp"
#include "host/gold/gold_settings.hpp"

namespace vdvr {

/// A run of base cells in z.
struct CellLayers {
  std::int64_t first = 0, count = 0;
  bool operator==(const CellLayers&) const = default;
};
/// Layers of equal blocks, in a slab of which tables are made.
struct SlabShape {
  std::int64_t cell_z = 0, cells_x = 0, cells_y = 0, cells_z = 0;
  double z_first = 0;
  std::int64_t stride = 0;  ///< of the slack's columns
  CellLayers slab;          ///< holds the layers
};

class CellBounds {
 public:
  using FirstBricks = std::vector<std::array<std::int64_t, 3>>;

  /// Right for gold at settings.rate and at settings.coarse_rate: P over the rows of the finer one, both over
  /// the neighbourhoods of the coarser one.
  CellBounds(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
             const GoldSettings& settings);

  /// p and remainder[block][cell z][y][x] of blocks of a slab whose first bricks are given, the remainder for
  /// gold at `rate`; 0 outside the grid. Cost: tables when the slab is new, then a sum over views per new
  /// cell.
  void look_up(const SlabShape& slab, const FirstBricks& first_brick, int rate, std::vector<float>& p,
               std::vector<float>& remainder);
  /// Forgets the tables, not the cells.
  void end();

  /// What the last look_up computed, in the order of its blocks; empty where it knew them all.
  [[nodiscard]] std::vector<float> new_cells(const SlabShape& slab, const FirstBricks& first_brick) const;
  /// Takes what new_cells() gave for the same blocks in an earlier process.
  void restore(const SlabShape& slab, const FirstBricks& first_brick, const std::vector<float>& cells);

  /// Seconds spent on tables since the last call.
  double take_table_seconds();

 private:
  void compute(const SlabShape& slab, const FirstBricks& first_brick);
  void make_tables(const CellLayers& slab);

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  FieldSups sups_;
  GoldSettings settings_;
  std::vector<float> p_;          // per base cell once computed, [z][y][x]; negative: not yet
  std::vector<float> remainder_;  // alike, for gold at coarse_rate
  bool computed_ = false;         // some cell, in the last look_up
  CellLayers slab_;
  std::optional<BoundTable> projection_, remainders_;  // of the slab, made when the first cell asks
  double table_seconds_ = 0;
};

}  // namespace vdvr
