// Colours of certified maxima: what the transfer function has between their bounds.
#include <algorithm>
#include <cmath>

#include "host/picture/pixel/pixel_ray.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_rays.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {
namespace {

struct ColourRange {
  std::array<double, 3> lo{1, 1, 1}, hi{0, 0, 0};
  void take(const std::array<double, 3>& rgb) {
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], rgb[c]);
      hi[c] = std::max(hi[c], rgb[c]);
    }
  }
};

/// Colours are linear between points, so ends and points are extremes; at a jump both sides count.
ColourRange colours_between(const std::vector<TransferPoint>& points, double low, double high) {
  ColourRange r;
  r.take(transfer_at(points, low).rgb);
  r.take(transfer_at(points, std::min(high, points.back().value)).rgb);
  for (const TransferPoint& p : points)
    if (p.value >= low && p.value <= high) r.take(p.rgb);
  return r;
}

}  // namespace

PixelBounds colours_of_maxima(const MaximumBounds& maxima, const RenderOptions& o) {
  if (o.mode != RenderMode::mip || o.transfer.points.empty())
    throw InputError("`mode`: maxima have colours in mode mip, by a transfer function");
  PixelBounds out;
  out.lo = out.hi = FloatImage{o.width, o.height, {}, 3};
  for (std::size_t i = 0; i < maxima.low.values.size(); ++i) {
    const bool any = !std::isnan(maxima.low.values[i]);
    ColourRange r;
    if (any)
      r = colours_between(o.transfer.points, static_cast<double>(maxima.low.values[i]),
                          static_cast<double>(maxima.high.values[i]));
    else r.take(background_of_pixel(o, static_cast<std::int64_t>(i) / o.width));
    // Of numbers up to 1: one more rounding than is done.
    for (std::size_t c = 0; c < 3; ++c) {
      out.lo.values.push_back(static_cast<float>(r.lo[c] - 0x1p-23));
      out.hi.values.push_back(static_cast<float>(r.hi[c] + 0x1p-23));
    }
    out.parts.push_back(any ? 1 : 0);
    out.untested.push_back(any && !std::isfinite(maxima.high.values[i]) ? 1 : 0);
  }
  return out;
}

}  // namespace vdvr
