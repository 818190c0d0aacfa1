// F~ for `verify`: back-projected at nodes a quarter of a pixel apart across z and at the detector's rows (or
// at heights, where these are fewer), and interpolated to gold from there (docs/error-bounds.md, "What verify
// does", step 1). Shares nothing with build. Launches kernels/verify/witness/verify_nodes.cl.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/verify/witness/cone_nodes.hpp"
#include "host/verify/witness/cosine_transform.hpp"
#include "host/verify/witness/field_bounds.hpp"
#include "shared/verify_nodes.h"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Of parallel beam, nodes to a cell of the grid across z: the smallest power of two with which they lie at
/// most a quarter of a pixel apart. 2^24 where none does.
int nodes_across(const Grid& grid, const ParallelGeometry& geometry);

class VerifyNodes {
 public:
  /// What is back-projected at once. Places count from the grid's first sample.
  struct Part {
    int across = 1;                                         ///< nodes to a cell of the grid, across z
    int points = 12;                                        ///< of a polynomial between them
    std::int64_t first_x = 0, first_y = 0, nx = 0, ny = 0;  ///< nodes
    bool rows = true;                                       ///< along z: the detector's rows, or heights
    int along = 1;                                          ///< heights: to a cell of the grid
    std::int64_t first_z = 0, nz = 0;                       ///< heights
    std::vector<std::uint8_t> tiles;  ///< [y][x]: tiles of nodes that are wanted, tiles_across(n) a side
    /// Of cone beam, [tile][16 heights]: those of a wanted tile that are; all where empty.
    std::vector<std::uint8_t> blocks;
    /// Of cone beam, of a wanted tile the first and last x, then y, that are wanted; all where empty.
    std::vector<std::array<std::uint8_t, 4>> ranges;
    double furthest = HUGE_VAL;  ///< of cone beam: beyond the covered region across z no node is wanted
    [[nodiscard]] std::int64_t blocks_along() const { return (nz + 15) / 16; }
    /// Nodes that an interpolated value needs beyond itself, to either side.
    [[nodiscard]] std::int64_t reach() const { return points / 2 + 1; }
  };
  static std::int64_t tiles_across(std::int64_t nodes) {
    return (nodes + VDVR_VERIFY_TILE - 1) / VDVR_VERIFY_TILE;
  }
  /// What the wanted tiles of a part take of the device.
  [[nodiscard]] std::uint64_t bytes_of(const Part& part) const;

  /// Blocks of gold, all with the same heights. Places count gold nodes from the grid's first sample.
  struct Blocks {
    int rate = 1;                                        ///< not a divisor of `across` below it
    std::span<const std::array<std::int64_t, 2>> first;  ///< first node x, y
    std::int64_t nx = 0;                                 ///< nodes of a block's side
    std::int64_t first_z = 0, z_padded = 0;              ///< heights, to a multiple of 16
  };

  /// `field` outlives this object. Values are in `unit`. `furthest`: how far beyond the covered region,
  /// across z, a node may lie that is used.
  VerifyNodes(opencl::State& state, const ExactField& field, const Grid& grid, double unit, double furthest);
  /// Of cone beam: parts are of heights. `coverage` outlives this object.
  VerifyNodes(opencl::State& state, const ExactField& field, const Coverage& coverage, const Grid& grid,
              double unit);
  ~VerifyNodes();
  VerifyNodes(const VerifyNodes&) = delete;
  VerifyNodes& operator=(const VerifyNodes&) = delete;

  /// Back-projects. Cost (of cone beam, cone_nodes.hpp): rows * columns * (rows + 30 log2(columns))
  /// multiply-adds a view on the host, 7 multiply-adds a view and value on the device.
  void make(const Part& part);
  /// Gives back the memory of the part made last, and of what further parts would use again.
  void release();

  /// float gold[block][y][x][z_padded] of the part made last. Nodes without a complete stencil in it are
  /// finite and mean nothing.
  void gold(const Blocks& blocks, const opencl::DeviceArray<float>& values);
  /// Floats that this takes a block, beside `values`.
  [[nodiscard]] std::int64_t floats_per_block(const Part& part, int rate, std::int64_t nx,
                                              std::int64_t z_padded) const;

  /// How gold of that rate is made of this part's nodes, for its errors.
  [[nodiscard]] NodePath path(const Part& part, int rate) const;
  /// Of cone beam: of the part made last.
  [[nodiscard]] const ConeNodeFacts& cone_facts() const { return cone_facts_; }

 private:
  struct Table;
  struct Heights;
  void make_steps(const std::vector<std::array<std::int64_t, 2>>& tiles);
  void make_cone_nodes(std::vector<std::array<std::int64_t, 2>> tiles);
  void fill(std::int64_t first_row, std::int64_t first_view);
  void back_project(std::int64_t first_row);
  [[nodiscard]] Heights heights_of(const Blocks& blocks) const;
  [[nodiscard]] std::int64_t views_at_once() const;

  opencl::State& state_;
  const ExactField& field_;
  const Grid& grid_;
  double unit_;
  CosineTransform along_u_;
  double density_;                      // fine columns to a detector column
  std::int64_t pad_ = 0, columns_ = 0;  // fine columns
  double gain_ = 1;                     // of the detector's rows
  std::optional<VerifyConeNodes> cone_;
  ConeNodeFacts cone_facts_;
  Part part_;
  std::int64_t rows_padded_ = 0;
  std::optional<opencl::DeviceArray<float>> nodes_;
  std::optional<opencl::DeviceArray<cl_int>> slots_;  // [tile y][tile x]: its place among those wanted
  std::optional<opencl::DeviceArray<cl_float4>> steps_;
  std::unique_ptr<Table> table_;
  std::int64_t calls_ = 1;  // sums of views of the part made last
};

}  // namespace vdvr
