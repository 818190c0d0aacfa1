// FDK of a plain circular scan by its formulas (Feldkamp, Davis and Kress 1984; Kak and Slaney, chapter 3.6),
// in double precision and as slow as they are written: cosine weight, ramp, (R / (R + s))^2, bilinear between
// pixels. The detector is scaled to the axis; the axis falls on its middle.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::reference {

class Fdk {
 public:
  /// `source_to_axis` in units of the pitch at the axis, which is 1.
  Fdk(const ProjectionSet& scan, double source_to_axis)
      : scan_(scan), R_(source_to_axis), q_(scan.data.size()) {
    const std::int64_t U = scan.geometry.columns, V = scan.geometry.rows, K = scan.geometry.views();
    constexpr double pi = std::numbers::pi;
    for (std::int64_t k = 0; k < K; ++k)
      for (std::int64_t v = 0; v < V; ++v)
        for (std::int64_t u = 0; u < U; ++u) {
          double sum = 0;
          for (std::int64_t m = 0; m < U; ++m) {
            const double a = static_cast<double>(m) - 0.5 * static_cast<double>(U - 1),
                         b = static_cast<double>(v) - 0.5 * static_cast<double>(V - 1);
            const std::int64_t n = std::abs(u - m);
            const double h = n == 0 ? 0.25 : n % 2 == 1 ? -1 / (pi * pi * static_cast<double>(n * n)) : 0;
            sum += h * R_ / std::sqrt(R_ * R_ + a * a + b * b) *
                   static_cast<double>(scan.data[static_cast<std::size_t>((k * V + v) * U + m)]);
          }
          q_[static_cast<std::size_t>((k * V + v) * U + u)] = pi / static_cast<double>(K) * sum;
        }
  }

  [[nodiscard]] double at(const Vec3& p) const {
    const ParallelGeometry& g = scan_.geometry;
    double sum = 0;
    for (std::int64_t k = 0; k < g.views(); ++k) {
      const double c = std::cos(g.theta_rad[static_cast<std::size_t>(k)]),
                   s = std::sin(g.theta_rad[static_cast<std::size_t>(k)]);
      // The source lies at R (sin, -cos).
      const double far = R_ - (p[0] * s - p[1] * c), zoom = R_ / far;
      const double u = (p[0] * c + p[1] * s) * zoom + 0.5 * static_cast<double>(g.columns - 1),
                   v = p[2] * zoom + 0.5 * static_cast<double>(g.rows - 1);
      sum += zoom * zoom * bilinear(k, u, v);
    }
    return sum;
  }

 private:
  [[nodiscard]] double bilinear(std::int64_t k, double u, double v) const {
    const auto i = static_cast<std::int64_t>(std::floor(u)), j = static_cast<std::int64_t>(std::floor(v));
    const double f = u - static_cast<double>(i), g = v - static_cast<double>(j);
    return (1 - g) * ((1 - f) * pixel(k, i, j) + f * pixel(k, i + 1, j)) +
           g * ((1 - f) * pixel(k, i, j + 1) + f * pixel(k, i + 1, j + 1));
  }
  // Mirrored about the outer pixels' outer edges.
  [[nodiscard]] double pixel(std::int64_t k, std::int64_t i, std::int64_t j) const {
    const std::int64_t U = scan_.geometry.columns, V = scan_.geometry.rows;
    const auto mirrored = [](std::int64_t x, std::int64_t n) {
      return x < 0 ? -1 - x : x >= n ? 2 * n - 1 - x : x;
    };
    return q_[static_cast<std::size_t>((k * V + mirrored(j, V)) * U + mirrored(i, U))];
  }

  const ProjectionSet& scan_;
  double R_;
  std::vector<double> q_;
};

}  // namespace vdvr::reference
