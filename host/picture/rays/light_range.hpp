// What light and highlight a gradient that is known to lie in a box can give: the renderer's own formula
// (kernels/device/shade.h) over intervals, in double precision (docs/pixel-bounds.md, section 7).
#pragma once

#include <utility>
#include <vector>

#include "vdvr/raycast.hpp"

namespace vdvr {

/// A colour c is seen as c (1 + strength (diffuse - 3/4)) + strength highlight / 5.
struct Light {
  double strength = 0, diffuse = 0, highlight = 0;
};
struct LightRange {
  Light least, most;  ///< each number by itself
};
inline double lit_colour(double c, double strength, double diffuse, double highlight) {
  return c * (1 + strength * (diffuse - 0.75)) + 0.2 * strength * highlight;
}
/// Of all colours in [low, high] under all light of the range: {least, most}.
std::pair<double, double> lit_colours(double low, double high, const LightRange& light);

/// A box of gradients, per length along the world axes.
struct GradientBox {
  Vec3 low{}, high{};
};

/// From which on a point is fully shaded: what the renderer takes (raycast_params.cpp), to the bit.
inline double full_gradient(const std::pair<float, float>& value_range) {
  return static_cast<double>((value_range.second - value_range.first) / 32);
}

class Lights {
 public:
  /// `gradient_full`: from which on a point is fully shaded.
  Lights(const RenderOptions& options, double gradient_full);
  /// `view`: the unit direction of the ray.
  [[nodiscard]] Light at(const Vec3& gradient, const Vec3& view) const;
  [[nodiscard]] LightRange over(const GradientBox& gradients, const Vec3& view) const;
  /// Of whatever gradient.
  [[nodiscard]] LightRange any() const;

 private:
  struct Directions;
  void add(const Directions& directions, const Vec3& view, double side, Light& least, Light& most) const;

  std::vector<Vec3> lights_;
  bool head_;
  double full_, share_;
};

}  // namespace vdvr
