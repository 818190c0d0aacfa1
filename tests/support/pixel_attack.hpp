// An attack on intervals of pixels: fields f along each ray that keep the brick's bounds, random, at either
// end and chosen against each channel, whose pictures must lie in the intervals.
#pragma once

#include <cstdlib>
#include <random>

#include "tests/reference/ideal_picture.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr::support {

/// Where rays enter and leave in fp32: the clip as much smaller as its definition says
/// (include/vdvr/raycast.hpp, kernels/device/raycast_dvr.h), since the ideal picture is of what is left.
inline RenderOptions as_entered(RenderOptions o, const Grid& g) {
  if (!o.clip) return o;
  Clip& c = *o.clip;
  double around = 1;
  for (std::size_t a = 0; a < 2; ++a)
    around += (std::abs(o.camera.position[a] - c.axis[a]) + std::abs(c.axis[a] - g.origin[a])) / c.radius;
  c.radius *= std::sqrt(1 - 0x1p-18 * around);
  const double eye_z = std::abs(o.camera.position[2] - g.origin[2]) / g.spacing[2];
  const double inward = 0x1p-20 * (2 * eye_z + static_cast<double>(g.cells[2])) * g.spacing[2];
  c.low[2] += inward;
  c.high[2] -= inward;
  return o;
}

/// Steps of a ray within one cell of the base, and what f may be on them.
struct AttackStep {
  double length = 0;  ///< base cells
  double lo = 0, hi = 0;
};

/// A step's f is constant and the field moves on it: what f may be is so much narrower, and then holds at
/// every point of the step. Where that leaves less than a quarter of the bound the step is halved. Steps end
/// at the faces of cells of the finest level. `bounds` infinite: anything from -1 to 2.
inline std::vector<AttackStep> steps_of(const MixedVolume& v, const std::vector<float>& bounds,
                                        const RenderOptions& o, std::int64_t px, std::int64_t py,
                                        int steps_a_cell) {
  const reference::IdealRay ray = reference::ideal_ray(o, v.grid, px, py);
  std::vector<AttackStep> steps;
  if (!(ray.first < ray.last)) return steps;
  std::vector<double> cuts{ray.first, ray.last};
  for (std::size_t a = 0; a < 3; ++a)
    for (std::int64_t i = 0; i <= v.rate * v.grid.cells[a]; ++i) {
      const double t =
          (v.grid.origin[a] + static_cast<double>(i) * v.grid.spacing[a] / v.rate - ray.from[a]) /
          ray.direction[a];
      if (t > ray.first && t < ray.last) cuts.push_back(t);
    }
  std::sort(cuts.begin(), cuts.end());
  const double unit = *std::min_element(v.grid.spacing.begin(), v.grid.spacing.end());
  const Index3 n = v.bricks();
  const auto add = [&](const auto& self, double from, double h, double e) -> void {
    if (!std::isfinite(e)) {
      steps.push_back({h / unit, -1, 2});
      return;
    }
    const auto value = [&](double part) {
      return static_cast<double>(sample_at(v, ray.at(from + part * h)));
    };
    const double at = value(0.5);
    // Just inside the ends, which may be faces where the field jumps. A cubic; and fp32 of place and samples.
    double moves = 0;
    for (const double part : {1.0 / 64, 0.25, 0.75, 63.0 / 64})
      moves = std::max(moves, std::abs(value(part) - at));
    moves = 1.25 * moves + 1e-5;
    const double room = e - moves;
    if (room > e / 4) {
      steps.push_back({h / unit, at - room, at + room});
      return;
    }
    self(self, from, h / 2, e);
    self(self, from + h / 2, h / 2, e);
  };
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double whole = cuts[i + 1] - cuts[i];
    // Two faces at one place, as near as doubles tell.
    if (!(whole > 1e-12 * unit)) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil(whole / unit * steps_a_cell)));
    const Index3 b = brick_at(v, ray.at(cuts[i] + whole / 2));
    const auto e = static_cast<double>(bounds[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])]);
    for (int k = 0; k < parts; ++k) add(add, cuts[i] + k * whole / parts, whole / parts, e);
  }
  return steps;
}

