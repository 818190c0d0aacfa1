// Polynomials whose coefficients pair with sups of derivatives on the detector.
#include "host/verify/witness/cone_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/verify/witness/lagrange.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr std::size_t most = 6;
// All sums here are of terms >= 0, in double precision and of fewer than 2^16 operations one after another
// (but for views, which are added to it): they round down by less.
constexpr double rise = 1 + 0x1p-36;

/// One view's sups on the detector, per pixel.
struct Sups {
  double value = 0, second_u = 0, second_v = 0;

  /// Of |q_{u^p v^r}|, by Bernstein from the value or a second derivative.
  [[nodiscard]] double of(std::size_t p, std::size_t r) const {
    if (r > 0 && !varies_along_v()) return 0;
    const auto n = static_cast<int>(p + r);
    double sup = std::pow(pi, n) * value;
    if (p >= 2) sup = std::min(sup, std::pow(pi, n - 2) * second_u);
    if (r >= 2) sup = std::min(sup, std::pow(pi, n - 2) * second_v);
    return sup;
  }
  /// A single row does not.
  [[nodiscard]] bool varies_along_v() const { return second_v > 0; }
};

/// One view on a box, lengths in steps of gold and lambda over its least: |X_e| and |lambda_e| / lambda.
struct ViewOnBox {
  double weight = 0;  // lambda^-2, at most
  Vec3 across_u{}, across_v{}, growth{};
};

ViewOnBox look(const ViewMatrix& m, const ConeBox& box, const Vec3& step) {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, 0};
  double magnitude = std::abs(m[2][3]);
  for (std::size_t e = 0; e < 3; ++e)
    magnitude += std::abs(m[2][e]) * std::max(std::abs(box.low[e]), std::abs(box.high[e]));
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p{};
    for (std::size_t e = 0; e < 3; ++e) p[e] = (corner >> e & 1) != 0 ? box.high[e] : box.low[e];
    const Vec3 seen = projected(m, p);
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], seen[a]);
      high[a] = std::max(high[a], seen[a]);
    }
  }
  ViewOnBox out;
  const double lambda = low[2] - 0x1p-48 * magnitude;
  if (!(lambda > 0))
    throw InputError("cone beam: nodes around the covered region reach the plane of a view's source");
  out.weight = 1 / (lambda * lambda);
  for (std::size_t e = 0; e < 3; ++e) {
    const double l = m[2][e];
    // X_e is affine in u and in v, and these lie between their values at corners. Places round: the share is
    // some thousand times what they do.
    const auto largest = [&](std::size_t a) {
      const double n = m[a][e], place = std::max(std::abs(low[a]), std::abs(high[a]));
      return (std::max(std::abs(n - l * low[a]), std::abs(n - l * high[a])) +
              0x1p-40 * (std::abs(n) + std::abs(l) * (place + 1))) *
             step[e] / lambda;
    };
    out.across_u[e] = largest(0);
    out.across_v[e] = largest(1);
    out.growth[e] = std::abs(l) * step[e] / lambda;
  }
  return out;
}

// Coefficients of U^p W^r.
using Polynomial = std::array<std::array<double, most + 1>, most + 1>;

// Times (across_u U + across_v W + growth), whose product up to now has degree n.
void multiply(Polynomial& f, const ViewOnBox& v, std::size_t e, std::size_t n) {
  for (std::size_t p = n + 2; p-- > 0;)
    for (std::size_t r = n + 2 - p; r-- > 0;)
      f[p][r] = v.growth[e] * f[p][r] + (p > 0 ? v.across_u[e] * f[p - 1][r] : 0.0) +
                (r > 0 ? v.across_v[e] * f[p][r - 1] : 0.0);
}

double factorial(std::size_t n) {
  double product = 1;
  for (std::size_t i = 2; i <= n; ++i) product *= static_cast<double>(i);
  return product;
}

/// [p][r]: (n+1)! / (p+r+1)! times the sup, for derivatives of order n.
Polynomial weighted(const Sups& sups, std::size_t n) {
  Polynomial out{};
  for (std::size_t p = 0; p <= n; ++p)
    for (std::size_t r = 0; p + r <= n; ++r)
      out[p][r] = factorial(n + 1) / factorial(p + r + 1) * sups.of(p, r);
  return out;
}

double paired(const Polynomial& f, const Polynomial& sups, std::size_t n) {
  double sum = 0;
  for (std::size_t p = 0; p <= n; ++p)
    for (std::size_t r = 0; p + r <= n; ++r) sum += f[p][r] * sups[p][r];
  return sum;
}

