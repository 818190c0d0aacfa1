// The bound on |V - F| as `verify` has it, but for what gold tells cell by cell: sups of the filtered
// projections and the constants that follow from them (docs/error-bounds.md, "What verify does").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host/verify/witness/lagrange.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Fine columns to a detector column at least, on which F is interpolated.
constexpr std::int64_t fine_columns = 12;

/// Views, and rows of the product along z, that are summed by themselves before they are added to the others.
constexpr std::int64_t views_per_run = 8, rows_per_run = 16;

/// Per view: sups over the whole detector, view weight included.
struct SupsByView {
  std::vector<double> value, second_u, second_v;  ///< |q|, |q_uu|, |q_vv|
};

/// Cost on the host: views * rows * columns * (6 rows + 30 log2(columns)) multiply-adds. `coefficients`
/// double [view][m][l].
SupsByView view_sups(std::span<const double> coefficients, const ParallelGeometry& geometry,
                     const Progress& progress);

/// How F is computed at nodes of gold (nodes.hpp).
struct NodePath {
  BetweenNodes across;            ///< gold among back-projected nodes, across z
  bool rows = true;               ///< nodes lie at the detector's rows; else at heights
  BetweenNodes along;             ///< gold among heights
  double density = fine_columns;  ///< fine columns to a detector column
  Vec3 band{0, 0, 0};             ///< of F at back-projected nodes, radians a node; z: at heights
  std::int64_t terms = 1;         ///< of the product along z
  double gain = 1;                ///< largest sum of magnitudes of its rows, 1 for heights
  double reach = 0;        ///< largest distance, in fine columns, of a node of a tile from the tile's first
  std::int64_t calls = 1;  ///< parts in which the views are summed
};

/// What does not depend on the gold cell. Axes x, y, z.
struct FieldBounds {
  using Pairs = std::array<std::array<double, 3>, 3>;
  double arithmetic = 0;       ///< |computed F - F| at any node: rounding and interpolation
  double curved = 0;           ///< what these errors make of an eighth of the second differences' sum
  Pairs fourth{};              ///< and of a fourth difference, by its two axes
  double differences = 0;      ///< rounding of second and fourth differences, and of the kernel's sums
  float correction = 1;        ///< 1: second derivatives to fourth order in h, 0: plain second differences
  double second = 0;           ///< what those err, summed over the axes: h^6 / 90 or h^4 / 12 times a sup
  Pairs rise{}, everywhere{};  ///< of h_i^2 h_j^2 |F_iijj|: above its largest difference at nodes; anywhere
};

/// `host_rounding`: what the table's double-precision values err.
FieldBounds field_bounds(const SupsByView& sups, double host_rounding, const ParallelGeometry& geometry,
                         const Vec3& gold_spacing, const NodePath& path);

/// What the two passes across z round, over the sum of sups of the views: each of a polynomial's weights and
/// sums, once along y, which the pass along x passes on. `norm`: that of a value.
double rounding_of_passes(const BetweenNodes& across, double norm);

/// Errors of one kind: of nodes from which gold is made, or of gold. Axes x, y, z.
struct KindOfError {
  double size = 0;
  std::array<AxisNorms, 3> norms;  ///< what is formed along each axis is at most so many times as large
};
/// Adds what the kind makes of values and of differences.
void add_errors(FieldBounds& bounds, const KindOfError& kind);

/// T's part that is constant over a piece: `fourth` are the largest computed fourth differences at its nodes,
/// xx, yy, zz, xy, xz, yz.
double brick_constant(const FieldBounds& bounds, const std::array<double, 6>& fourth);

}  // namespace vdvr
