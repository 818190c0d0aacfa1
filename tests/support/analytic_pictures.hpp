// Fields whose F is known everywhere, volumes that sample it at mixed levels, and bounds of |V - F| in every
// brick that are proved: what certified pictures are held to (docs/pixel-bounds.md, "Tests").
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "host/volume/brick_layout.hpp"
#include "tests/reference/ideal_picture.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr::support {

/// F on a cube of `cells` cells, places in cells from its corner.
struct AnalyticField {
  std::string name;
  std::int64_t cells = 0;
  std::function<double(double, double, double)> at;
  double slope = 0;                   ///< of its gradient's length, at most, per cell
  std::array<double, 3> curvature{};  ///< of |F_xx|, |F_yy|, |F_zz|, at most
  /// F is across(x, y) + along(z) where these are set, and the worst of a brick is the sum of two.
  std::function<double(double, double)> across;
  std::function<double(double)> along;
};

/// Marschner and Lobb's signal on [-1, 1]^3: `waves` across, depth 1/4.
inline AnalyticField marschner_lobb(std::int64_t cells, double waves) {
  constexpr double pi = std::numbers::pi, depth = 0.25, norm = 2 * (1 + depth);
  const double half = 0.5 * static_cast<double>(cells);
  AnalyticField f{"marschner-lobb", cells, {}, 0, {}, {}, {}};
  f.across = [=](double x, double y) {
    const double r = std::hypot(x / half - 1, y / half - 1);
    return depth * (1 + std::cos(2 * pi * waves * std::cos(pi * r / 2))) / norm;
  };
  f.along = [=](double z) { return (1 - std::sin(pi * (z / half - 1) / 2)) / norm; };
  f.at = [across = f.across, along = f.along](double x, double y, double z) {
    return across(x, y) + along(z);
  };
  // With u = 2 pi waves cos(pi r / 2): |u'| <= pi^2 waves, |u'' | and |u' / r| <= pi^3 waves / 2, and u'^2
  // and u'' are largest where the other is 0.
  const double steep = pi * pi * waves, turns = pi * pi * pi * waves / 2;
  f.slope = std::hypot(pi / 2, depth * steep) / norm / half;
  const double across = depth * (steep * steep + turns) / norm / (half * half);
  f.curvature = {across, across, pi * pi / 4 / norm / (half * half)};
  return f;
}

/// Soft balls, of which some touch.
inline AnalyticField blobs(std::int64_t cells) {
  struct Ball {
    double x, y, z, radius, height;
  };
  // Of the cube's side.
  static const std::array<Ball, 6> balls{{{0.35, 0.40, 0.45, 0.14, 0.55},
                                          {0.62, 0.36, 0.55, 0.11, 0.60},
                                          {0.55, 0.66, 0.40, 0.13, 0.45},
                                          {0.40, 0.62, 0.68, 0.10, 0.50},
                                          {0.70, 0.62, 0.66, 0.09, 0.35},
                                          {0.48, 0.48, 0.28, 0.10, 0.40}}};
  const auto side = static_cast<double>(cells);
  AnalyticField f{"blobs", cells, {}, 0, {}, {}, {}};
  f.at = [side](double x, double y, double z) {
    double sum = 0;
    for (const Ball& b : balls) {
      const double dx = x / side - b.x, dy = y / side - b.y, dz = z / side - b.z;
      sum += b.height * std::exp(-(dx * dx + dy * dy + dz * dz) / (2 * b.radius * b.radius));
    }
    return sum;
  };
  // A ball's slope is at most height / radius e^(-1/2), its curvature along an axis height / radius^2.
  for (const Ball& b : balls) {
    f.slope += b.height / (b.radius * side) * std::exp(-0.5);
    for (double& c : f.curvature) c += b.height / (b.radius * b.radius * side * side);
  }
  return f;
}

/// Whether `f` can have met the value in [first, last], at whose end it is surely on one side: it comes as
/// near to the other as it moves between two places of so many, `slope` being its largest.
template <class Field>
bool passes(const Field& f, double first, double last, double value, double step, double slope) {
  const double sign = f(last) < value ? 1 : -1;
  double other = sign * (f(last) - value);
  for (double t = first; t < last; t += step) other = std::max(other, sign * (f(t) - value));
  return other >= -slope * step / 2 * (1 + 0x1p-20);
}

