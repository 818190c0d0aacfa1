// Derivatives of F from its cosine series, term by term in double precision; F itself is that of order 0.
// Used by brick_remainder_test and attack_gold_test.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "tests/reference/cosine_series.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::reference {

/// F = sum over views of q_k(x cos + y sin, z), q_k the cosine series of samples [view][u][v].
class FieldDerivatives {
 public:
  FieldDerivatives(const ParallelGeometry& g, std::span<const float> samples) : g_(g) {
    const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
      std::vector<std::vector<double>> along_v(U);  // [u][l]
      for (std::size_t u = 0; u < U; ++u) {
        const float* row = samples.data() + (k * U + u) * V;
        along_v[u] = cosine_coefficients(std::vector<double>(row, row + V));
      }
      for (std::size_t l = 0; l < V; ++l) {
        std::vector<double> column(U);
        for (std::size_t u = 0; u < U; ++u) column[u] = along_v[u][l];
        const std::vector<double> a = cosine_coefficients(column);
        amplitudes_.insert(amplitudes_.end(), a.begin(), a.end());  // [view][l][m]
      }
    }
  }

  /// Derivatives of even orders at a world point, in world units: one for each {along x, y, z}.
  template <std::size_t n>
  [[nodiscard]] std::array<double, n> at(const std::array<double, 3>& p,
                                         const std::array<std::array<int, 3>, n>& orders) const {
    const auto U = static_cast<std::size_t>(g_.columns), V = static_cast<std::size_t>(g_.rows);
    const double v = p[2] / g_.pitch_v + 0.5 * static_cast<double>(V);  // from the first row's edge
    std::array<double, n> out{};
    std::vector<double> wave_u(U), wave_v(V);
    for (std::size_t l = 0; l < V; ++l) wave_v[l] = std::cos(frequency(l, V) * v);
    for (std::size_t k = 0; k < g_.theta_rad.size(); ++k) {
      const double c = std::cos(g_.theta_rad[k]), s = std::sin(g_.theta_rad[k]);
      const double u = (p[0] * c + p[1] * s) / g_.pitch_u + g_.center + 0.5;
      for (std::size_t m = 0; m < U; ++m) wave_u[m] = std::cos(frequency(m, U) * u);
      std::array<double, n> sum{};
      for (std::size_t l = 0; l < V; ++l)
        for (std::size_t m = 0; m < U; ++m) {
          const double wave = amplitudes_[(k * V + l) * U + m] * wave_u[m] * wave_v[l],
                       wu = frequency(m, U) / g_.pitch_u, wv = frequency(l, V) / g_.pitch_v;
          for (std::size_t i = 0; i < n; ++i)
            sum[i] += wave * power(wu, orders[i][0] + orders[i][1]) * power(wv, orders[i][2]);
        }
      for (std::size_t i = 0; i < n; ++i)
        out[i] += sum[i] * std::abs(power(c, orders[i][0]) * power(s, orders[i][1]));
    }
    return out;
  }

 private:
  // (i w)^order, order even.
  static double power(double w, int order) {
    const double square = -w * w;
    return order == 0 ? 1.0 : order == 2 ? square : square * square;
  }
  ParallelGeometry g_;
  std::vector<double> amplitudes_;
};

}  // namespace vdvr::reference
