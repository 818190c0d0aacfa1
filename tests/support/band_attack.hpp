// Attacks on bounds of sums over nodes: waves, and functions of a band that are as flat as they can be for
// what the sum errs on them. Direct sums; shares nothing with host/certify/bounds/node_functional.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace vdvr {

/// |sum_i taps[i] exp(i kappa (first + i)) - (i kappa)^order|, order even.
inline double wave_error(const std::vector<double>& taps, double first, int order, double kappa) {
  std::complex<long double> sum = -std::pow(static_cast<long double>(kappa), order);
  if (order % 4 == 2) sum = -sum;
  for (std::size_t i = 0; i < taps.size(); ++i)
    sum += static_cast<long double>(taps[i]) *
           std::polar(1.0L, static_cast<long double>(kappa) * (first + static_cast<double>(i)));
  return static_cast<double>(std::abs(sum));
}

/// The largest error of a value, over sup |f|, that was found among f = sum_m of cosines and sines of
/// frequencies m / 24 of the band, m <= 24: least sup at an error of 1, by Lawson's reweighting of places.
/// sup |f| is taken from a grid and Bernstein's inequality, so the quotient is reached.
class FlatAttack {
 public:
  FlatAttack(const std::vector<double>& taps, double first, double band) : band_(band) {
    for (std::size_t n = 0; n < unknowns; ++n) {
      error_.push_back(-basis(n, 0));
      for (std::size_t i = 0; i < taps.size(); ++i)
        error_[n] += taps[i] * basis(n, first + static_cast<double>(i));
    }
    for (std::size_t p = 0; p < places; ++p)
      for (std::size_t n = 0; n < unknowns; ++n) at_.push_back(basis(n, step() * static_cast<double>(p)));
  }

  double largest_quotient() {
    std::vector<double> weight(places, 1.0);
    double best = 0;
    for (int round = 0; round < 40; ++round) {
      const std::vector<double> f = solve(weight);
      double sup = 0, error = 0;
      for (std::size_t n = 0; n < unknowns; ++n) error += f[n] * error_[n];
      for (std::size_t p = 0; p < places; ++p) sup = std::max(sup, std::abs(value(f, p)));
      for (std::size_t p = 0; p < places; ++p) weight[p] *= std::abs(value(f, p)) / sup + 1e-3;
      const double between = 1 - band_ * band_ * step() * step() / 8;
      best = std::max(best, std::abs(error) / sup * between);
    }
    return best;
  }

 private:
  static constexpr std::size_t waves = 24, unknowns = 2 * waves + 1, places = 768;

  [[nodiscard]] double step() const {
    return 2 * std::numbers::pi * waves / band_ / static_cast<double>(places);
  }
  [[nodiscard]] double basis(std::size_t n, double x) const {
    const double phase = band_ * static_cast<double>((n + 1) / 2) / waves * x;
    return n % 2 == 0 ? std::cos(phase) : std::sin(phase);
  }
  [[nodiscard]] double value(const std::vector<double>& f, std::size_t p) const {
    double sum = 0;
    for (std::size_t n = 0; n < unknowns; ++n) sum += f[n] * at_[p * unknowns + n];
    return sum;
  }

  // The f of least weighted squares with an error of 1, but for a factor: Gram matrix^-1 times the errors.
  [[nodiscard]] std::vector<double> solve(const std::vector<double>& weight) const {
    std::vector<double> gram(unknowns * unknowns, 0.0), x = error_;
    for (std::size_t p = 0; p < places; ++p)
      for (std::size_t n = 0; n < unknowns; ++n)
        for (std::size_t m = 0; m <= n; ++m)
          gram[n * unknowns + m] += weight[p] * at_[p * unknowns + n] * at_[p * unknowns + m];
    double trace = 0;
    for (std::size_t n = 0; n < unknowns; ++n) trace += gram[n * unknowns + n];
    for (std::size_t n = 0; n < unknowns; ++n) gram[n * unknowns + n] += 1e-12 * trace;
    for (std::size_t n = 0; n < unknowns; ++n) {  // Cholesky, and forward substitution
      for (std::size_t m = 0; m <= n; ++m) {
        double sum = gram[n * unknowns + m];
        for (std::size_t k = 0; k < m; ++k) sum -= gram[n * unknowns + k] * gram[m * unknowns + k];
        gram[n * unknowns + m] = m == n ? std::sqrt(sum) : sum / gram[m * unknowns + m];
      }
      for (std::size_t k = 0; k < n; ++k) x[n] -= gram[n * unknowns + k] * x[k];
      x[n] /= gram[n * unknowns + n];
    }
    for (std::size_t n = unknowns; n-- > 0;) {
      for (std::size_t k = n + 1; k < unknowns; ++k) x[n] -= gram[k * unknowns + n] * x[k];
      x[n] /= gram[n * unknowns + n];
    }
    return x;
  }

  double band_;
  std::vector<double> error_, at_;
};

}  // namespace vdvr
