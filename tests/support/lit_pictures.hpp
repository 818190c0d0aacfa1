// Pictures under the light of the field itself: of fields with an analytic F, and of what an adversary within
// the bounds may make of values and differences (docs/pixel-bounds.md, section 7).
#pragma once

#include <array>
#include <functional>
#include <random>
#include <vector>

#include "tests/reference/ideal_light.hpp"
#include "tests/support/analytic_pictures.hpp"

namespace vdvr::support {

/// The middles of equal steps of a ray: the field there, and half a base cell before and after along each
/// axis.
struct LitFieldOnRay {
  double length = 0;  ///< of a step, base cells
  std::vector<double> values;
  std::vector<std::array<std::array<double, 2>, 3>> around;
};

/// On a grid of spacing 1.
inline LitFieldOnRay along_lit_ray(const std::function<double(const Vec3&)>& f,
                                   const reference::IdealRay& ray, double step) {
  LitFieldOnRay out;
  if (!(ray.first < ray.last)) return out;
  const auto n = static_cast<std::size_t>(std::ceil((ray.last - ray.first) / step));
  out.length = (ray.last - ray.first) / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = ray.at(ray.first + (static_cast<double>(i) + 0.5) * out.length);
    out.values.push_back(f(p));
    auto& around = out.around.emplace_back();
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t k = 0; k < 2; ++k) {
        Vec3 beside = p;
        beside[a] += k == 0 ? -0.5 : 0.5;
        around[a][k] = f(beside);
      }
  }
  return out;
}

inline Vec3 gradient_of(const std::array<std::array<double, 2>, 3>& around) {
  return {around[0][1] - around[0][0], around[1][1] - around[1][0], around[2][1] - around[2][0]};
}

/// One channel of what lies behind a step that has this light.
inline double seen_through(const TransferPoint& p, const reference::IdealLight& light, double length,
                           std::size_t c, double behind) {
  const double own = light.on(p.rgb[c]);
  return own + (behind - own) * std::exp(-reference::extinction(p.opacity) * length);
}

/// Over the field that is constant on each step, its differences too.
inline reference::Rgb3 lit_colour_of(const LitFieldOnRay& field, const RenderOptions& o, const Vec3& view,
                                     double full, const reference::Rgb3& background) {
  reference::Rgb3 seen = background;
  for (std::size_t i = field.values.size(); i-- > 0;) {
    const TransferPoint p = reference::shown_at(o.transfer.points, field.values[i]);
    if (p.opacity == 0) continue;
    const reference::IdealLight light = reference::light_on(gradient_of(field.around[i]), view, o, full);
    for (std::size_t c = 0; c < 3; ++c) seen[c] = seen_through(p, light, field.length, c, seen[c]);
  }
  return seen;
}

/// Of values within `e` of V and differences within `d` of V's, step by step what shows most, or least,
/// before what lies behind.
inline double lit_adversary_of(const LitFieldOnRay& v, const std::vector<double>& e,
                               const std::vector<Vec3>& d, const RenderOptions& o, const Vec3& view,
                               double full, double background, std::size_t c, bool up, std::mt19937& random) {
  double behind = background;
  std::uniform_real_distribution<double> within(-1, 1);
  for (std::size_t i = v.values.size(); i-- > 0;) {
    const double low = v.values[i] - e[i], high = v.values[i] + e[i];
    std::vector<TransferPoint> shown;
    for (int k = 0; k <= 4; ++k)
      shown.push_back(reference::shown_at(o.transfer.points, low + (high - low) * k / 4));
    for (const TransferPoint& p : o.transfer.points)
      if (p.value >= low && p.value <= high) shown.push_back(p);
    bool any = false;
    for (const TransferPoint& p : shown) any |= p.opacity > 0;
    if (!any) continue;
    const Vec3 middle = gradient_of(v.around[i]);
    std::vector<reference::IdealLight> lights;
    const auto attempt = [&](const Vec3& at) {
      Vec3 g{};
      for (std::size_t a = 0; a < 3; ++a) g[a] = middle[a] + std::clamp(at[a], -1.0, 1.0) * d[i][a];
      lights.push_back(reference::light_on(g, view, o, full));
    };
    for (int k = 0; k < 8; ++k) attempt({k & 1 ? 1.0 : -1.0, k & 2 ? 1.0 : -1.0, k & 4 ? 1.0 : -1.0});
    for (int k = 0; k < 8; ++k) attempt({within(random), within(random), within(random)});
    // Towards the eye and away from it, and the weakest.
    for (const double s : {-1.0, 1.0}) {
      attempt({s * view[0] * 2, s * view[1] * 2, s * view[2] * 2});
      Vec3 along{}, none{};
      const double share = middle[0] * view[0] + middle[1] * view[1] + middle[2] * view[2];
      for (std::size_t a = 0; a < 3; ++a) {
        along[a] = d[i][a] > 0 ? (s * (std::abs(share) + 1e-3) * view[a] - middle[a]) / d[i][a] : 0;
        none[a] = d[i][a] > 0 ? -middle[a] / d[i][a] : 0;
      }
      attempt(along);
      attempt(none);
    }
    double best = up ? -INFINITY : INFINITY;
    for (const TransferPoint& p : shown)
      for (const reference::IdealLight& light : lights) {
        const double seen = seen_through(p, light, v.length, c, behind);
        best = up ? std::max(best, seen) : std::min(best, seen);
      }
    behind = best;
  }
  return behind;
}

