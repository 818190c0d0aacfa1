// Interpolation by Lagrange's polynomials, as `verify` makes fine gold of coarser nodes, and what differences
// of its results do with errors of the nodes (docs/error-bounds.md, "What verify does", step 1). Nothing of
// build uses it.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

inline constexpr double half_ulp = 0x1p-24;  ///< rounding unit of fp32

/// Where values lie between nodes along an axis: `factor` of them to `by` nodes, which have no divisor in
/// common. A polynomial takes so many nodes, an even number: the place lies between the middle two. With a
/// factor of 1 values are nodes.
struct BetweenNodes {
  int factor = 1, by = 1, points = 12;
  [[nodiscard]] bool made() const { return factor > 1; }
  [[nodiscard]] double values_to_a_node() const { return static_cast<double>(factor) / by; }
  /// Nodes that a polynomial takes before the one on the left of its place.
  [[nodiscard]] int before() const { return points / 2 - 1; }
};
/// Values of gold of that rate among so many nodes to a cell.
BetweenNodes between_nodes(int rate, int nodes, int points);

/// By how much what is formed along an axis exceeds errors of size 1: a value, the five-point formula for the
/// second derivative (or the second difference, whichever is more), a second and a fourth difference. As
/// initialised: of values that err each by itself.
struct AxisNorms {
  double value = 1, curvature = 64.0 / 12, second = 4, fourth = 16;
};

/// From nodes to values between them. The value at place phase / factor behind a node is
///   sum_i weights[phase * points + i] f(node - before + i).
struct LagrangeFilter {
  BetweenNodes between;
  std::vector<float> weights;  ///< phase 0 is a copy
  AxisNorms norms;             ///< for errors of each node by itself, of the weights as rounded
};

LagrangeFilter lagrange_filter(const BetweenNodes& between);

/// c: |interpolant - f| <= c sup |f| for every bounded f of frequencies up to `band` radians a node.
double lagrange_error(double band, int points);

/// The same for errors that are themselves functions without frequencies above `band` radians a step.
AxisNorms band_norms(double band);

/// At most the largest sum over the rows of |M(z, row)|, anywhere: M interpolates the cosine series of `rows`
/// rows from its values there.
double row_gain(std::int64_t rows);

/// M at the height `at` (in rows from row 0): the value of that series there is the sum of row_weight times
/// the values at the rows.
double row_weight(std::int64_t rows, double at, std::int64_t row);

}  // namespace vdvr