/// Back to front, each step with the value that `choose(step, behind)` names.
template <class Choose>
reference::Rgb3 picture_of(const std::vector<AttackStep>& steps, const reference::Rgb3& background,
                           Choose&& choose) {
  reference::Rgb3 colour = background;
  for (std::size_t i = steps.size(); i-- > 0;)
    colour = reference::through(choose(steps[i], colour), steps[i].length, colour);
  return colour;
}

/// Points of the transfer function that a step's values may take: its ends, its middle, and control points.
inline std::vector<TransferPoint> choices(const std::vector<TransferPoint>& points, const AttackStep& s) {
  std::vector<TransferPoint> all;
  for (const double f : {0.0, 0.25, 0.5, 0.75, 1.0})
    all.push_back(reference::shown_at(points, s.lo + f * (s.hi - s.lo)));
  for (const TransferPoint& p : points)
    if (p.value >= s.lo && p.value <= s.hi) all.push_back(p);
  return all;
}

/// Against channel c: what is shown is the most (`up`) or the least that a step allows.
inline reference::Rgb3 adversary(const std::vector<AttackStep>& steps,
                                 const std::vector<TransferPoint>& points, const reference::Rgb3& background,
                                 std::size_t c, bool up) {
  return picture_of(steps, background, [&](const AttackStep& s, const reference::Rgb3& behind) {
    TransferPoint best;
    double most = -1e300;
    for (const TransferPoint& p : choices(points, s)) {
      const double gain = (p.rgb[c] - behind[c]) * -std::expm1(-reference::extinction(p.opacity) * s.length);
      if ((up ? gain : -gain) > most) {
        most = up ? gain : -gain;
        best = p;
      }
    }
    return best;
  });
}

/// Soft to jumping, with points of no opacity and nearly all of it.
inline TransferFunction random_transfer(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  TransferFunction f{"random", {}};
  const int count = 2 + static_cast<int>(random() % 6);
  for (int i = 0; i < count; ++i) {
    const double value = -0.1 + 1.2 * unit(random), kind = unit(random);
    const double opacity = kind < 0.35   ? 0
                           : kind < 0.8  ? 0.6 * unit(random) * unit(random)
                           : kind < 0.95 ? unit(random)
                                         : 0.9999;
    f.points.push_back({value, {unit(random), unit(random), unit(random)}, opacity});
    if (unit(random) < 0.3)  // a jump
      f.points.push_back(
          {value, {unit(random), unit(random), unit(random)}, unit(random) < 0.5 ? 0 : unit(random)});
  }
  std::stable_sort(f.points.begin(), f.points.end(),
                   [](const auto& a, const auto& b) { return a.value < b.value; });
  return f;
}

/// Fields of a test of truth: a few, or as many as VDVR_TRUTH_FIELDS says.
inline int wanted_fields(int few) {
  const char* text = std::getenv("VDVR_TRUTH_FIELDS");
  return text ? std::atoi(text) : few;
}

/// What fp32 makes of where a ray begins and ends, in base cells, times the largest extinction: eye and grid
/// are added, divided and multiplied, 8 u of them.
inline double path_rounding(const RenderOptions& o, const Grid& g) {
  double far = 0, densest = 0;
  for (std::size_t a = 0; a < 3; ++a)
    far += std::abs(o.camera.position[a] - g.origin[a]) / g.spacing[a] + static_cast<double>(g.cells[a]);
  for (const TransferPoint& p : o.transfer.points)
    densest = std::max(densest, reference::extinction(std::min(p.opacity, 0.9999)));
  return 8 * tolerance::unit_roundoff * far * densest;
}

}  // namespace vdvr::support
