// The half-sample mirror extension written out: cosine coefficients by direct sums, and the series or its
// even derivatives term by term, in double precision. Used by cosine_series_test, filter_projections_test,
// back_project_test and projection_bounds_test.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace vdvr::reference {

inline double frequency(std::size_t m, std::size_t n) {
  return std::numbers::pi * static_cast<double>(m) / static_cast<double>(n);
}

/// a_m of q(x) = sum_m a_m cos(pi m (x + 1/2) / n).
inline std::vector<double> cosine_coefficients(std::span<const double> q) {
  const std::size_t n = q.size();
  std::vector<double> a(n, 0.0);
  for (std::size_t m = 0; m < n; ++m) {
    for (std::size_t i = 0; i < n; ++i)
      a[m] += q[i] * std::cos(frequency(m, n) * (static_cast<double>(i) + 0.5));
    a[m] *= (m == 0 ? 1.0 : 2.0) / static_cast<double>(n);
  }
  return a;
}

/// The series or its derivative of even order at x (samples lie at 0, 1, ..), with x measured in `pitch`
/// units.
inline double cosine_series(std::span<const double> a, double x, int order = 0, double pitch = 1) {
  double sum = 0;
  for (std::size_t m = 0; m < a.size(); ++m) {
    const double omega = frequency(m, a.size());
    sum += a[m] * std::pow(omega / pitch, order) * std::cos(omega * (x + 0.5));
  }
  return order % 4 == 2 ? -sum : sum;
}

}  // namespace vdvr::reference
