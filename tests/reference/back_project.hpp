// Back-projection of upsampled rows in double precision, one sample at a time: interpolate every view at t,
// add. Used by back_project_test.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "host/certify/bounds/column_taps.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "vdvr/expert/projections.hpp"

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
  double largest = 0;  ///< sum over views of the largest sample that is read
  double jump = 0;     ///< sum over views of what it may jump by from one column to the next
  bool inside = true;  ///< every stencil lies on the columns
};

/// `filter`: linear between columns, the cubic through the four nearest, or the six weights.
inline BackProjected back_project(const UpsampledViews& q, const ParallelGeometry& g, double x, double y,
                                  std::int64_t z, Interpolation filter) {
  BackProjected out;
  const bool six = filter == Interpolation::six_taps;
  const std::int64_t below = six ? 2 : filter == Interpolation::cubic ? 1 : 0, above = below + 1;
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
      for (std::int64_t j = n - below; j <= n + above && !six; ++j)
        if (j != i) weight *= (s - static_cast<double>(j)) / static_cast<double>(i - j);
      if (six) weight = six_taps(s - static_cast<double>(n))[static_cast<std::size_t>(i - n + below)];
      out.value += weight * q.at(k, i, z);
      out.magnitude += std::abs(weight * q.at(k, i, z));
    }
    // Linear: the steepest neighbouring pair. Cubic: its slope is a combination of first differences with
    // weights of at most 4/3; that of six weights, which do not add to 1, takes a little of the values too.
    double steepest = 0, largest = 0;
    for (std::int64_t i = n - below - 1; i <= n + above; ++i) {
      steepest = std::max(steepest, std::abs(q.at(k, i + 1, z) - q.at(k, i, z)));
      largest = std::max({largest, std::abs(q.at(k, i, z)), std::abs(q.at(k, i + 1, z))});
    }
    out.largest += largest;
    out.slope += six ? six_tap_facts().slope * steepest + six_tap_facts().slope_sum * largest
                     : (filter == Interpolation::cubic ? 4.0 / 3 : 1.0) * steepest;
    // Six weights jump a little at a column: a place that is rounded may lie on its other side.
    const auto column = static_cast<std::int64_t>(std::round(s));
    if (six && std::abs(s - static_cast<double>(column)) < 1e-3) {
      double jump = 0;
      for (std::size_t i = 0; i < 6; ++i) {
        const auto tap = static_cast<std::int64_t>(i);
        jump += six_taps(0)[i] * q.at(k, column - 2 + tap, z) - six_taps(1)[i] * q.at(k, column - 3 + tap, z);
      }
      out.jump += std::abs(jump);
    }
  }
  return out;
}

}  // namespace vdvr::reference