/// Sums over the views of derivatives times powers of the spacing: [n_x / 2][n_y / 2][n_z / 2].
struct EvenDerivatives {
  std::array<std::array<std::array<double, 4>, 4>, 4> sum{};
  [[nodiscard]] double& at(const std::array<int, 3>& orders) {
    return sum[static_cast<std::size_t>(orders[0] / 2)][static_cast<std::size_t>(orders[1] / 2)]
              [static_cast<std::size_t>(orders[2] / 2)];
  }
};

void add_derivatives(EvenDerivatives& out, const ViewOnBox& v, const Sups& sups) {
  const Polynomial four = weighted(sups, 4), six = weighted(sups, 6);
  std::array<int, 3> orders{};
  for (std::size_t i = 0; i < 3; ++i) {
    Polynomial one{};
    one[0][0] = 1;
    multiply(one, v, i, 0);
    multiply(one, v, i, 1);
    for (std::size_t j = i; j < 3; ++j) {
      Polynomial two = one;
      multiply(two, v, j, 2);
      multiply(two, v, j, 3);
      orders = {};
      orders[i] += 2;
      orders[j] += 2;
      out.at(orders) += v.weight * paired(two, four, 4);
      for (std::size_t k = j; k < 3; ++k) {
        Polynomial three = two;
        multiply(three, v, k, 4);
        multiply(three, v, k, 5);
        ++orders[k];
        ++orders[k];
        out.at(orders) += v.weight * paired(three, six, 6);
        orders[k] -= 2;
      }
    }
  }
}

/// The sums over the views of what nodes and lines of nodes err.
struct NodeSums {
  double value = 0;    // lambda^-2 sup |q|
  double weight = 0;   // the largest lambda^-2
  double places = 0;   // what wrong places change
  double between = 0;  // what interpolation errs in tables
  Vec3 along{};        // what interpolation along each axis errs between nodes
};

// |f'|^2 <= 2 sup |f| sup |f''| on a line (Landau), and Bernstein.
double slope(double value, double second) { return std::min(pi * value, std::sqrt(2 * value * second)); }

// n points of Lagrange along an axis: the n-th derivative (at j derivatives of q along X, (n choose j) (n +
// 1)! / (j + 1)! times (pi (|X_u| + |X_v|))^j) times what the product of the distances to the points is at
// most.
double lagrange_share(const ViewOnBox& v, const Sups& sups, std::size_t axis, const BetweenNodes& between) {
  const double steps = between.values_to_a_node(),
               band = steps * pi * (v.across_u[axis] + (sups.varies_along_v() ? v.across_v[axis] : 0.0)),
               growth = steps * v.growth[axis];
  // By Horner's scheme from j = n down, each coefficient of the one before.
  const int n = between.points;
  double coefficient = 1, sum = 1;
  for (int j = n; j > 0; --j) {
    coefficient *= growth * j * (j + 1) / (n - j + 1);
    sum = sum * band + coefficient;
  }
  return lagrange_error(1, between.points) * sum;
}

// Between two of eight points, and up to half a point beyond them: the product of the distances to all eight
// over 8!, the sum of the weights' magnitudes, and how often a weight rounds, all at most.
struct EightPoints {
  double product, sum, roundings;
};
constexpr EightPoints between_two{43.06640625 / 40320, sum_of_cone_weights, 6},
    beyond_two{55.37109375 / 40320, 1.6592, 14};
EightPoints along_u(const ConeNodeFacts& nodes) { return nodes.lean > 0 ? beyond_two : between_two; }

// q along a line that leans by s pixels a pixel: its frequencies are at most pi (1 + s), and its second
// derivative is q_vv + 2 s q_uv + s^2 q_uu.
double eighth_along(const Sups& sups, double s) {
  const double mixed = pi * std::min(slope(sups.value, sups.second_u), slope(sups.value, sups.second_v));
  return std::pow(pi * (1 + s), 6) * (sups.second_v + s * (2 * mixed + s * sups.second_u));
}

void add_nodes(NodeSums& out, const ViewOnBox& v, const Sups& sups, const ConePath& path) {
  // Of the eighth derivative; the points of one axis weigh what those of the other err.
  const double of_u = along_u(path.nodes).product * std::pow(1 / path.nodes.density_u, 8) * std::pow(pi, 6) *
                      sups.second_u,
               of_v = between_two.product * std::pow(1.0 / cone_density, 8) *
                      eighth_along(sups, path.nodes.lean);
  out.value += v.weight * sups.value;
  out.weight = std::max(out.weight, v.weight);
  out.places += v.weight * (slope(sups.value, sups.second_u) * path.nodes.place_u +
                            slope(sups.value, sups.second_v) * path.nodes.place_v);
  out.between +=
      v.weight * (path.nodes.lean > 0 ? between_two.sum * of_u + of_v : of_u + between_two.sum * of_v);
  for (std::size_t e = 0; e < 3; ++e) {
    const BetweenNodes& between = e < 2 ? path.path.across : path.path.along;
    if (between.made()) out.along[e] += v.weight * sups.value * lagrange_share(v, sups, e, between);
  }
}

