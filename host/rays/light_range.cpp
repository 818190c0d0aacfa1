#include "host/rays/light_range.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vec3& a) { return std::hypot(a[0], a[1], a[2]); }
Vec3 scaled(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double to_the_24th(double x) { return std::pow(x, 24); }

// Where light and eye stand opposite there is no direction half-way, and no light either.
constexpr double no_half_way = 1e-6;

}  // namespace

std::pair<double, double> lit_colours(double low, double high, const LightRange& light) {
  double least = INFINITY, most = -INFINITY;
  // Linear in the colour, in the strength and in the diffuse light, each by itself: extremes lie at corners.
  for (const double c : {low, high})
    for (const double strength : {light.least.strength, light.most.strength})
      for (const double diffuse : {light.least.diffuse, light.most.diffuse}) {
        least = std::min(least, lit_colour(c, strength, diffuse, light.least.highlight));
        most = std::max(most, lit_colour(c, strength, diffuse, light.most.highlight));
      }
  return {least, most};
}

// Directions within `wide` of that of `middle`.
struct Lights::Cone {
  Vec3 middle{};
  double wide = pi;
  /// Cosines to a direction of unit length.
  [[nodiscard]] std::pair<double, double> cosines(const Vec3& to) const {
    if (!(wide < pi)) return {-1, 1};
    const Vec3 across{middle[1] * to[2] - middle[2] * to[1], middle[2] * to[0] - middle[0] * to[2],
                      middle[0] * to[1] - middle[1] * to[0]};
    const double angle = std::atan2(length(across), dot(middle, to));
    return {std::cos(std::min(angle + wide, pi)), std::cos(std::max(angle - wide, 0.0))};
  }
};

Lights::Lights(const RenderOptions& options, double gradient_full)
    : head_(options.head_light), full_(gradient_full) {
  for (const Vec3& l : options.lights) lights_.push_back(scaled(l, 1 / length(l)));
  share_ = 0.75 / std::max<double>(1, static_cast<double>(lights_.size()) + (head_ ? 1 : 0));
}

Light Lights::at(const Vec3& gradient, const Vec3& view) const {
  const double magnitude = length(gradient);
  if (!(magnitude > 0)) return {};
  Light light{full_ > 0 ? std::min(magnitude / full_, 1.0) : 1, 0, 0};
  const double along = dot(gradient, view);
  const Vec3 normal = scaled(gradient, (along > 0 ? -1 : 1) / magnitude);
  if (head_) {
    const double facing = std::min(std::abs(along) / magnitude, 1.0);
    light.diffuse = facing;
    light.highlight = to_the_24th(facing);
  }
  for (const Vec3& l : lights_) {
    const double cosine = dot(normal, l);
    if (!(cosine > 0)) continue;
    light.diffuse += cosine;
    const Vec3 half_way = minus(l, view);
    if (length(half_way) > no_half_way)
      light.highlight += to_the_24th(std::max(dot(normal, half_way) / length(half_way), 0.0));
  }
  light.diffuse *= share_;
  return light;
}

LightRange Lights::any() const {
  return {{0, 0, 0}, {1, 0.75, static_cast<double>(lights_.size()) + (head_ ? 1 : 0)}};
}

// The sums of all lights on normals that are `side` times the cone's directions.
void Lights::add(const Cone& cone, const Vec3& view, double side, Light& least, Light& most) const {
  const auto cosines = [&](const Vec3& to) {
    const auto [low, high] = cone.cosines(to);
    return side > 0 ? std::pair(low, high) : std::pair(-high, -low);
  };
  Light low, high;
  if (head_) {
    const auto [away, towards] = cosines(view);  // a normal faces the eye against the ray
    low.diffuse = std::clamp(-towards, 0.0, 1.0);
    high.diffuse = std::clamp(-away, 0.0, 1.0);
    low.highlight = to_the_24th(low.diffuse);
    high.highlight = to_the_24th(high.diffuse);
  }
  for (const Vec3& l : lights_) {
    const auto [from, to] = cosines(l);
    low.diffuse += std::max(from, 0.0);
    high.diffuse += std::max(to, 0.0);
    const Vec3 half_way = minus(l, view);
    const double norm = length(half_way);
    const auto [away, towards] =
        norm > no_half_way ? cosines(scaled(half_way, 1 / norm)) : std::pair(-1.0, 1.0);
    if (from > 0) low.highlight += to_the_24th(std::max(away, 0.0));
    if (to > 0) high.highlight += to_the_24th(std::max(towards, 0.0));
  }
  least.diffuse = std::min(least.diffuse, low.diffuse * share_);
  most.diffuse = std::max(most.diffuse, high.diffuse * share_);
  least.highlight = std::min(least.highlight, low.highlight);
  most.highlight = std::max(most.highlight, high.highlight);
}

LightRange Lights::over(const GradientBox& g, const Vec3& view) const {
  Vec3 middle{}, nearest{}, farthest{}, half{};
  double along_low = 0, along_high = 0, largest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!std::isfinite(g.low[a]) || !std::isfinite(g.high[a])) return any();
    middle[a] = 0.5 * (g.low[a] + g.high[a]);
    half[a] = 0.5 * (g.high[a] - g.low[a]);
    nearest[a] = std::max({0.0, g.low[a], -g.high[a]});
    farthest[a] = std::max(std::abs(g.low[a]), std::abs(g.high[a]));
    along_low += view[a] * (view[a] > 0 ? g.low[a] : g.high[a]);
    along_high += view[a] * (view[a] > 0 ? g.high[a] : g.low[a]);
    largest = std::max(largest, farthest[a]);
  }
  const auto strength = [&](double magnitude) {
    return full_ > 0 ? std::min(magnitude / full_, 1.0) : magnitude > 0 ? 1.0 : 0.0;
  };
  LightRange range{{strength(length(nearest)), INFINITY, INFINITY},
                   {strength(length(farthest)), -INFINITY, -INFINITY}};
  Cone cone{middle, pi};
  // All directions of the ball around the box. Near a right angle asin makes of 8 roundings the root of 16.
  const double share = length(half) / length(middle);
  if (share < 1) cone.wide = std::asin(share) + 0x1p-24;
  // Either side of a surface may show, as far as rounding tells.
  const double rounding = 0x1p-48 * largest;
  if (!(along_low > rounding)) add(cone, view, 1, range.least, range.most);
  if (!(along_high <= -rounding)) add(cone, view, -1, range.least, range.most);
  return range;
}

}  // namespace vdvr
