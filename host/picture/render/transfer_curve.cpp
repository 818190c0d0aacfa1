#include "host/picture/render/transfer_curve.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace vdvr {
namespace {

// Pieces of a bent segment: 8-bit colours along one differ by less than a step from its chords.
constexpr int kBends = 32;
// Below it VTK takes a piece as straight.
constexpr double kStraight = 0.01;
// Above it VTK takes a piece of colour as a step.
constexpr double kStep = 0.99;

/// What f in [0, 1] becomes under midpoint and sharpness, before the cubic: VTK's definition.
double bent(double f, double midpoint, double sharpness) {
  const double m = std::clamp(midpoint, 1e-5, 1 - 1e-5);
  f = f < m ? 0.5 * f / m : 0.5 + 0.5 * (f - m) / (1 - m);
  if (sharpness < kStraight) return f;
  const double power = 1 + 10 * sharpness;
  return f < 0.5 ? 0.5 * std::pow(2 * f, power) : 1 - 0.5 * std::pow(2 * (1 - f), power);
}

/// The cubic from a to b whose slope at both ends is (1 - sharpness) of the chord's; never outside [a, b].
double cubic(double a, double b, double f, double sharpness) {
  const double slope = (1 - sharpness) * (b - a), f2 = f * f, f3 = f2 * f;
  const double y =
      (2 * f3 - 3 * f2 + 1) * a + (3 * f2 - 2 * f3) * b + (f3 - 2 * f2 + f) * slope + (f3 - f2) * slope;
  return std::clamp(y, std::min(a, b), std::max(a, b));
}

double between(const CurveNode<double>& a, const CurveNode<double>& b, double f, ColourSpace) {
  f = bent(f, a.midpoint, a.sharpness);
  return a.sharpness < kStraight ? (1 - f) * a.y + f * b.y : cubic(a.y, b.y, f, a.sharpness);
}

Rgb between(const CurveNode<Rgb>& a, const CurveNode<Rgb>& b, double f, ColourSpace space) {
  const double at = bent(f, a.midpoint, a.sharpness);
  if (a.sharpness < kStraight || space == ColourSpace::step || space == ColourSpace::diverging)
    return mix(space, a.y, b.y, at);
  const Rgb from = to_space(space, a.y), to = to_space(space, b.y);
  Rgb c{};
  for (std::size_t i = 0; i < 3; ++i) c[i] = cubic(from[i], to[i], at, a.sharpness);
  return from_space(space, c);
}

template <class Value>
struct Vertex {
  double x = 0;
  Value y{};
};

/// Where straight pieces between two nodes end, as parts of the distance.
template <class Value>
std::vector<double> breaks(const CurveNode<Value>& node, bool straight_space) {
  std::vector<double> out;
  if (straight_space && node.sharpness < kStraight) {
    if (node.midpoint > 0 && node.midpoint < 1 && node.midpoint != 0.5) out.push_back(node.midpoint);
    return out;
  }
  for (int i = 1; i < kBends; ++i) out.push_back(static_cast<double>(i) / kBends);
  return out;
}

/// The curve as vertices of straight pieces.
template <class Value>
std::vector<Vertex<Value>> flattened(const std::vector<CurveNode<Value>>& nodes, ColourSpace space) {
  std::vector<Vertex<Value>> out;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    out.push_back({nodes[i].x, nodes[i].y});
    if (i + 1 == nodes.size() || !(nodes[i + 1].x > nodes[i].x)) continue;
    const auto &a = nodes[i], &b = nodes[i + 1];
    if (space == ColourSpace::step) {
      out.push_back({a.x, b.y});
      continue;
    }
    // VTK's colours jump at the midpoint of the sharpest pieces; its opacities stay continuous.
    if (std::is_same_v<Value, Rgb> && a.sharpness > kStep) {
      const double x = (1 - a.midpoint) * a.x + a.midpoint * b.x;
      out.push_back({x, a.y});
      out.push_back({x, b.y});
      continue;
    }
    for (const double f : breaks(a, space == ColourSpace::rgb))
      out.push_back({(1 - f) * a.x + f * b.x, between(a, b, f, space)});
  }
  return out;
}

/// The curve at x as reached from below (`above` false) or from above.
template <class Value>
Value value_at(const std::vector<Vertex<Value>>& curve, double x, bool above) {
  const auto first =
      std::lower_bound(curve.begin(), curve.end(), x, [](const auto& v, double at) { return v.x < at; });
  const auto last =
      std::upper_bound(curve.begin(), curve.end(), x, [](double at, const auto& v) { return at < v.x; });
  if (first != last) return above ? std::prev(last)->y : first->y;
  if (first == curve.begin()) return first->y;
  if (first == curve.end()) return curve.back().y;
  const auto &a = *std::prev(first), &b = *first;
  const double f = (x - a.x) / (b.x - a.x);
  if constexpr (std::is_same_v<Value, double>) {
    return (1 - f) * a.y + f * b.y;
  } else {
    Value c{};
    for (std::size_t i = 0; i < c.size(); ++i) c[i] = (1 - f) * a.y[i] + f * b.y[i];
    return c;
  }
}

}  // namespace

std::vector<TransferPoint> joined(const ColourNodes& colours, const OpacityNodes& opacities,
                                  ColourSpace space) {
  const auto colour = flattened(colours, space);
  const auto opacity = flattened(opacities, ColourSpace::rgb);
  std::vector<double> xs;
  for (const auto& v : colour) xs.push_back(v.x);
  for (const auto& v : opacity) xs.push_back(v.x);
  std::sort(xs.begin(), xs.end());
  xs.erase(std::unique(xs.begin(), xs.end()), xs.end());
  std::vector<TransferPoint> out;
  for (const double x : xs) {
    const TransferPoint below{x, value_at(colour, x, false), value_at(opacity, x, false)};
    const TransferPoint above{x, value_at(colour, x, true), value_at(opacity, x, true)};
    out.push_back(below);
    if (below.rgb != above.rgb || below.opacity != above.opacity) out.push_back(above);
  }
  return out;
}

}  // namespace vdvr
