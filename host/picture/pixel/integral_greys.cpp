// Greys of certified line integrals.
#include <algorithm>
#include <cmath>

#include "vdvr/error.hpp"
#include "vdvr/expert/certified_rays.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {

PixelBounds greys_of_integrals(const IntegralBounds& integrals, const RenderOptions& o) {
  if (o.mode != RenderMode::integral || !o.slice_range)
    throw InputError("`mode`: line integrals have greys in mode integral, by a `slice_range`");
  const auto [low, high] = *o.slice_range;
  const auto grey = [low = low, high = high](float value) {
    return high > low ? std::clamp((static_cast<double>(value) - low) / (high - low), 0.0, 1.0) : 0.0;
  };
  PixelBounds out;
  out.lo = out.hi = FloatImage{o.width, o.height, {}, 3};
  for (std::size_t i = 0; i < integrals.low.values.size(); ++i) {
    // Of numbers up to 1: one more rounding than is done.
    const auto lo = static_cast<float>(grey(integrals.low.values[i]) - 0x1p-23),
               hi = static_cast<float>(grey(integrals.high.values[i]) + 0x1p-23);
    out.lo.values.insert(out.lo.values.end(), 3, lo);
    out.hi.values.insert(out.hi.values.end(), 3, hi);
    out.parts.push_back(integrals.met[i]);
    out.untested.push_back(integrals.met[i] != 0 && !std::isfinite(integrals.high.values[i]) ? 1 : 0);
  }
  return out;
}

}  // namespace vdvr
