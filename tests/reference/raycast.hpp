// Pictures in double precision, straight from the definitions, without the shared sampler: a pinhole ray, a
// ray-box intersection, and emission-absorption over midpoint samples of any function. Slow; for a few
// pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "vdvr/raycast.hpp"

namespace vdvr::reference {

struct Ray {
  Vec3 origin{}, direction{};  ///< world; the direction has length 1
};

inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 unit(const Vec3& a) {
  const double n = std::sqrt(dot(a, a));
  return {a[0] / n, a[1] / n, a[2] / n};
}
inline Vec3 along(const Ray& r, double t) {
  return {r.origin[0] + t * r.direction[0], r.origin[1] + t * r.direction[1],
          r.origin[2] + t * r.direction[2]};
}

/// Through the centre of pixel (x, y) of a width x height picture, row 0 on top.
inline Ray pixel_ray(const Camera& c, std::int64_t width, std::int64_t height, std::int64_t x,
                     std::int64_t y) {
  const Vec3 view = unit(
      {c.focal_point[0] - c.position[0], c.focal_point[1] - c.position[1], c.focal_point[2] - c.position[2]});
  const Vec3 right = unit(cross(view, c.view_up)), up = cross(right, view);
  const double half = std::tan(c.view_angle_deg / 2 * M_PI / 180);
  const double w = static_cast<double>(width), h = static_cast<double>(height);
  const double sx = (2 * (static_cast<double>(x) + 0.5) / w - 1) * half * w / h,
               sy = (1 - 2 * (static_cast<double>(y) + 0.5) / h) * half;
  Ray r{c.position, {}};
  for (std::size_t a = 0; a < 3; ++a) r.direction[a] = view[a] + sx * right[a] + sy * up[a];
  r.direction = unit(r.direction);
  return r;
}

/// Entry and exit of the grid's box, entry >= 0; exit < entry where it is missed.
inline std::pair<double, double> clip(const Ray& r, const Grid& g) {
  double in = 0, out = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    const double lo = g.origin[a], hi = lo + static_cast<double>(g.cells[a]) * g.spacing[a];
    if (r.direction[a] == 0) {
      if (r.origin[a] < lo || r.origin[a] > hi) return {0, -1};
      continue;
    }
    const double p = (lo - r.origin[a]) / r.direction[a], q = (hi - r.origin[a]) / r.direction[a];
    in = std::max(in, std::min(p, q));
    out = std::min(out, std::max(p, q));
  }
  return {in, out};
}

struct Emission {
  Vec3 rgb{};
  double alpha = 0;  ///< of one step
};
/// Front to back at entry + (k + 1/2) step, without background, shading or early end: rgb (premultiplied) and
/// opacity. The last step ends at the exit: its sample is in the middle of what is left of it, its opacity
/// that of so much of a step.
inline std::array<double, 4> emission_absorption(const Ray& r, const Grid& g, double step,
                                                 const std::function<Emission(const Vec3&)>& f) {
  const auto [in, out] = clip(r, g);
  std::array<double, 4> sum{0, 0, 0, 0};
  for (std::int64_t k = 0; in + static_cast<double>(k) * step < out; ++k) {
    const double from = in + static_cast<double>(k) * step, to = std::min(from + step, out);
    const Emission e = f(along(r, (from + to) / 2));
    const double alpha = 1 - std::pow(1 - e.alpha, (to - from) / step);
    const double weight = (1 - sum[3]) * alpha;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * e.rgb[c];
    sum[3] += weight;
  }
  return sum;
}

/// Distance from the ray's origin to a sphere about `centre`; negative where it is missed.
inline double sphere_distance(const Ray& r, const Vec3& centre, double radius) {
  const Vec3 o{r.origin[0] - centre[0], r.origin[1] - centre[1], r.origin[2] - centre[2]};
  const double b = dot(o, r.direction), c = dot(o, o) - radius * radius, disc = b * b - c;
  return disc < 0 ? -1 : -b - std::sqrt(disc);
}

}  // namespace vdvr::reference
