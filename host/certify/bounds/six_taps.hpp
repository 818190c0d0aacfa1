// What interpolation by the six weights of kernels/shared/six_taps.h errs.
#pragma once

#include <array>

namespace vdvr {

/// The weights at f in [0, 1], in double precision from the coefficients as rounded to fp32; taps -2 .. 3.
std::array<double, 6> six_taps(double f);

/// Facts about them, for all f in [0, 1] at once. Unit of length: one column.
struct SixTaps {
  double band = 0;   // |w| <= pi / 8, radians a column: columns at 8x
  double error = 0;  // of a wave of the band, of its amplitude: E
  double sup = 0;    // c: |interpolant - q| <= c sup |q| for every bounded q of the band
  double norm = 0;   // sum of the magnitudes
  /// |slope of the interpolant| <= slope (largest |q(n + 1) - q(n)|) + slope_sum (largest |q(n)|), for any
  /// values q at the columns.
  double slope = 0, slope_sum = 0;
  /// Evaluated in fp32 from a g that errs by at most 2^-25: sum over the taps of what a weight errs.
  double rounding = 0;
  /// |E(w)| of the wave w, radians a column, |w| <= band: at most that over all f.
  [[nodiscard]] double error_at(double w) const;
};

/// Computed at the first call (some 50 ms), then kept.
const SixTaps& six_tap_facts();

}  // namespace vdvr
