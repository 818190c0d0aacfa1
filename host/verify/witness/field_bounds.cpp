// Sups by sampling and Bernstein's inequality, and the bounds they give.
#include "host/verify/witness/field_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/witness/cosine_sums.hpp"
#include "host/verify/witness/cosine_transform.hpp"
#include "host/verify/witness/lagrange.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr std::int64_t sup_density = 3;  // places to a pixel at least where sups are sampled

}  // namespace

SupsByView view_sups(std::span<const double> coefficients, const ParallelGeometry& g,
                     const Progress& progress) {
  const std::int64_t U = g.columns, V = g.rows, K = g.views();
  // One row does not vary along v. Else rows at every third of a pixel, from edge to edge of the half period.
  constexpr std::int64_t together = CosineTransform::together;
  const std::int64_t heights = V == 1 ? 1 : sup_density * V + 1,
                     rows = std::min<std::int64_t>((heights + together - 1) / together * together, 64);
  const CosineTransform along_u(U, sup_density);
  const auto cosine_v = cosine_sums::cosine_period(sup_density * V);
  const double rise_v = V == 1 ? 1 : 1 / std::cos(pi / static_cast<double>(2 * sup_density)),
               factor = (1 + 1e-9) * along_u.rise() * rise_v;
  const double wave_u = pi / (static_cast<double>(U) * g.pitch_u),
               wave_v = pi / (static_cast<double>(V) * g.pitch_v);
  SupsByView sups{std::vector<double>(at(K)), std::vector<double>(at(K)), std::vector<double>(at(K))};
  parallel_for(K, progress, "sups", [&](std::int64_t k) {
    const double* a = coefficients.data() + k * U * V;
    std::vector<double> basis(at(V * rows)), basis_vv(at(V * rows)), line(at(U * rows)), work;
    const auto largest = [&](double sup) {
      for (std::int64_t r = 0; r < rows; r += together)
        sup = std::max(sup, along_u.largest(line.data() + r, rows, work));
      return sup;
    };
    for (std::int64_t first = 0; first < heights; first += rows) {
      for (std::int64_t l = 0; l < V; ++l)
        for (std::int64_t r = 0; r < rows; ++r) {
          const std::int64_t j = std::min(first + r, heights - 1);
          const double c = cosine_v[at(l * j % (2 * sup_density * V))], w = static_cast<double>(l) * wave_v;
          basis[at(l * rows + r)] = c;
          basis_vv[at(l * rows + r)] = c * w * w;
        }
      cosine_sums::sum_rows(a, U, V, basis_vv, rows, line);
      sups.second_v[at(k)] = largest(sups.second_v[at(k)]);
      cosine_sums::sum_rows(a, U, V, basis, rows, line);
      sups.value[at(k)] = largest(sups.value[at(k)]);
      for (std::int64_t m = 0; m < U; ++m) {
        const double w = static_cast<double>(m) * wave_u;
        for (std::int64_t r = 0; r < rows; ++r) line[at(m * rows + r)] *= w * w;
      }
      sups.second_u[at(k)] = largest(sups.second_u[at(k)]);
    }
    sups.value[at(k)] *= factor;
    sups.second_u[at(k)] *= factor;
    sups.second_v[at(k)] *= factor;
  });
  return sups;
}

namespace {

/// The sums over views of |q|, |q_uu| and the sixth derivative in u.
struct Sums {
  double value = 0, second_u = 0, sixth_u = 0;
};

// docs/error-bounds.md, "What verify does", step 1: each row of its table is one kind.
std::vector<KindOfError> error_kinds(const Sums& S, double host_rounding, const ParallelGeometry& g,
                                     const Vec3& h, const NodePath& path) {
  const double d = g.pitch_u / path.density,
               slope = std::min(pi / g.pitch_u * S.value, std::sqrt(2 * S.value * S.second_u));
  const double columns = path.density * static_cast<double>(g.columns + 2),
               runs = static_cast<double>((g.views() + views_per_run - 1) / views_per_run),
               row_runs = static_cast<double>((path.terms + rows_per_run - 1) / rows_per_run);
  const double column = (half_ulp * (4 * path.reach + 6) + 0x1p-48 * columns) * d * slope +
                        3.515625 / 720 * std::pow(d, 6) * S.sixth_u;
  const double row = half_ulp *
                         (28 + 1.01 * (static_cast<double>(views_per_run + 1 + path.calls) +
                                       1.01 * runs * runs * half_ulp)) *
                         S.value +
                     1.4 * host_rounding;
  const double product =
      1.01 * half_ulp * (static_cast<double>(rows_per_run + 3) + 1.01 * row_runs * row_runs * half_ulp);

  const LagrangeFilter filter = lagrange_filter(path.across), along = lagrange_filter(path.along);
  const AxisNorms across = filter.norms, each, band = band_norms(pi * h[2] / g.pitch_v);
  std::vector<KindOfError> kinds;
  if (path.rows) {
    // What the rows hold is a function of the band, whatever they err.
    kinds.push_back({column, {across, across, band}});
    kinds.push_back({path.gain * row, {across, across, band}});
    kinds.push_back({path.gain * product * S.value, {across, across, each}});
  } else {
    kinds.push_back({column + row, {across, across, along.norms}});
    if (path.along.made()) kinds.push_back({along.norms.value * product * S.value, {across, across, each}});
  }
  double interpolation = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const BetweenNodes& made = a < 2 ? path.across : path.along;
    if (made.made() && (a < 2 || !path.rows)) interpolation *= 1 + lagrange_error(path.band[a], made.points);
  }
  const double L = filter.norms.value, passes = rounding_of_passes(path.across, L) * S.value;
  kinds.push_back({(interpolation - 1) * S.value + passes, {each, each, each}});
  return kinds;
}

}  // namespace

