// Kept nodes of cone beam: tiles of them back-projected from tables of the filtered views, and what they and
// the filters between them err (docs/error-bounds.md, section 16). Called by kept_gold.cpp. Launches
// kernels/kept/cone_nodes.cl.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "host/bounds/projection_bounds.hpp"
#include "host/fbp/coverage.hpp"
#include "host/fbp/filter_projections.hpp"
#include "host/fdk/view_derivatives.hpp"
#include "host/kept/gold_filters.hpp"
#include "host/kept/projective_error.hpp"
#include "vdvr/grid.hpp"
#include "vdvr/progress.hpp"
#include "shared/cone_nodes.h"

namespace vdvr {

/// Which nodes are kept: node (0, 0, 0) is the grid's first sample.
struct ConeLattice {
  Vec3 origin{}, spacing{};
  std::int64_t low = 0, count = 0;                ///< heights, the lowest may be negative
  std::int64_t stride = 0;                        ///< floats from column to column of a tile
  double reach = 0;                               ///< across z, beyond the covered region
  std::int64_t first_group = 0, groups = 0;       ///< of eight heights from `low` on: those that are computed
};

/// Tiles of 32 x 32 columns of nodes, all with the same heights, one after another.
struct ConeTilesAt {
  std::vector<std::array<double, 2>> first;             ///< of each, its first column's place
  std::vector<std::array<std::int32_t, 2>> wanted;      ///< [tile][y]: first and last column
};

class ConeTiles {
 public:
  /// Everything is referred to but the lattice. Throws InputError where nodes reach a source's plane.
  ConeTiles(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
            const Coverage& coverage, const ConeLattice& lattice);

  /// Heights from the covered ones outwards that nodes are wanted at.
  static std::pair<double, double> heights_wanted(const Coverage& coverage, const Grid& grid, double spacing);

  /// float out[tile][y][x][stride] += F; pages of tiles, each with those that follow the last page's. Cost: 12
  /// multiply-adds a view and node, and tables of all views.
  void back_project(std::span<const std::pair<const opencl::DeviceArray<float>*, ConeTilesAt>> pages,
                    const Progress& progress);

  /// At least sum_k lambda^-2 sup |q_k| wherever nodes are kept.
  [[nodiscard]] double sup() const { return sup_; }
  /// The highest frequency of a view at kept nodes, radians a node.
  [[nodiscard]] double band(std::size_t axis) const { return band_[axis]; }
  /// What nodes err: of interpolation in the tables, and of fp32.
  struct Errors {
    double interpolation = 0, rounding = 0;
  };
  [[nodiscard]] Errors errors() const;
  /// At least |filtered - F|, from exact nodes, by filters along z, then y, then x.
  [[nodiscard]] double filter_error(const std::array<const GoldFilter*, 3>& filters) const;

 private:
  struct Box {
    Vec3 low{}, high{};
  };
  struct Table {
    opencl::DeviceArray<float> values;
    std::int64_t first = 0, views = 0;
  };
  [[nodiscard]] std::vector<Box> boxes() const;
  void look_at_views();
  void choose_margins();
  [[nodiscard]] std::int64_t views_at_once() const;
  [[nodiscard]] std::uint64_t table_bytes() const;
  [[nodiscard]] Table table(std::int64_t first, std::int64_t views);
  [[nodiscard]] bool by_transforms() const;
  void project(const Table& table, const opencl::DeviceArray<float>& out, const ConeTilesAt& tiles);
  template <class Real>
  void launch(const Table& table, const opencl::DeviceArray<float>& out, const ConeTilesAt& tiles,
              VdvrConeNodes shape);

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  const FieldSups& sups_;
  const Coverage& coverage_;
  ConeLattice lattice_;
  UpsampledColumns columns_, rows_;
  std::int64_t column_stride_ = 0;
  double sup_ = 0, rounding_of_lambda_ = 0;
  Vec3 band_{};
  // [box][view]: lambda^-2 sup |q|, and by axis band and rho.
  struct ViewAtBox {
    double weight = 0;
    Vec3 band{}, rho{};
  };
  std::vector<std::vector<ViewAtBox>> at_boxes_;
  double reach_of_block_ = 0;  // in the table's columns or rows
  bool upright_ = true;
};

}  // namespace vdvr