/// On the centred grid of spacing 1.
inline MixedVolume volume_of(const AnalyticField& f, const std::vector<LevelTriple>& levels, unsigned seed,
                             const LevelTriple& coarsening = {}) {
  return sampled_mixed(fields::centred_grid({f.cells, f.cells, f.cells}), 4, 8, levels, seed, f.at,
                       coarsening);
}

/// Least and largest V - F.
struct Spread {
  double least = 0, most = 0;
  void take(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
  }
};

/// Of a part of F that depends on one coordinate, over [from, from + width], sampled every `spacing` cells.
inline Spread spread_along(const std::function<double(double)>& f, double from, double width, double spacing,
                           int sub) {
  Spread s;
  const int n = static_cast<int>(std::lround(width / spacing));
  for (int i = 0; i < n; ++i) {
    const double low = from + i * spacing, a = f(low), b = f(low + spacing);
    for (int k = 0; k <= sub; ++k) {
      const double t = static_cast<double>(k) / sub;
      s.take(a + t * (b - a) - f(low + t * spacing));
    }
  }
  return s;
}
inline Spread spread_across(const std::function<double(double, double)>& f, const std::array<double, 2>& from,
                            double width, const std::array<double, 2>& spacing, int sub) {
  Spread s;
  const int nx = static_cast<int>(std::lround(width / spacing[0])),
            ny = static_cast<int>(std::lround(width / spacing[1]));
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const double x = from[0] + i * spacing[0], y = from[1] + j * spacing[1];
      const double a = f(x, y), b = f(x + spacing[0], y), c = f(x, y + spacing[1]),
                   d = f(x + spacing[0], y + spacing[1]);
      for (int l = 0; l <= sub; ++l)
        for (int k = 0; k <= sub; ++k) {
          const double t = static_cast<double>(k) / sub, q = static_cast<double>(l) / sub;
          s.take((1 - q) * (a + t * (b - a)) + q * (c + t * (d - c)) -
                 f(x + t * spacing[0], y + q * spacing[1]));
        }
    }
  return s;
}

/// By brick: |V - F| at nodes `sub` to a sample and axis, and what F's curvature can add between them, where
/// V is trilinear. `more`: what storing the samples rounded them by. Values lie within [-2, 2]: samples and
/// the sampler round by 2^-19 at most (docs/error-bounds.md, section 7: 14 u M).
inline std::vector<float> proved_bounds(const AnalyticField& f, const MixedVolume& v, double more, int sub) {
  constexpr double fp32 = 0x1p-19;
  const Index3 n = v.bricks();
  const auto width = static_cast<double>(v.granularity);
  std::vector<float> bounds;
  std::map<std::array<std::int64_t, 4>, Spread> across;
  std::map<std::array<std::int64_t, 2>, Spread> along;
  for (std::int64_t i = 0; i < v.brick_count(); ++i) {
    const Index3 brick{i % n[0], i / n[0] % n[1], i / (n[0] * n[1])};
    const LevelTriple l = v.level[static_cast<std::size_t>(i)];
    std::array<double, 3> spacing{}, low{};
    double between = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      spacing[a] = std::ldexp(1.0, v.coarsening[2 - a] - l[2 - a]);
      low[a] = width * static_cast<double>(brick[a]);
      between += f.curvature[a] * spacing[a] * spacing[a] / (8.0 * sub * sub);
    }
    double most = 0;
    if (f.across) {
      const auto [xy, new_xy] = across.try_emplace({brick[0], brick[1], l[1], l[2]});
      if (new_xy)
        xy->second = spread_across(f.across, {low[0], low[1]}, width, {spacing[0], spacing[1]}, sub);
      const auto [z, new_z] = along.try_emplace({brick[2], l[0]});
      if (new_z) z->second = spread_along(f.along, low[2], width, spacing[2], sub);
      most = std::max(xy->second.most + z->second.most, -(xy->second.least + z->second.least));
    } else {
      const BrickSamples samples(v, brick);
      std::array<int, 3> count{};
      for (std::size_t a = 0; a < 3; ++a) count[a] = static_cast<int>(std::lround(width / spacing[a])) * sub;
      for (int z = 0; z <= count[2]; ++z)
        for (int y = 0; y <= count[1]; ++y)
          for (int x = 0; x <= count[0]; ++x) {
            const std::array<double, 3> c{low[0] + width * x / count[0], low[1] + width * y / count[1],
                                          low[2] + width * z / count[2]};
            const auto value = static_cast<double>(
                samples.at(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])));
            most = std::max(most, std::abs(value - f.at(c[0], c[1], c[2])));
          }
    }
    bounds.push_back(static_cast<float>((most + between + more + fp32) * (1 + 0x1p-20)));
  }
  return bounds;
}

