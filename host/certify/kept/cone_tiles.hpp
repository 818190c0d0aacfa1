// Kept nodes of cone beam: tiles of them back-projected from tables of the filtered views, and what they and
// the filters between them err (docs/error-bounds.md, section 16). Launches
// kernels/certify/kept/cone_nodes.cl.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "host/base/opencl/kernel.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/kept/gold_filters.hpp"
#include "host/certify/kept/projective_error.hpp"
#include "host/certify/kept/upright_views.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/dense_values.hpp"
#include "shared/cone_nodes.h"
#include "vdvr/error.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Which nodes are kept: node (0, 0, 0) is the grid's first sample.
struct ConeLattice {
  Vec3 origin{}, spacing{};
  double reach = 0;    ///< of nodes, across z, beyond the covered region
  double claimed = 0;  ///< alike, at most `reach`: as far as bounds hold; beyond it nodes are finite
  std::pair<double, double> claimed_z{};  ///< the heights between which they hold
  Vec3 less{};        ///< by axis, by how much less far than `claimed` filters along it fill nodes
  double less_z = 0;  ///< alike of all of them, than `claimed_z`
  std::int64_t low = 0, groups = 0;  ///< the lowest height, and how many groups of eight
  std::int64_t stride = 0;           ///< floats from column to column of a tile, at least all heights
};

/// Tiles of 32 x 32 columns of nodes on the device, one after another: float [tile][y][x][stride].
struct ConePage {
  const opencl::DeviceArray<float>* out = nullptr;
  std::vector<std::array<double, 2>> first;  ///< of each tile, where its first column stands
  /// [tile][y]: first and last column, and the heights, from the lowest on and alike in all of a tile: the
  /// first and the one after the last. Others may be left out.
  std::vector<std::array<std::int32_t, 4>> wanted;
};

[[nodiscard]] InputError source_too_close(std::size_t view);

class ConeTiles {
 public:
  /// Everything is referred to but the lattice. Throws InputError where nodes with bounds reach a source's
  /// plane; others must not.
  ConeTiles(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
            const Coverage& coverage, const ConeLattice& lattice);

  /// Adds F at the nodes to what the pages hold. Cost: on a CPU six multiply-adds of
  /// eight lanes a view and node and six of single ones for each row of the table between two nodes, else 12
  /// of eight lanes; and tables of all views, of leaning detectors 20 of eight lanes an entry besides.
  /// Memory: tables of some views, at most a quarter of what is left.
  void back_project(std::span<const ConePage> pages, const Progress& progress);
  /// Seconds that the tables of the last call took.
  [[nodiscard]] double table_seconds() const { return table_seconds_; }
  /// From now on without strips, as devices do whose work-items share caches: for tests.
  void take_no_strips() { in_runs_ = false; }
  [[nodiscard]] bool in_runs() const { return in_runs_; }
  /// In tables at once, whose nodes are summed up before they are added to the others; as memory allows
  /// unless taken otherwise, before anything is back-projected.
  [[nodiscard]] std::int64_t views_together() const { return views_together_; }
  void take_views_together(std::int64_t views) { views_together_ = views; }

  /// At least sum_k lambda^-2 sup |q_k| wherever bounds hold.
  [[nodiscard]] double sup() const { return sup_; }
  [[nodiscard]] double largest_weight() const { return largest_weight_; }  ///< at least lambda^-2, alike
  /// At least the frequency of any view's part where a filter fills, radians a node.
  [[nodiscard]] double band(std::size_t axis) const { return band_[axis]; }
  [[nodiscard]] const ConeLattice& lattice() const { return lattice_; }

