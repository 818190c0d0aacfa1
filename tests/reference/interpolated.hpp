// A uniform volume between its samples, in double precision, written from docs/audit.md: nearest, trilinear,
// and the cubic of Catmull and Rom along each axis in turn, samples beyond the volume being those at its
// edge.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr::reference {

inline double stored(const Volume& v, std::int64_t x, std::int64_t y, std::int64_t z) {
  const Index3 n = v.grid.samples();
  x = std::clamp<std::int64_t>(x, 0, n[0] - 1);
  y = std::clamp<std::int64_t>(y, 0, n[1] - 1);
  z = std::clamp<std::int64_t>(z, 0, n[2] - 1);
  return static_cast<double>(v.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]);
}

/// Through p1 at 0 and p2 at 1, with the slopes (p2 - p0) / 2 and (p3 - p1) / 2 there.
inline double hermite(double p0, double p1, double p2, double p3, double t) {
  const double m1 = (p2 - p0) / 2, m2 = (p3 - p1) / 2;
  return (2 * t * t * t - 3 * t * t + 1) * p1 + (t * t * t - 2 * t * t + t) * m1 +
         (3 * t * t - 2 * t * t * t) * p2 + (t * t * t - t * t) * m2;
}

/// `point` in cells from the first sample.
inline double interpolated(const Volume& v, Between between, const Vec3& point) {
  const auto whole = [](double c) { return static_cast<std::int64_t>(std::floor(c)); };
  if (between == Between::nearest)
    return stored(v, whole(point[0] + 0.5), whole(point[1] + 0.5), whole(point[2] + 0.5));
  const std::int64_t x = whole(point[0]), y = whole(point[1]), z = whole(point[2]);
  const double tx = point[0] - static_cast<double>(x), ty = point[1] - static_cast<double>(y),
               tz = point[2] - static_cast<double>(z);
  const auto along_x = [&](std::int64_t j, std::int64_t k) {
    if (between == Between::linear) return (1 - tx) * stored(v, x, j, k) + tx * stored(v, x + 1, j, k);
    return hermite(stored(v, x - 1, j, k), stored(v, x, j, k), stored(v, x + 1, j, k), stored(v, x + 2, j, k),
                   tx);
  };
  const auto along_y = [&](std::int64_t k) {
    if (between == Between::linear) return (1 - ty) * along_x(y, k) + ty * along_x(y + 1, k);
    return hermite(along_x(y - 1, k), along_x(y, k), along_x(y + 1, k), along_x(y + 2, k), ty);
  };
  if (between == Between::linear) return (1 - tz) * along_y(z) + tz * along_y(z + 1);
  return hermite(along_y(z - 1), along_y(z), along_y(z + 1), along_y(z + 2), tz);
}

}  // namespace vdvr::reference
