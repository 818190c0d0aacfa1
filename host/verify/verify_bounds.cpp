// Sups by sampling and Bernstein's inequality, and the bounds they give.
#include "host/verify/verify_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/system/casts.hpp"
#include "host/system/parallel.hpp"
#include "host/verify/verify_cosines.hpp"

namespace vdvr {
namespace {

using namespace verify_cosines;

constexpr double pi = std::numbers::pi;
constexpr double u = 0x1p-24;            // rounding unit of fp32
constexpr std::int64_t sup_density = 3;  // points per pixel where sups are sampled

}  // namespace

ViewSups view_sups(std::span<const double> coefficients, const ParallelGeometry& g,
                   const Progress& progress) {
  const std::int64_t U = g.columns, V = g.rows, K = g.views();
  // One row does not vary along v. Else rows at every third of a pixel, from edge to edge of the half period.
  const std::int64_t heights = V == 1 ? 1 : sup_density * V + 1,
                     rows = std::min<std::int64_t>((heights + lanes - 1) / lanes * lanes, 64);
  const auto cosine_u = cosine_period(sup_density * U), cosine_v = cosine_period(sup_density * V);
  const double factor_u = 1 / std::cos(pi / static_cast<double>(2 * sup_density)),
               factor = (1 + 1e-9) * factor_u * (V == 1 ? 1 : factor_u);
  const double wave_u = pi / (static_cast<double>(U) * g.pitch_u),
               wave_v = pi / (static_cast<double>(V) * g.pitch_v);
  ViewSups sups{std::vector<double>(at(K)), std::vector<double>(at(K)), std::vector<double>(at(K))};
  parallel_for(K, progress, "sups", [&](std::int64_t k) {
    const double* a = coefficients.data() + k * U * V;
    std::vector<double> basis(at(V * rows)), basis_vv(at(V * rows)), line(at(U * rows));
    const auto largest = [&](double sup) {
      sum_columns(line, U, rows, sup_density, cosine_u,
                  [&](std::int64_t, std::int64_t, const std::array<double, lanes>& values) {
                    for (const double v : values) sup = std::max(sup, std::abs(v));
                  });
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
      sum_rows(a, U, V, basis_vv, rows, line);
      sups.second_v[at(k)] = largest(sups.second_v[at(k)]);
      sum_rows(a, U, V, basis, rows, line);
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

FieldBounds field_bounds(const ViewSups& sups, double host_rounding, const ParallelGeometry& g, const Vec3& h,
                         double reach, std::int64_t run) {
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
  double S = 0, S_uu = 0, S_6 = 0;
  for (std::size_t k = 0; k < K; ++k) {
    S += sups.value[k];
    S_uu += sups.second_u[k];
    S_6 += derivative(k, 6, 0);
  }
  const double d = g.pitch_u / static_cast<double>(fine_columns),
               slope = std::min(pi / g.pitch_u * S, std::sqrt(2 * S * S_uu));
  const double columns = static_cast<double>(fine_columns * (g.columns + 2));
  // A term is rounded within its run, and once per run from there on.
  const auto roundings = static_cast<double>(run + (g.views() + run - 1) / run);
  b.arithmetic = u * (28 + 1.01 * roundings) * S + (u * (4 * reach + 6) + 0x1p-48 * columns) * d * slope +
                 3.515625 / 720 * std::pow(d, 6) * S_6 + host_rounding;
  b.differences = 40 * u * S;
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
      rises += std::min(fourth[place[j][i]] + 16 * b.arithmetic + b.differences + b.rise[j][i],
                        b.everywhere[j][i]);
  return (b.second + rises / 8) / 8 + 2 * b.arithmetic + b.differences;
}

}  // namespace vdvr
