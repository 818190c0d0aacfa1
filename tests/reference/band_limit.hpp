// The ideal low-pass written out: the cosine series of a row of 16 U samples, its terms below Nyquist, their
// sum at the U pixel centres. Direct sums in double precision. Used by simulate_test.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace vdvr::reference {

inline std::vector<double> band_limited(const std::vector<double>& fine, std::size_t columns) {
  const auto n = static_cast<double>(fine.size());
  std::vector<double> out(columns, 0.0);
  for (std::size_t m = 0; m < columns; ++m) {
    double c = 0;
    for (std::size_t k = 0; k < fine.size(); ++k)
      c += fine[k] * std::cos(std::numbers::pi * static_cast<double>(m) * (static_cast<double>(k) + 0.5) / n);
    c *= (m == 0 ? 1 : 2) / n;
    for (std::size_t i = 0; i < columns; ++i)
      out[i] += c * std::cos(std::numbers::pi * static_cast<double>(m) * (static_cast<double>(i) + 0.5) /
                             static_cast<double>(columns));
  }
  return out;
}

}  // namespace vdvr::reference
