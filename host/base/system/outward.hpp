// Double precision to float, rounded outward: ends of intervals, and bounds.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdvr {

/// The largest float that is not above x.
inline float down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
/// The least float that is not below x.
inline float up(double x) { return -down(-x); }

/// A normal fp32 number that is not below x >= 0: no bound becomes 0 or is lost. What fp32 cannot hold
/// becomes infinite, NaN too.
inline float round_up(double x) {
  using limits = std::numeric_limits<float>;
  if (!(x <= static_cast<double>(limits::max()))) return limits::infinity();
  const auto nearest = static_cast<float>(std::max(x, static_cast<double>(limits::min())));
  return static_cast<double>(nearest) < x ? nearest * (1 + 0x1p-23f) : nearest;
}

}  // namespace vdvr