double rounding_of_passes(const BetweenNodes& across, double norm) {
  return across.made() ? 1.01 * half_ulp * (across.points + 1) * (norm * norm + norm) : 0;
}

void add_errors(FieldBounds& b, const KindOfError& kind) {
  const auto product = [&](const std::array<double, 3>& f) { return kind.size * f[0] * f[1] * f[2]; };
  std::array<double, 3> value{};
  for (std::size_t a = 0; a < 3; ++a) value[a] = kind.norms[a].value;
  b.arithmetic += product(value);
  for (std::size_t j = 0; j < 3; ++j) {
    std::array<double, 3> f = value;
    f[j] = kind.norms[j].curvature;
    b.curved += product(f) / 8;
    for (std::size_t i = 0; i < 3; ++i) {
      f = value;
      f[j] = kind.norms[j].second;
      f[i] = i == j ? kind.norms[j].fourth : kind.norms[i].second;
      b.fourth[j][i] += product(f);
    }
  }
}

FieldBounds field_bounds(const SupsByView& sups, double host_rounding, const ParallelGeometry& g,
                         const Vec3& h, const NodePath& path) {
  const double wu = pi / g.pitch_u * (pi / g.pitch_u), wv = pi / g.pitch_v * (pi / g.pitch_v);
  const std::size_t K = sups.value.size();
  // sup |d_u^a d_v^b q_k| for even a + b >= 2, by Bernstein from the second derivatives.
  const auto derivative = [&](std::size_t k, int a, int b) {
    double sup = INFINITY;
    if (a >= 2) sup = sups.second_u[k] * std::pow(wu, a / 2 - 1) * std::pow(wv, b / 2);
    if (b >= 2) sup = std::min(sup, sups.second_v[k] * std::pow(wu, a / 2) * std::pow(wv, b / 2 - 1));
    return sup;
  };
  // Sum over the views of the sup of d_x^n0 d_y^n1 d_z^n2 q_k(t_k, z), times h^n.
  const auto sup_of = [&](const std::array<int, 3>& n) {
    double sum = 0;
    for (std::size_t k = 0; k < K; ++k)
      sum += std::pow(std::abs(std::cos(g.theta_rad[k])), n[0]) *
             std::pow(std::abs(std::sin(g.theta_rad[k])), n[1]) * derivative(k, n[0] + n[1], n[2]);
    return sum * std::pow(h[0], n[0]) * std::pow(h[1], n[1]) * std::pow(h[2], n[2]);
  };
  FieldBounds b;
  Sums S;
  for (std::size_t k = 0; k < K; ++k) {
    S.value += sups.value[k];
    S.second_u += sups.second_u[k];
    S.sixth_u += derivative(k, 6, 0);
  }
  for (const KindOfError& kind : error_kinds(S, host_rounding, g, h, path)) add_errors(b, kind);
  b.differences = 40 * half_ulp * S.value;
  double plain = 0;
  for (std::size_t j = 0; j < 3; ++j) {
    std::array<int, 3> six{};
    six[j] = 6;
    b.second += sup_of(six) / 90;
    for (std::size_t i = 0; i < 3; ++i) {
      std::array<int, 3> four{};
      four[j] += 2;
      four[i] += 2;
      b.everywhere[j][i] = sup_of(four);
      const auto more = [&](std::size_t axis) {
        std::array<int, 3> n = four;
        n[axis] += 2;
        return sup_of(n);
      };
      // From the difference to the derivative at a node, then from the nodes to all of the cell.
      b.rise[j][i] = i == j ? more(j) / 6 : (more(j) + more(i)) / 12;
      for (std::size_t axis = 0; axis < 3; ++axis) b.rise[j][i] += more(axis) / 8;
    }
    plain += b.everywhere[j][j] / 12;
  }
  // On coarse gold the sixth derivatives weigh more than what the fourth differences gain.
  if (plain < b.second) {
    b.second = plain;
    b.correction = 0;
  }
  return b;
}

double brick_constant(const FieldBounds& b, const std::array<double, 6>& fourth) {
  constexpr std::array<std::array<std::size_t, 3>, 3> place{{{0, 3, 4}, {3, 1, 5}, {4, 5, 2}}};
  double rises = 0;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      rises +=
          std::min(fourth[place[j][i]] + b.fourth[j][i] + b.differences + b.rise[j][i], b.everywhere[j][i]);
  return (b.second + rises / 8) / 8 + b.curved + b.differences;
}

}  // namespace vdvr
