#include "host/picture/rays/light_range.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/scan/geometry/vectors.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

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

// The directions of a box of gradients.
struct Lights::Directions {
  GradientBox box;
  std::array<Vec3, 8> corner{};
  Vec3 middle{};
  double wide = pi;                 ///< no direction lies farther from that of the middle
  double nearest = 0, largest = 0;  ///< of lengths, and of coordinates

  explicit Directions(const GradientBox& g);
  /// Least and largest cosine to a direction of unit length.
  [[nodiscard]] std::pair<double, double> cosines(const Vec3& to) const;

 private:
  [[nodiscard]] std::pair<double, double> on_one_side(const Vec3& to, const std::array<double, 8>& along,
                                                      double side) const;
  [[nodiscard]] bool holds_multiple_of(const Vec3& to, double side) const;
};

Lights::Directions::Directions(const GradientBox& g) : box(g) {
  Vec3 half{}, least{};
  for (std::size_t a = 0; a < 3; ++a) {
    middle[a] = 0.5 * (g.low[a] + g.high[a]);
    half[a] = 0.5 * (g.high[a] - g.low[a]);
    least[a] = std::max({0.0, g.low[a], -g.high[a]});
    largest = std::max({largest, std::abs(g.low[a]), std::abs(g.high[a])});
    for (std::size_t i = 0; i < 8; ++i) corner[i][a] = (i >> a & 1) == 0 ? g.low[a] : g.high[a];
  }
  nearest = length(least);
  // Of the ball around the box. Near a right angle asin makes of 8 roundings the root of 16.
  const double share = length(half) / length(middle);
  if (share < 1) wide = std::asin(share) + 0x1p-24;
}

std::pair<double, double> Lights::Directions::cosines(const Vec3& to) const {
  std::array<double, 8> along{};
  for (std::size_t i = 0; i < 8; ++i) along[i] = dot(corner[i], to);
  const auto [low, high] = std::minmax_element(along.begin(), along.end());
  // Far enough from a right angle for what follows to round by 2^-42 at most.
  if (*low > largest / 64) return on_one_side(to, along, 1);
  if (*high < -largest / 64) return on_one_side(to, along, -1);
  std::pair<double, double> range{-1, 1};
  if (nearest > 0)
    range = {std::max(-1.0, std::min(0.0, *low - 0x1p-40 * largest) / nearest),
             std::min(1.0, std::max(0.0, *high + 0x1p-40 * largest) / nearest)};
  if (!(wide < pi)) return range;
  const Vec3 across{middle[1] * to[2] - middle[2] * to[1], middle[2] * to[0] - middle[0] * to[2],
                    middle[0] * to[1] - middle[1] * to[0]};
  const double angle = std::atan2(length(across), dot(middle, to));
  return {std::max(range.first, std::cos(std::min(angle + wide, pi))),
          std::min(range.second, std::cos(std::max(angle - wide, 0.0)))};
}

// Exact. Seen from the origin the box is a polygon of the plane at distance 1 along `to`: its farthest point
// from the plane's foot is a corner, and unless it holds the foot its nearest lies on an edge, of which the
// box's own are more.
std::pair<double, double> Lights::Directions::on_one_side(const Vec3& to, const std::array<double, 8>& along,
                                                          double side) const {
  constexpr double rounding = 0x1p-40;
  std::array<Vec3, 8> q;
  double farthest = 0, near = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t a = 0; a < 3; ++a) q[i][a] = corner[i][a] / along[i] - to[a];
    farthest = std::max(farthest, dot(q[i], q[i]));
  }
  if (holds_multiple_of(to, side)) near = 0;
  for (std::size_t i = 0; i < 8 && near > 0; ++i)
    for (std::size_t bit = 1; bit < 8; bit *= 2) {
      if ((i & bit) != 0) continue;
      const Vec3 edge = minus(q[i | bit], q[i]);
      const double edge2 = dot(edge, edge),
                   t = edge2 > 0 ? std::clamp(-dot(q[i], edge) / edge2, 0.0, 1.0) : 0;
      const Vec3 at{q[i][0] + t * edge[0], q[i][1] + t * edge[1], q[i][2] + t * edge[2]};
      near = std::min(near, dot(at, at));
    }
  const double least = 1 / std::sqrt(1 + farthest) - rounding,
               most = std::min(1.0, 1 / std::sqrt(1 + near) + rounding);
  return side > 0 ? std::pair(least, most) : std::pair(-most, -least);
}

bool Lights::Directions::holds_multiple_of(const Vec3& to, double side) const {
  double from = 0, end = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    const double d = side * to[a];
    if (d == 0) {
      if (box.low[a] > 0 || box.high[a] < 0) return false;
      continue;
    }
    from = std::max(from, std::min(box.low[a] / d, box.high[a] / d));
    end = std::min(end, std::max(box.low[a] / d, box.high[a] / d));
  }
  return from <= end;
}

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

// The sums of all lights on normals that are `side` times the directions.
void Lights::add(const Directions& directions, const Vec3& view, double side, Light& least,
                 Light& most) const {
  const auto cosines = [&](const Vec3& to) {
    const auto [low, high] = directions.cosines(to);
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
  Vec3 farthest{};
  double along_low = 0, along_high = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!std::isfinite(g.low[a]) || !std::isfinite(g.high[a])) return any();
    farthest[a] = std::max(std::abs(g.low[a]), std::abs(g.high[a]));
    along_low += view[a] * (view[a] > 0 ? g.low[a] : g.high[a]);
    along_high += view[a] * (view[a] > 0 ? g.high[a] : g.low[a]);
  }
  const Directions directions(g);
  const auto strength = [&](double magnitude) {
    return full_ > 0 ? std::min(magnitude / full_, 1.0) : magnitude > 0 ? 1.0 : 0.0;
  };
  LightRange range{{strength(directions.nearest), INFINITY, INFINITY},
                   {strength(length(farthest)), -INFINITY, -INFINITY}};
  // Either side of a surface may show, as far as rounding tells.
  const double rounding = 0x1p-48 * directions.largest;
  if (!(along_low > rounding)) add(directions, view, 1, range.least, range.most);
  if (!(along_high <= -rounding)) add(directions, view, -1, range.least, range.most);
  return range;
}

}  // namespace vdvr