/// What a field within bounds of V may be on each step, constant there, and half a base cell beside it:
/// middles and half widths. `low` and `high` give V - e and V + e.
struct LitRoom {
  LitFieldOnRay middle;
  std::vector<double> value;      ///< half widths
  std::vector<Vec3> differences;  ///< of differences
  bool enough = true;             ///< no step is too long for the bound
};
inline LitRoom room_on_ray(const std::function<double(const Vec3&)>& low,
                           const std::function<double(const Vec3&)>& high, const reference::IdealRay& ray,
                           double step) {
  LitRoom room;
  if (!(ray.first < ray.last)) return room;
  const auto n = static_cast<std::size_t>(std::ceil((ray.last - ray.first) / step));
  const double h = (ray.last - ray.first) / static_cast<double>(n);
  room.middle.length = h;
  // A cubic at five places, and a quarter more than it moves between them; fp32 of place and samples.
  const auto at = [&](double from, std::size_t axis, double shift) {
    double floor = -INFINITY, ceiling = INFINITY, least = INFINITY, most = -INFINITY;
    for (const double part : {1.0 / 64, 0.25, 0.5, 0.75, 63.0 / 64}) {
      Vec3 p = ray.at(from + part * h);
      p[axis] += shift;
      const double a = low(p), z = high(p);
      floor = std::max(floor, a);
      ceiling = std::min(ceiling, z);
      least = std::min(least, 0.5 * (a + z));
      most = std::max(most, 0.5 * (a + z));
    }
    const double moves = 0.25 * (most - least) + 1e-5;
    return std::pair(0.5 * (floor + ceiling), 0.5 * (ceiling - floor) - moves);
  };
  for (std::size_t i = 0; i < n; ++i) {
    const double from = ray.first + static_cast<double>(i) * h;
    const auto [middle, half] = at(from, 0, 0);
    room.middle.values.push_back(middle);
    room.value.push_back(half);
    room.enough &= half > 0;
    auto& around = room.middle.around.emplace_back();
    Vec3& differences = room.differences.emplace_back();
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t k = 0; k < 2; ++k) {
        const auto [beside, reach] = at(from, a, k == 0 ? -0.5 : 0.5);
        around[a][k] = beside;
        differences[a] += reach;
        room.enough &= reach > 0;
      }
  }
  return room;
}

/// Head light, that and two others, and one that stands still.
inline void set_lights(RenderOptions& o, int kind) {
  o.shading = true;
  o.gradient = GradientKind::central;
  o.head_light = kind < 2;
  o.lights.clear();
  if (kind > 0) o.lights.push_back({1, -2, 0.5});
  if (kind == 1) o.lights.push_back({-0.3, 0.2, -1});
}

/// What lies half a base cell and a hair within the cube, where differences are known.
inline Clip inner_clip(const Grid& g) {
  Clip clip;
  for (std::size_t a = 0; a < 3; ++a) {
    clip.low[a] = g.origin[a] + 0.5 + 0x1p-20;
    clip.high[a] = g.origin[a] + static_cast<double>(g.cells[a]) - 0.5 - 0x1p-20;
  }
  return clip;
}

}  // namespace vdvr::support
