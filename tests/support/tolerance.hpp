// Tolerances with a source. u = 2^-24 is the unit roundoff of fp32. A bare number in a test is a defect.
#pragma once

#include <cmath>
#include <cstdint>

namespace vdvr::tolerance {

inline constexpr double unit_roundoff = 0x1p-24;

/// Equal to the bit.
inline constexpr double exactly = 0.0;

/// A sum (or dot product) of n fp32 terms whose magnitudes add to `magnitude`: gamma_n = n u / (1 - n u)
/// (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1).
inline double fp32_sum(std::int64_t n, double magnitude) {
  const double nu = static_cast<double>(n) * unit_roundoff;
  return nu / (1 - nu) * magnitude;
}

/// An fp32 FFT of length n, in the 2-norm: log2(n) eta |x|_2, eta = u + gamma_4 (sqrt 2 + u) (Higham,
/// theorem 24.2).
inline double fft(std::int64_t n, double norm2) {
  const double gamma4 = 4 * unit_roundoff / (1 - 4 * unit_roundoff);
  const double eta = unit_roundoff + gamma4 * (std::sqrt(2.0) + unit_roundoff);
  return std::log2(static_cast<double>(n)) * eta * norm2;
}

/// A double-precision computation of n terms of the given magnitude.
inline double fp64_sum(std::int64_t n, double magnitude) {
  return static_cast<double>(n) * 0x1p-53 * magnitude;
}

/// What a certificate promises is the tolerance itself: no slack.
inline double bound(double b) { return b; }

}  // namespace vdvr::tolerance
