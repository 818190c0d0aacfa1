// Which bricks, and which points of the transfer function, make a pixel's bound.
#include <algorithm>
#include <cmath>
#include <map>

#include "host/picture/pixel/pixel_ray.hpp"
#include "vdvr/expert/explain_pixel.hpp"

namespace vdvr {
namespace {

constexpr double kStep = 0.125;  // base cells

struct Sample {
  double value = 0, bound = 0, passes = 1;  ///< of what lies behind it
  std::size_t brick = 0;
  TransferPoint point;
};

double extinction(const TransferPoint& p) { return -std::log1p(-std::min(p.opacity, 1 - 0x1p-40)); }

/// The largest |q(s) - q(v) - (tau(s) - tau(v)) W| over what F may be, and the control point nearest to that
/// s.
double change(const std::vector<TransferPoint>& points, const Sample& v, const std::array<double, 3>& behind,
              bool windowed, std::size_t& at) {
  const double reach = std::isfinite(v.bound) ? v.bound : points.back().value - points.front().value;
  std::vector<TransferPoint> candidates;
  if (windowed && !std::isfinite(v.bound)) return 0;
  if (windowed) {
    candidates.push_back(v.point);
    candidates.back().opacity = 0;
  }
  for (int i = -4; i <= 4; ++i) candidates.push_back(transfer_at(points, v.value + reach * i / 4));
  for (const TransferPoint& p : points)
    if (std::abs(p.value - v.value) <= reach) candidates.push_back(p);
  double most = 0;
  for (const TransferPoint& s : candidates)
    for (std::size_t c = 0; c < 3; ++c) {
      const double d = std::abs(extinction(s) * (s.rgb[c] - behind[c]) -
                                extinction(v.point) * (v.point.rgb[c] - behind[c]));
      if (d <= most) continue;
      most = d;
      const auto nearest =
          std::min_element(points.begin(), points.end(), [&](const TransferPoint& a, const TransferPoint& b) {
            return std::abs(a.value - s.value) < std::abs(b.value - s.value);
          });
      at = static_cast<std::size_t>(nearest - points.begin());
    }
  return most;
}

std::vector<Sample> samples_of(const MixedVolume& v, const std::vector<float>& bounds, const RenderOptions& o,
                               const PixelRay& ray, double step, double length, bool windowed) {
  const Index3 n = v.bricks();
  std::vector<Sample> samples;
  for (double t = ray.first + step / 2; t < ray.last; t += step) {
    const Vec3 p = ray.at(t);
    const Index3 b = brick_at(v, p);
    Sample s;
    s.brick = static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0]);
    s.value = static_cast<double>(sample_at(v, p));
    s.bound = static_cast<double>(bounds[s.brick]);
    s.point = transfer_at(o.transfer.points, s.value);
    if (windowed && !std::isfinite(s.bound)) s.point.opacity = 0;
    s.passes = std::exp(-extinction(s.point) * length);
    samples.push_back(s);
  }
  return samples;
}

}  // namespace

PixelExplanation explain_pixel(const MixedVolume& v, const std::vector<float>& bounds, const RenderOptions& o,
                               std::int64_t x, std::int64_t y, bool windowed) {
  const PixelRay ray = pixel_ray(o, v.grid, x, y);
  const double unit = *std::min_element(v.grid.spacing.begin(), v.grid.spacing.end());
  PixelExplanation result;
  result.of_points.assign(o.transfer.points.size(), 0);
  if (!(ray.first < ray.last)) return result;
  const auto samples = samples_of(v, bounds, o, ray, kStep * unit, kStep, windowed);
  std::vector<double> seen(samples.size(), 1);  // how much of each reaches the eye
  for (std::size_t i = 1; i < samples.size(); ++i) seen[i] = seen[i - 1] * samples[i - 1].passes;
  std::array<double, 3> behind = background_of_pixel(o, y);
  std::map<std::size_t, BrickShare> shares;
  for (std::size_t i = samples.size(); i-- > 0;) {
    const Sample& s = samples[i];
    std::size_t point = 0;
    const double share = 255 * seen[i] * change(o.transfer.points, s, behind, windowed, point) * kStep;
    BrickShare& b = shares[s.brick];
    b.brick = s.brick;
    b.bound = s.bound;
    b.levels += share;
    result.of_points[point] += share;
    result.levels += share;
    for (std::size_t c = 0; c < 3; ++c) behind[c] = s.point.rgb[c] + (behind[c] - s.point.rgb[c]) * s.passes;
  }
  for (const auto& [brick, share] : shares)
    if (share.levels > 0) result.bricks.push_back(share);
  std::sort(result.bricks.begin(), result.bricks.end(),
            [](const BrickShare& a, const BrickShare& b) { return a.levels > b.levels; });
  return result;
}

}  // namespace vdvr