  /// What nodes err: by interpolation in the tables, and by fp32.
  struct Errors {
    double interpolation = 0, rounding = 0;
  };
  [[nodiscard]] Errors errors() { return errors(views_together_, Fp64::as_here, Form{}); }
  /// What earlier programs charged: of six taps, with tables at 8x, rounding at least; of both where leaning
  /// detectors had no tables of upright ones, and sums over views were charged with the taps' norm.
  struct Form {
    Interpolation taps = Interpolation::eight_taps;
    bool earlier = false;
  };
  /// The same where memory had allowed so many views at once, from 1 to most_views, on another device, or of
  /// another form.
  [[nodiscard]] Errors errors(std::int64_t together, Fp64 fp64, const Form& form);
  /// Those that a file with such taps may have of these views.
  [[nodiscard]] std::vector<Form> forms(Interpolation taps) const;
  static constexpr std::int64_t most_views = 16;
  /// Roundings of a sum over views: four in a lane; then the lanes of so many in a sum, and those sums.
  [[nodiscard]] static std::pair<double, double> roundings_of_sum(std::int64_t views, std::int64_t together);
  /// Of an axis, x and y alike: designed for the band with which it errs least, most views being below the
  /// highest. Where a band exceeds what filters are designed for, none; `error` is infinite.
  struct BestFilter {
    std::optional<GoldFilter> filter;
    double error = 0;  ///< at least |filtered - F| where exact nodes are filtered along the axis
  };
  /// The best of all where it errs by at most `most`; else one that errs more, or none.
  [[nodiscard]] BestFilter best_filter(int phases, std::size_t axis, int taps, double most = HUGE_VAL);
  /// At least |filtered - F| where exact nodes are filtered along z, then y, then x.
  [[nodiscard]] double filter_error(const GoldFilter& x, const GoldFilter& y, const GoldFilter& z);

 private:
  struct Table {
    opencl::DeviceArray<float> values;
    std::int64_t first = 0, views = 0;
  };
  void look_at_axis(std::size_t axis, const Coverage& coverage);
  void look_at_views(const Coverage& coverage);
  void look_at_table(const std::vector<Corners>& parts, const std::array<double, 2>& beyond);
  /// As the tables have them.
  [[nodiscard]] const std::vector<ViewMatrix>& views() const {
    return upright_views_ ? upright_views_->views() : scan_.views;
  }
  [[nodiscard]] std::int64_t plane() const { return table_columns_.count * column_stride_; }
  [[nodiscard]] std::int64_t dense_stride() const {
    return upright_views_ ? column_stride(rows_.count + VDVR_CONE_HEIGHTS) : column_stride_;
  }
  [[nodiscard]] std::int64_t views_that_fit() const;
  using NodesKernel = opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_ulong, VdvrConeNodes>;
  [[nodiscard]] NodesKernel nodes_kernel(int lanes);
  [[nodiscard]] Table table(std::int64_t first, std::int64_t views);
  [[nodiscard]] Table dense_table(std::int64_t first, std::int64_t views);
  template <class Real>
  [[nodiscard]] Table upright_table(const Table& dense);
  template <class Real>
  void launch(const Table& table, const ConePage& page, VdvrConeNodes shape);
  [[nodiscard]] double highest(std::size_t axis) const {
    constexpr double least = 0.05;  // a single row does not vary along z
    return std::max(least, axis == 2 ? band_[2] : std::max(band_[0], band_[1]));
  }
  /// The largest sum over the views of what a filter errs along an axis, found once.
  double largest(std::size_t axis, const GoldFilter& filter);
  [[nodiscard]] double least_of(std::size_t axis, const ProjectiveError& error, double fewest) const;
  // What is known of a filter: by axis the largest sum over the views of what it errs.
  struct Known {
    ProjectiveError error;
    std::array<std::optional<double>, 3> largest;
  };
  Known& known(std::size_t axis, const GoldFilter& filter);

  // Values of a table to a pixel, both ways: what eight taps are made for.
  static constexpr int density = 6;
  // Rows from which on tables are made by transforms along v.
  static constexpr std::int64_t fewest_rows = 16;

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  const FieldSups& sups_;
  ConeLattice lattice_;
  std::optional<UprightViews> upright_views_;  // where detectors lean
  UpsampledColumns columns_, rows_;            // of the detectors themselves
  TableAxis table_columns_, table_rows_;
  std::int64_t column_stride_ = 0, views_together_ = 1;
  std::optional<DenseValues> dense_;
  bool in_double_ = true, in_runs_ = true;
  double sup_ = 0, largest_weight_ = 0;
  Vec3 band_{};
  double table_seconds_ = 0;
  double row_step_ = 0;     // rows of the table from a node to the one above it
  double block_reach_ = 0;  // columns or rows of the table from a block's middle to its nodes
  std::array<std::vector<std::vector<ViewAtPart>>, 3> at_parts_;        // where filters along the axis fill
  std::array<std::vector<double>, 2> bands_seen_;                       // one of each place; x and y share
  std::map<std::tuple<bool, int, std::vector<float>>, Known> filters_;  // along z, rate, weights
  std::map<std::tuple<bool, int, int>, BestFilter> best_;               // along z, phases, taps
};

}  // namespace vdvr
