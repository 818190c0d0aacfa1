// Intervals of a slice's pixels: V at their middles and the bounds of bricks.
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/base/system/outward.hpp"
#include "shared/raycast_params.h"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

// Of the picture at a time: so many points lie in memory.
constexpr std::int64_t kRows = 64;

/// Grey by value.
struct Window {
  double low = 0, scale = 0;
  // A window of one value is shown black, as it is drawn.
  [[nodiscard]] double grey(double value) const {
    return scale > 0 ? std::clamp((value - low) * scale, 0.0, 1.0) : 0;
  }
};
Window window_of(const RenderOptions& o) {
  if (!o.slice_range)
    throw InputError("`slice_range`: a certified slice needs the window that it is drawn with");
  const auto [low, high] = *o.slice_range;
  return {low, high > low ? 1 / (high - low) : 0};
}

/// What a double loses in a value's grey is far below 2^-40 of the numbers it is made of.
double slack_of(double value, double bound) { return 0x1p-40 * (std::abs(value) + bound); }

}  // namespace

Vec3 slice_point(const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y) {
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  const std::size_t across = axis == 0 ? 1 : 0, below = axis == 2 ? 1 : 2;
  const auto side = [&](std::size_t a) { return static_cast<double>(g.cells[a]) * g.spacing[a]; };
  const double width = static_cast<double>(o.width), height = static_cast<double>(o.height),
               pixel = std::max(side(across) / width, side(below) / height);
  const auto place = [&](std::size_t a, std::int64_t i, double pixels) {
    return g.origin[a] + side(a) / 2 + (static_cast<double>(i) + 0.5 - pixels / 2) * pixel;
  };
  Vec3 point{};
  point[axis] = o.slice_position.value_or(g.origin[axis] + side(axis) / 2);
  point[across] = place(across, x, width);
  point[below] = place(below, y, height);
  return point;
}

PixelBounds certify_slice(const MixedVolume& volume, const Certificate& certificate, const RenderOptions& o,
                          const Progress& progress) {
  if (o.mode != RenderMode::slice) throw InputError("`mode`: a slice is certified here, and nothing else");
  if (certificate.window)
    throw InputError(
        "the certificate has a window: where F lies outside of it nothing bounds |V - F|, and no slice tells "
        "where; build without --window");
  const CertifiedPoints known(volume, certificate);
  const Window window = window_of(o);
  PixelBounds out;
  out.lo = out.hi = FloatImage{o.width, o.height, {}, 3};
  for (std::int64_t first = 0; first < o.height; first += kRows) {
    std::vector<Vec3> points;
    for (std::int64_t y = first; y < std::min(first + kRows, o.height); ++y)
      for (std::int64_t x = 0; x < o.width; ++x) points.push_back(slice_point(o, volume.grid, x, y));
    std::vector<float> values(points.size()), bounds(points.size());
    known.values(points, values);
    known.bounds(points, bounds);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool present = !std::isnan(bounds[i]);
      const double value = static_cast<double>(values[i]), bound = static_cast<double>(bounds[i]),
                   reach = bound + slack_of(value, bound);
      const float lo = present ? down(window.grey(value - reach)) : VDVR_GREY_OUTSIDE,
                  hi = present ? up(window.grey(value + reach)) : VDVR_GREY_OUTSIDE;
      out.lo.values.insert(out.lo.values.end(), 3, lo);
      out.hi.values.insert(out.hi.values.end(), 3, hi);
      out.parts.push_back(present ? 1 : 0);
      out.untested.push_back(present && !std::isfinite(bound) ? 1 : 0);
    }
    throw_if_stopped();
    report(progress, "certify",
           std::min(1.0, static_cast<double>(first + kRows) / static_cast<double>(o.height)));
  }
  return out;
}

void clear_absent(Image& drawn, const PixelBounds& bounds) {
  for (std::size_t i = 0; i < bounds.parts.size(); ++i)
    if (bounds.parts[i] == 0)
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
        drawn.rgb[c] = static_cast<std::uint8_t>(std::lround(255 * bounds.lo.values[c]));
}

}  // namespace vdvr
