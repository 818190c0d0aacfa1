// The first point of a ray where a mixed-resolution field changes sides of a value, in double precision: the
// planes of the finest level cut the ray into pieces that lie in one cell each, where the field is a cubic
// through its values at four points. Slow; for a few thousand rays.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/reference/mixed_field.hpp"
#include "tests/reference/raycast.hpp"

namespace vdvr::reference {

inline constexpr double kNoRoot = std::numeric_limits<double>::infinity();

/// First root of the cubic through (0, f[0]), (1/3, f[1]), (2/3, f[2]), (1, f[3]) within [0, 1], above or
/// below `value` at 0; kNoRoot where it stays on one side.
inline double first_cubic_root(const std::array<double, 4>& f, double value) {
  const double a0 = f[0] - value, a1 = -5.5 * f[0] + 9 * f[1] - 4.5 * f[2] + f[3],
               a2 = 9 * f[0] - 22.5 * f[1] + 18 * f[2] - 4.5 * f[3],
               a3 = -4.5 * f[0] + 13.5 * f[1] - 13.5 * f[2] + 4.5 * f[3];
  const auto at = [&](double s) { return a0 + s * (a1 + s * (a2 + s * a3)); };
  std::vector<double> ends{0};
  const double disc = a2 * a2 - 3 * a3 * a1;
  if (disc > 0)
    for (const double sign : {-1.0, 1.0}) {
      // Both forms of the quadratic's roots: one of them does not cancel.
      const double w = -(a2 + (a2 < 0 ? -1 : 1) * std::sqrt(disc));
      const double s = sign < 0 ? w / (3 * a3) : a1 / w;
      if (s > 0 && s < 1) ends.push_back(s);
    }
  ends.push_back(1);
  std::sort(ends.begin(), ends.end());
  const bool above = a0 >= 0;
  for (std::size_t i = 1; i < ends.size(); ++i) {
    if ((at(ends[i]) >= 0) == above) continue;
    double from = ends[i - 1], to = ends[i];
    for (int k = 0; k < 60; ++k) {
      const double middle = (from + to) / 2;
      ((at(middle) >= 0) == above ? from : to) = middle;
    }
    return to;
  }
  return kNoRoot;
}

/// The ray's pieces between planes of the finest level, from entry to exit.
inline std::vector<double> pieces_of(const MixedVolume& v, const Ray& r) {
  const auto [in, out] = clip(r, v.grid);
  std::vector<double> t{in, out};
  if (!(out > in)) return {};
  for (std::size_t a = 0; a < 3; ++a) {
    if (r.direction[a] == 0) continue;
    for (std::int64_t i = 0; i <= v.grid.cells[a] * v.rate; ++i) {
      const double plane = v.grid.origin[a] + v.grid.spacing[a] * static_cast<double>(i) / v.rate;
      const double at = (plane - r.origin[a]) / r.direction[a];
      if (at > in && at < out) t.push_back(at);
    }
  }
  std::sort(t.begin(), t.end());
  return t;
}

struct FirstRoot {
  double start = 0;    ///< the field where the ray enters
  double t = kNoRoot;  ///< from the ray's origin
};
inline FirstRoot first_root(const MixedVolume& v, const Ray& r, double value) {
  FirstRoot result;
  const std::vector<double> t = pieces_of(v, r);
  const auto cell_of = [&](double at) {
    Vec3 c = along(r, at);
    for (std::size_t a = 0; a < 3; ++a)
      c[a] = std::clamp((c[a] - v.grid.origin[a]) / v.grid.spacing[a], 0.0,
                        static_cast<double>(v.grid.cells[a]));
    return c;
  };
  for (std::size_t i = 1; i < t.size(); ++i) {
    const double length = t[i] - t[i - 1];
    const Vec3 middle = cell_of(t[i - 1] + length / 2);
    const Index3 brick{brick_of(v, 0, middle[0]), brick_of(v, 1, middle[1]), brick_of(v, 2, middle[2])};
    std::array<double, 4> f{};
    for (std::size_t k = 0; k < 4; ++k) {
      Vec3 c = cell_of(t[i - 1] + length * static_cast<double>(k) / 3);
      // Rounding must not leave the brick.
      for (std::size_t a = 0; a < 3; ++a)
        c[a] = std::max(c[a], static_cast<double>(brick[a] * v.granularity));
      f[k] = field_of_brick(v, brick, c);
    }
    if (i == 1) result.start = f[0];
    // A jump of the field between bricks.
    if ((f[0] >= value) != (result.start >= value)) return {result.start, t[i - 1]};
    const double root = first_cubic_root(f, value);
    if (root <= 1) return {result.start, t[i - 1] + root * length};
  }
  return result;
}

}  // namespace vdvr::reference
