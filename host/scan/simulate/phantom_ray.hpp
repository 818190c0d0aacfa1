// The part of a ray inside a box, for the phantoms that are cut by one.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdvr {

struct RayInterval {
  double begin, end;
  [[nodiscard]] bool empty() const { return !(begin < end); }
};

/// Keeps the s for which lo <= p + s d <= hi. Below 1e-15 a direction is an angle's rounding (cos of 90
/// degrees is 6e-17): the ray runs along the slab and is kept or dropped whole, so that a ray on the closed
/// face counts as inside.
inline RayInterval clip(RayInterval ray, double p, double d, double lo, double hi) {
  if (std::abs(d) < 1e-15 * std::max(1.0, hi - lo)) return p >= lo && p <= hi ? ray : RayInterval{0, 0};
  double first = (lo - p) / d, last = (hi - p) / d;
  if (first > last) std::swap(first, last);
  return {std::max(ray.begin, first), std::min(ray.end, last)};
}

}  // namespace vdvr