// docs/error-bounds.md, "What verify does", "Cone beam": nodes, then what is made of them.
void add_kinds(FieldBounds& b, const NodeSums& S, const ConePath& p) {
  const EightPoints u = along_u(p.nodes);
  const double weights = u.sum * between_two.sum,
               roundings = 26 + u.roundings + between_two.roundings + 10 * p.nodes.cancellation +
                           static_cast<double>(p.nodes.together + p.nodes.calls),
               node = S.places + S.between + weights * 1.01 * half_ulp * roundings * S.value +
                      weights * S.weight * p.host_rounding;
  const AxisNorms each;
  add_errors(b, {node, {p.across, p.across, p.along}});
  const double row_runs = static_cast<double>((p.path.terms + rows_per_run - 1) / rows_per_run),
               product = 1.01 * half_ulp *
                         (static_cast<double>(rows_per_run + 3) + 1.01 * row_runs * row_runs * half_ulp);
  if (p.path.along.made()) add_errors(b, {p.along.value * product * S.value, {p.across, p.across, each}});
  // Along z first, then y, then x: what comes later passes on what went wrong before.
  const double L = p.across.value, passes = rounding_of_passes(p.path.across, L) * S.value,
               between = S.along[0] + L * S.along[1] + L * L * S.along[2];
  add_errors(b, {between + passes, {each, each, each}});
}

}  // namespace

SupsByView cone_view_sups(const ExactField& field, const Progress& progress) {
  ParallelGeometry pixels = field.geometry();
  pixels.pitch_u = pixels.pitch_v = 1;
  return view_sups(field.coefficients(), pixels, progress);
}

ConePath::ConePath(const NodePath& from, const ConeNodeFacts& facts, double rounding)
    : path(from),
      nodes(facts),
      host_rounding(rounding),
      across(lagrange_filter(path.across).norms),
      along(lagrange_filter(path.along).norms) {}

FieldBounds cone_field_bounds(std::span<const ViewMatrix> views, const SupsByView& sups, const ConeBox& box,
                              const Vec3& h, const ConePath& path, bool corrected) {
  EvenDerivatives sum;
  NodeSums nodes;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const ViewOnBox v = look(views[k], box, h);
    const Sups of_view{sups.value[k], sups.second_u[k], sups.second_v[k]};
    add_derivatives(sum, v, of_view);
    add_nodes(nodes, v, of_view, path);
  }
  const double up = rise + static_cast<double>(views.size()) * 0x1p-52;
  FieldBounds b;
  add_kinds(b, nodes, path);
  b.differences = 40 * half_ulp * nodes.value;
  b.correction = corrected ? 1 : 0;
  for (std::size_t j = 0; j < 3; ++j) {
    std::array<int, 3> pure{};
    pure[j] = corrected ? 6 : 4;
    b.second += up * sum.at(pure) / (corrected ? 90 : 12);
    for (std::size_t i = 0; i < 3; ++i) {
      std::array<int, 3> four{};
      four[j] += 2;
      four[i] += 2;
      b.everywhere[j][i] = up * sum.at(four);
      const auto more = [&](std::size_t axis) {
        std::array<int, 3> n = four;
        n[axis] += 2;
        return up * sum.at(n);
      };
      // As of parallel beam: from the difference to the derivative at a node, then into the cell.
      b.rise[j][i] = i == j ? more(j) / 6 : (more(j) + more(i)) / 12;
      for (std::size_t axis = 0; axis < 3; ++axis) b.rise[j][i] += more(axis) / 8;
    }
  }
  return b;
}

double cone_derivative(const ViewMatrix& view, const std::array<int, 3>& orders, double value,
                       double second_u, double second_v, const ConeBox& box, const Vec3& spacing) {
  const ViewOnBox v = look(view, box, spacing);
  Polynomial f{};
  f[0][0] = 1;
  std::size_t n = 0;
  for (std::size_t e = 0; e < 3; ++e)
    for (int i = 0; i < orders[e]; ++i) multiply(f, v, e, n++);
  return rise * v.weight * paired(f, weighted({value, second_u, second_v}, n), n);
}

}  // namespace vdvr
