// Variance of F at a point from the variances of line integrals, by the definition of F: ramp filter by its
// closed form, cosine series by direct sums, parallel beam, Ram-Lak. Used by noise_test.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/reference/cosine_series.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::reference {

/// What sample i of a row of n contributes to the series at x.
inline std::vector<double> series_shares(std::size_t n, double x) {
  std::vector<double> shares(n, 1 / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t m = 1; m < n; ++m)
      shares[i] += 2 / static_cast<double>(n) * std::cos(frequency(m, n) * (static_cast<double>(i) + 0.5)) *
                   std::cos(frequency(m, n) * (x + 0.5));
  return shares;
}

/// `weight`: of each view. `variance(view, row, column)`.
inline double field_variance(
    const ParallelGeometry& g, const std::vector<double>& weight, const Vec3& p,
    const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& variance) {
  constexpr double pi = std::numbers::pi;
  const auto rows = static_cast<std::size_t>(g.rows), columns = static_cast<std::size_t>(g.columns);
  const std::vector<double> along =
      series_shares(rows, p[2] / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1));
  double sum = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const double t = p[0] * std::cos(g.theta_rad[k]) + p[1] * std::sin(g.theta_rad[k]);
    const std::vector<double> across = series_shares(columns, t / g.pitch_u + g.center);
    for (std::size_t i = 0; i < columns; ++i) {
      double share = 0;
      for (std::size_t j = 0; j < columns; ++j) {
        const double n = std::abs(static_cast<double>(j) - static_cast<double>(i));
        const double h = n == 0 ? 0.25 : std::fmod(n, 2) == 1 ? -1 / (pi * pi * n * n) : 0;
        share += across[j] * h / g.pitch_u;
      }
      for (std::size_t r = 0; r < rows; ++r)
        sum += weight[k] * weight[k] * share * share * along[r] * along[r] *
               variance(static_cast<std::int64_t>(k), static_cast<std::int64_t>(r),
                        static_cast<std::int64_t>(i));
    }
  }
  return sum;
}

}  // namespace vdvr::reference
