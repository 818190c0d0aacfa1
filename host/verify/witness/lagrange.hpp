// Interpolation by Lagrange's polynomials through twelve nodes, as `verify` makes fine gold of coarser nodes,
// and what differences of its results do with errors of the nodes (docs/error-bounds.md, "What verify does",
// step 1). Nothing of build uses it.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

/// Nodes of an interpolant; the place lies between the sixth and the seventh.
inline constexpr double half_ulp = 0x1p-24;  ///< rounding unit of fp32
constexpr int lagrange_points = 12;

/// By how much what is formed along an axis exceeds errors of size 1: a value, the five-point formula for the
/// second derivative (or the second difference, whichever is more), a second and a fourth difference. As
/// initialised: of values that err each by itself.
struct AxisNorms {
  double value = 1, curvature = 64.0 / 12, second = 4, fourth = 16;
};

/// From nodes to `factor` times as many. The value at place phase / factor behind a node is
///   sum_i weights[phase * lagrange_points + i] f(node - 5 + i).
struct LagrangeFilter {
  int factor = 1;
  std::vector<float> weights;  ///< phase 0 is a copy
  AxisNorms norms;             ///< for errors of each node by itself, of the weights as rounded
};

/// `factor` is at least 1; with 1 there is nothing to interpolate.
LagrangeFilter lagrange_filter(int factor);

/// c: |interpolant - f| <= c sup |f| for every bounded f of frequencies up to `band` radians a node.
double lagrange_error(double band);

/// The same for errors that are themselves functions without frequencies above `band` radians a step.
AxisNorms band_norms(double band);

/// At most the largest sum over the rows of |M(z, row)|, anywhere: M interpolates the cosine series of `rows`
/// rows from its values there.
double row_gain(std::int64_t rows);

/// M at the height `at` (in rows from row 0): the value of that series there is the sum of row_weight times
/// the values at the rows.
double row_weight(std::int64_t rows, double at, std::int64_t row);

}  // namespace vdvr
