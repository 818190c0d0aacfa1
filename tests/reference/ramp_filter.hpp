// The ramp filter by its definition: direct convolution with the sampled band-limited kernel (Kak and Slaney,
// eq. 3.61), double precision, equally spaced views. Used by filter_projections_test and back_project_test.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr::reference {

/// double filtered[view][u][v], times pi / views: the weight of equally spaced views over 180 degrees.
inline std::vector<double> ramp_filtered(const ProjectionSet& scan) {
  const auto U = static_cast<std::size_t>(scan.geometry.columns),
             V = static_cast<std::size_t>(scan.geometry.rows);
  const auto K = static_cast<std::size_t>(scan.geometry.views());
  constexpr double pi = std::numbers::pi;
  const double tau = scan.geometry.pitch_u, weight = pi / static_cast<double>(K);
  std::vector<double> h{1 / (4 * tau)};
  for (std::size_t n = 1; n < U; ++n)
    h.push_back(n % 2 == 1 ? -1 / (pi * pi * static_cast<double>(n * n) * tau) : 0.0);
  std::vector<double> out(K * U * V, 0.0);
  for (std::size_t k = 0; k < K; ++k)
    for (std::size_t v = 0; v < V; ++v)
      for (std::size_t u = 0; u < U; ++u) {
        double sum = 0;
        for (std::size_t m = 0; m < U; ++m)
          sum += h[u > m ? u - m : m - u] * static_cast<double>(scan.data[(k * V + v) * U + m]);
        out[(k * U + u) * V + v] = weight * sum;
      }
  return out;
}

}  // namespace vdvr::reference
