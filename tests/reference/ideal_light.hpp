// The renderer's light by its definition (docs/rendering.md), in double precision: what a colour looks like
// where a field has a gradient. Nothing here knows of kernels or of intervals.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/reference/ideal_picture.hpp"

namespace vdvr::reference {

struct IdealLight {
  double factor = 1, highlight = 0;
  [[nodiscard]] double on(double colour) const { return colour * factor + highlight; }
};

/// `view`: along the ray. `full`: the length of a gradient from which on light does not fade.
inline IdealLight light_on(const Vec3& gradient, const Vec3& view, const RenderOptions& o, double full) {
  const auto dot = [](const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const double length = std::sqrt(dot(gradient, gradient));
  if (!(length > 0)) return {};
  Vec3 normal{};
  const double side = dot(gradient, view) > 0 ? -1 : 1;
  for (std::size_t a = 0; a < 3; ++a) normal[a] = side * gradient[a] / length;
  double diffuse = 0, shine = 0;
  const auto add = [&](double cosine, double aligned) {
    diffuse += std::max(cosine, 0.0);
    if (cosine > 0) shine += std::pow(std::max(aligned, 0.0), 24);
  };
  if (o.head_light) add(-dot(normal, view), -dot(normal, view));
  for (const Vec3& given : o.lights) {
    const double norm = std::sqrt(dot(given, given));
    Vec3 l{}, middle{};
    for (std::size_t a = 0; a < 3; ++a) {
      l[a] = given[a] / norm;
      middle[a] = l[a] - view[a];
    }
    add(dot(normal, l), dot(normal, middle) / std::max(std::sqrt(dot(middle, middle)), 1e-6));
  }
  const double lights = static_cast<double>(o.lights.size()) + (o.head_light ? 1 : 0),
               strength = std::min(length / full, 1.0);
  return {1 + strength * (0.25 + 0.75 * diffuse / lights - 1), 0.2 * strength * shine};
}

}  // namespace vdvr::reference
