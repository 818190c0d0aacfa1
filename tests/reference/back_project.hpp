// Back-projection of upsampled rows in double precision, one sample at a time: interpolate every view at t,
// add. Used by back_project_test.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "host/fbp/cosine_series.hpp"
#include "vdvr/projections.hpp"

namespace vdvr::reference {

/// double values[view][column][row]
struct UpsampledViews {
  UpsampledColumns columns;
  std::int64_t views = 0, rows = 0;
  std::vector<double> values;
  [[nodiscard]] double at(std::int64_t k, std::int64_t n, std::int64_t z) const {
    return values[static_cast<std::size_t>((k * columns.count + n) * rows + z)];
  }
};

struct BackProjected {
  double value = 0;
  double magnitude = 0;  ///< sum of |weight * sample|
  double slope =
      0;  ///< sum over views of a bound on |d value / d column| within a column of where the view is hit
  bool inside = true;  ///< every stencil lies on the columns
};

/// `filter`: linear between columns, or the cubic through the four nearest.
inline BackProjected back_project(const UpsampledViews& q, const ParallelGeometry& g, double x, double y,
                                  std::int64_t z, Interpolation filter) {
  BackProjected out;
  const std::int64_t below = filter == Interpolation::cubic ? 1 : 0,
                     above = filter == Interpolation::cubic ? 2 : 1;
  for (std::int64_t k = 0; k < q.views; ++k) {
    const double theta = g.theta_rad[static_cast<std::size_t>(k)];
    const double s = q.columns.column_of((x * std::cos(theta) + y * std::sin(theta)) / g.pitch_u + g.center);
    const auto n = static_cast<std::int64_t>(std::floor(s));
    if (n - below - 1 < 0 || n + above + 1 >= q.columns.count) {
      out.inside = false;
      return out;
    }
    for (std::int64_t i = n - below; i <= n + above; ++i) {
      double weight = 1;  // Lagrange's
      for (std::int64_t j = n - below; j <= n + above; ++j)
        if (j != i) weight *= (s - static_cast<double>(j)) / static_cast<double>(i - j);
      out.value += weight * q.at(k, i, z);
      out.magnitude += std::abs(weight * q.at(k, i, z));
    }
    // Linear: the steepest neighbouring pair. Cubic: its slope is a combination of first differences with
    // weights of at most 4/3.
    double steepest = 0;
    for (std::int64_t i = n - below - 1; i <= n + above; ++i)
      steepest = std::max(steepest, std::abs(q.at(k, i + 1, z) - q.at(k, i, z)));
    out.slope += (filter == Interpolation::cubic ? 4.0 / 3 : 1.0) * steepest;
  }
  return out;
}

}  // namespace vdvr::reference