/// The middles of equal steps of a ray, and the field there.
struct FieldOnRay {
  double length = 0;  ///< of a step, base cells
  std::vector<double> values;
};
inline FieldOnRay along_ray(const std::function<double(const Vec3&)>& f, const reference::IdealRay& ray,
                            double step) {
  FieldOnRay out;
  if (!(ray.first < ray.last)) return out;
  const auto n = static_cast<std::size_t>(std::ceil((ray.last - ray.first) / step));
  out.length = (ray.last - ray.first) / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i)
    out.values.push_back(f(ray.at(ray.first + (static_cast<double>(i) + 0.5) * out.length)));
  return out;
}

/// Emission and absorption over the field that is constant on each step. Ends where 2^-40 is left.
inline reference::Rgb3 colour_of(const FieldOnRay& field, const std::vector<TransferPoint>& points,
                                 const reference::Rgb3& background) {
  reference::Rgb3 seen{};
  double passes = 1;
  for (const double value : field.values) {
    if (value <= points.front().value && points.front().opacity == 0 && points[1].value > points[0].value)
      continue;
    const TransferPoint p = reference::shown_at(points, value);
    if (p.opacity == 0) continue;
    const double through = std::exp(-reference::extinction(p.opacity) * field.length);
    for (std::size_t c = 0; c < 3; ++c) seen[c] += passes * (1 - through) * p.rgb[c];
    passes *= through;
    if (passes < 0x1p-40) break;
  }
  for (std::size_t c = 0; c < 3; ++c) seen[c] += passes * background[c];
  return seen;
}

/// What a picture may show of fields within the bounds, channel by channel, as far as an adversary finds: at
/// every step, back to front, the value of the bounds' interval that shows most or least before what lies
/// behind. `v` and `e`: V and its bound in the middles of steps. No step is too long for that: the sum is of
/// a field that is within the bounds there.
inline double adversary_of(const FieldOnRay& v, const std::vector<double>& e,
                           const std::vector<TransferPoint>& points, const reference::Rgb3& background,
                           std::size_t c, bool up) {
  double behind = background[c];
  for (std::size_t i = v.values.size(); i-- > 0;) {
    double best = behind, gain = 0;
    const auto attempt = [&](const TransferPoint& p) {
      const double seen =
          p.rgb[c] + (behind - p.rgb[c]) * std::exp(-reference::extinction(p.opacity) * v.length);
      const double more = up ? seen - behind : behind - seen;
      if (!(more > gain)) return;
      gain = more;
      best = seen;
    };
    // Something must stand there: also what takes least.
    constexpr int parts = 8;
    const double low = v.values[i] - e[i], high = v.values[i] + e[i];
    gain = -INFINITY;
    for (int k = 0; k <= parts; ++k) attempt(reference::shown_at(points, low + (high - low) * k / parts));
    for (const TransferPoint& p : points)
      if (p.value >= low && p.value <= high) attempt(p);
    behind = best;
  }
  return behind;
}

/// Soft to jumping: presets, and a jump at the middle.
inline std::vector<TransferFunction> table_transfers() {
  std::vector<TransferFunction> all;
  for (const char* name : {"soft", "grey", "default", "bone", "marschner-lobb", "iso"})
    all.push_back(transfer_preset(name, 0, 1));
  all.push_back({"jump",
                 {{0, {0.3, 0.5, 0.8}, 0},
                  {0.5, {0.3, 0.5, 0.8}, 0},
                  {0.5, {0.9, 0.7, 0.3}, 0.8},
                  {1, {0.9, 0.7, 0.3}, 0.8}}});
  return all;
}

}  // namespace vdvr::support
