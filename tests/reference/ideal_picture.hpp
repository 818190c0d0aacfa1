// The ideal picture in double precision: rays of a camera, and what they show of a field that is constant on
// each of many short steps, without error. Nothing here knows of cells of kernels, tables or packets.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::reference {

using Rgb3 = std::array<double, 3>;

struct IdealRay {
  Vec3 from{}, direction{};    ///< world; direction of unit length
  double first = 0, last = 0;  ///< inside grid and clip; nothing where first >= last
  [[nodiscard]] Vec3 at(double t) const {
    return {from[0] + t * direction[0], from[1] + t * direction[1], from[2] + t * direction[2]};
  }
};

inline IdealRay ideal_ray(const RenderOptions& o, const Grid& g, std::int64_t px, std::int64_t py) {
  const auto minus = [](const Vec3& a, const Vec3& b) { return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
  const auto cross = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto unit = [](Vec3 a) {
    const double n = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    return Vec3{a[0] / n, a[1] / n, a[2] / n};
  };
  const Vec3 forward = unit(minus(o.camera.focal_point, o.camera.position)),
             right = unit(cross(forward, o.camera.view_up)), up = cross(right, forward);
  const double tangent = std::tan(o.camera.view_angle_deg * 3.14159265358979323846 / 360),
               aspect = static_cast<double>(o.width) / static_cast<double>(o.height);
  const double a = (2 * (static_cast<double>(px) + 0.5) / static_cast<double>(o.width) - 1) * tangent *
                   aspect,
               b = (1 - 2 * (static_cast<double>(py) + 0.5) / static_cast<double>(o.height)) * tangent;
  IdealRay r;
  r.from = o.camera.position;
  r.direction = unit({forward[0] + a * right[0] + b * up[0], forward[1] + a * right[1] + b * up[1],
                      forward[2] + a * right[2] + b * up[2]});
  r.last = std::numeric_limits<double>::infinity();
  const Clip clip = o.clip.value_or(Clip{});
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = std::max(g.origin[k], clip.low[k]),
                 high = std::min(g.origin[k] + static_cast<double>(g.cells[k]) * g.spacing[k], clip.high[k]);
    const double s = (low - r.from[k]) / r.direction[k], t = (high - r.from[k]) / r.direction[k];
    r.first = std::max(r.first, std::min(s, t));
    r.last = std::min(r.last, std::max(s, t));
  }
  if (std::isfinite(clip.radius)) {
    const double x = r.from[0] - clip.axis[0], y = r.from[1] - clip.axis[1], dx = r.direction[0],
                 dy = r.direction[1], p = dx * dx + dy * dy, q = x * dx + y * dy,
                 under = q * q - p * (x * x + y * y - clip.radius * clip.radius);
    if (under <= 0) r.last = r.first;
    else {
      r.first = std::max(r.first, (-q - std::sqrt(under)) / p);
      r.last = std::min(r.last, (-q + std::sqrt(under)) / p);
    }
  }
  return r;
}

/// Both sides of a jump where `above` says: the last or the first of several points at a value.
inline TransferPoint shown_at(const std::vector<TransferPoint>& points, double value, bool above = true) {
  if (value <= points.front().value && !(above && value == points.front().value)) return points.front();
  std::size_t i = 0;
  while (i + 1 < points.size() && (above ? points[i + 1].value <= value : points[i + 1].value < value)) ++i;
  if (i + 1 == points.size()) return points.back();
  const TransferPoint &a = points[i], &b = points[i + 1];
  if (a.value == b.value) return b;
  const double t = (value - a.value) / (b.value - a.value);
  TransferPoint p;
  p.value = value;
  for (std::size_t c = 0; c < 3; ++c) p.rgb[c] = (1 - t) * a.rgb[c] + t * b.rgb[c];
  p.opacity = (1 - t) * a.opacity + t * b.opacity;
  return p;
}

/// Extinction a base cell.
inline double extinction(double opacity) { return -std::log1p(-std::min(opacity, 1 - 0x1p-50)); }

/// What lies behind a step of `length` base cells and of one value, seen through it.
inline Rgb3 through(const TransferPoint& p, double length, const Rgb3& behind) {
  const double passes = std::exp(-extinction(p.opacity) * length);
  Rgb3 seen{};
  for (std::size_t c = 0; c < 3; ++c) seen[c] = p.rgb[c] + (behind[c] - p.rgb[c]) * passes;
  return seen;
}

inline Rgb3 background_of(const RenderOptions& o, std::int64_t py) {
  const double f = (static_cast<double>(py) + 0.5) / static_cast<double>(o.height);
  Rgb3 b{};
  for (std::size_t c = 0; c < 3; ++c) b[c] = (1 - f) * o.background_top[c] + f * o.background_bottom[c];
  return b;
}

}  // namespace vdvr::reference
