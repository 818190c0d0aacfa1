// Filtered samples without a scan, and what interpolation between upsampled columns makes of them, in double
// precision. Called by attack_terms_test.cpp and attack_gold_test.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "host/certify/bounds/column_taps.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "tests/support/attack_scans.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr::attacks {

/// Filtered samples as if measured without error: what is tested is what comes after the filter.
inline FilteredScan given_samples(const ParallelGeometry& g, const Value& q) {
  FilteredScan f;
  f.geometry = g;
  f.view_max.assign(g.theta_rad.size(), 0.0);
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k)
    for (std::size_t u = 0; u < static_cast<std::size_t>(g.columns); ++u)
      for (std::size_t v = 0; v < static_cast<std::size_t>(g.rows); ++v) {
        f.samples.push_back(static_cast<float>(q(k, v, u)));
        f.view_max[k] = std::max(f.view_max[k], std::abs(static_cast<double>(f.samples.back())));
      }
  return f;
}

/// q_k on upsampled column n and at a detector row, in double precision, from samples [view][u][v].
struct ExactColumns {
  ParallelGeometry g;
  UpsampledColumns columns;
  std::vector<double> samples;
  std::vector<double> row_weights;  // of the one detector row in use
  ExactColumns(const ParallelGeometry& geometry, const UpsampledColumns& c, std::span<const float> s,
               double row)
      : g(geometry),
        columns(c),
        samples(s.begin(), s.end()),
        row_weights(resampling_matrix(g.rows, std::array{row}, 0, g.pitch_v, 0)) {}
  double operator()(std::size_t k, std::int64_t n) const {
    const auto weights = resampling_matrix(g.columns, std::array{columns.position(n)}, 0, g.pitch_u, 0);
    const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
    double sum = 0;
    for (std::size_t u = 0; u < U; ++u)
      for (std::size_t v = 0; v < V; ++v) sum += weights[u] * row_weights[v] * samples[(k * U + u) * V + v];
    return sum;
  }
  /// The interpolant at a world point.
  double back_projected(double x, double y, Interpolation interpolation) const {
    double sum = 0;
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
      const double t = x * std::cos(g.theta_rad[k]) + y * std::sin(g.theta_rad[k]);
      const double s = columns.column_of(t / g.pitch_u + g.center);
      const auto n = static_cast<std::int64_t>(std::floor(s));
      const double f = s - static_cast<double>(n);
      switch (interpolation) {
        case Interpolation::linear:
          sum += (1 - f) * (*this)(k, n) + f * (*this)(k, n + 1);
          break;
        case Interpolation::cubic:  // Lagrange's
          sum += -f * (1 - f) * (2 - f) / 6 * (*this)(k, n - 1) +
                 (1 + f) * (1 - f) * (2 - f) / 2 * (*this)(k, n) +
                 (1 + f) * f * (2 - f) / 2 * (*this)(k, n + 1) -
                 (1 + f) * f * (1 - f) / 6 * (*this)(k, n + 2);
          break;
        case Interpolation::six_taps: {
          const std::vector<double> w = six_taps(f);
          for (std::size_t i = 0; i < w.size(); ++i)
            sum += w[i] * (*this)(k, n - 2 + static_cast<std::int64_t>(i));
          break;
        }
        case Interpolation::eight_taps:
          throw std::logic_error("columns of parallel beam have no eight taps");
      }
    }
    return sum;
  }
};

}  // namespace vdvr::attacks
