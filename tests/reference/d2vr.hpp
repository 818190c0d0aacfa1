// The field of D2VR by its definition, in double precision: every view bilinear between its filtered samples.
// Beside the value what an fp32 evaluation may err by. Used by d2vr_test.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr::reference {

/// double values[view][column][row]; column 0 lies at detector column `first_column`, row 0 at detector row
/// 0, `rate` to a detector pixel.
struct BilinearViews {
  ParallelGeometry geometry;
  std::int64_t columns = 0, rows = 0;
  double first_column = 0, rate = 1;
  std::vector<double> values;

  [[nodiscard]] double at(std::int64_t k, std::int64_t u, std::int64_t v) const {
    u = std::clamp<std::int64_t>(u, 0, columns - 1);
    v = std::clamp<std::int64_t>(v, 0, rows - 1);
    return values[static_cast<std::size_t>((k * columns + u) * rows + v)];
  }
};

struct BilinearSum {
  double value = 0;
  double magnitude = 0;  ///< sum of |weight * sample|
  /// First order of the fp32 rounding of columns and rows, in units of 2^-24, times the steepest neighbouring
  /// pairs: x and y pass through 4 and 5 roundings (coordinate, step, product, sums), the offset through 3,
  /// rows through 4 and 2.
  double positions = 0;
};

inline BilinearSum bilinear_sum(const BilinearViews& q, const Vec3& p) {
  const ParallelGeometry& g = q.geometry;
  BilinearSum out;
  const double z = p[2] / g.pitch_v * q.rate, middle = 0.5 * static_cast<double>(g.rows - 1) * q.rate;
  const double row = std::clamp(z + middle, 0.0, static_cast<double>(q.rows - 1));
  const auto v = static_cast<std::int64_t>(std::floor(row));
  const double b = row - static_cast<double>(v), row_error = 4 * std::abs(z) + 2 * middle;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const double theta = g.theta_rad[static_cast<std::size_t>(k)];
    const double x = p[0] * std::cos(theta) / g.pitch_u * q.rate,
                 y = p[1] * std::sin(theta) / g.pitch_u * q.rate;
    const double offset = (g.center - q.first_column) * q.rate;
    const double column = std::clamp(x + y + offset, 0.0, static_cast<double>(q.columns - 1));
    const auto u = static_cast<std::int64_t>(std::floor(column));
    const double a = column - static_cast<double>(u);
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        const double w = (i == 0 ? 1 - a : a) * (j == 0 ? 1 - b : b) * q.at(k, u + i, v + j);
        out.value += w;
        out.magnitude += std::abs(w);
      }
    // Rounding may carry a position into the next interval.
    double across = 0, down = 0;
    for (std::int64_t i = u - 1; i <= u + 2; ++i)
      for (std::int64_t j = v - 1; j <= v + 2; ++j) {
        across = std::max(across, std::abs(q.at(k, i + 1, j) - q.at(k, i, j)));
        down = std::max(down, std::abs(q.at(k, i, j + 1) - q.at(k, i, j)));
      }
    out.positions += across * (4 * std::abs(x) + 5 * std::abs(y) + 3 * std::abs(offset)) + down * row_error;
  }
  return out;
}

/// The derivative of that sum with respect to x, y and z.
struct BilinearGradient {
  Vec3 value{0, 0, 0};
  Vec3 magnitude{0, 0, 0};  ///< sums of |terms|
  Vec3 mixed{0, 0, 0};      ///< sums of |changes| over a position of one column and one row
  double nearest = 1;       ///< how near the point comes to a kink, stored columns or rows
};

inline BilinearGradient bilinear_gradient(const BilinearViews& q, const Vec3& p) {
  const ParallelGeometry& g = q.geometry;
  BilinearGradient out;
  const double row = (p[2] / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1)) * q.rate;
  const auto v = static_cast<std::int64_t>(std::floor(row));
  const double b = row - static_cast<double>(v);
  out.nearest = std::min(b, 1 - b);
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const double theta = g.theta_rad[static_cast<std::size_t>(k)];
    const Vec3 step{std::cos(theta) / g.pitch_u * q.rate, std::sin(theta) / g.pitch_u * q.rate,
                    q.rate / g.pitch_v};
    const double column = p[0] * step[0] + p[1] * step[1] + (g.center - q.first_column) * q.rate;
    const auto u = static_cast<std::int64_t>(std::floor(column));
    const double a = column - static_cast<double>(u);
    out.nearest = std::min({out.nearest, a, 1 - a});
    const double low = q.at(k, u + 1, v) - q.at(k, u, v), high = q.at(k, u + 1, v + 1) - q.at(k, u, v + 1);
    const double left = q.at(k, u, v + 1) - q.at(k, u, v), right = q.at(k, u + 1, v + 1) - q.at(k, u + 1, v);
    const Vec3 terms{step[0] * ((1 - b) * low + b * high), step[1] * ((1 - b) * low + b * high),
                     step[2] * ((1 - a) * left + a * right)};
    for (std::size_t i = 0; i < 3; ++i) {
      out.value[i] += terms[i];
      out.magnitude[i] += std::abs(terms[i]);
      out.mixed[i] += std::abs(step[i] * (high - low));
    }
  }
  return out;
}

}  // namespace vdvr::reference
