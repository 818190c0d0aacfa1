// The worst error of multilinear interpolation of a plane wave by exhaustive search, in double precision:
// over the positions t in a cell the largest |prod((1 - t_j) + t_j e^(i kappa_j)) - e^(i kappa . t)|, which
// is the error in the worst phase; and over phases and positions themselves, which the former is checked
// against. Used by error_map_test.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace vdvr::reference {

inline double wave_error_at(const std::vector<double>& kappa, const std::vector<double>& t) {
  std::complex<double> chord = 1;
  double phase = 0;
  for (std::size_t j = 0; j < kappa.size(); ++j) {
    chord *= (1 - t[j]) + t[j] * std::polar(1.0, kappa[j]);
    phase += kappa[j] * t[j];
  }
  return std::abs(chord - std::polar(1.0, phase));
}

/// A grid of steps + 1 points per axis, then a search around its best point with ever smaller steps. Below
/// the true maximum by no more than the grid misses; never above it but by rounding.
inline double worst_wave_error(const std::vector<double>& kappa, int steps) {
  const std::size_t n = kappa.size();
  std::vector<int> i(n, 0);
  std::vector<double> t(n, 0.0), best(n, 0.5);
  double worst = wave_error_at(kappa, best);
  for (bool more = true; more;) {
    for (std::size_t j = 0; j < n; ++j) t[j] = static_cast<double>(i[j]) / steps;
    if (const double e = wave_error_at(kappa, t); e > worst) {
      worst = e;
      best = t;
    }
    more = false;
    for (std::size_t j = 0; j < n && !more; ++j) {
      more = ++i[j] <= steps;
      if (!more) i[j] = 0;
    }
  }
  std::size_t neighbours = 1;
  for (std::size_t j = 0; j < n; ++j) neighbours *= 3;
  for (double step = 1.0 / steps; step > 1e-10;) {
    bool moved = false;
    const std::vector<double> from = best;
    for (std::size_t d = 0; d < neighbours; ++d) {
      std::size_t digits = d;
      for (std::size_t j = 0; j < n; ++j, digits /= 3)
        t[j] = std::clamp(from[j] + step * (static_cast<double>(digits % 3) - 1), 0.0, 1.0);
      if (const double e = wave_error_at(kappa, t); e > worst) {
        worst = e;
        best = t;
        moved = true;
      }
    }
    if (!moved) step /= 2;
  }
  return worst;
}

/// One dimension by the definition: cos(kappa x + phase) against its linear interpolant, over both.
inline double worst_wave_error_by_phase(double kappa, int phases, int positions) {
  double worst = 0;
  for (int p = 0; p < phases; ++p) {
    const double phase = 2 * std::numbers::pi * p / phases;
    for (int i = 0; i <= positions; ++i) {
      const double t = static_cast<double>(i) / positions;
      worst = std::max(worst, std::abs((1 - t) * std::cos(phase) + t * std::cos(kappa + phase) -
                                       std::cos(kappa * t + phase)));
    }
  }
  return worst;
}

}  // namespace vdvr::reference
