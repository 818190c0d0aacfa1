// Double precision to float, rounded outward: ends of intervals.
#pragma once

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

}  // namespace vdvr
