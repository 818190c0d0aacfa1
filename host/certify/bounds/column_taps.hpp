// What interpolation by the six weights of kernels/shared/column_taps.h errs, and by the eight.
#pragma once

#include <array>
#include <vector>

namespace vdvr {

/// The weights at f in [0, 1], in double precision from the coefficients as rounded to fp32: of taps -2 .. 3,
/// and -3 .. 4.
std::vector<double> six_taps(double f);
std::vector<double> eight_taps(double f);

/// Facts about them, for all f in [0, 1] at once. Unit of length: one column.
struct ColumnTaps {
  int taps = 0;
  double band = 0;   // |w| <= band, radians a column: six taps pi / 8, columns at 8x; eight pi / 6, at 6x
  double error = 0;  // of a wave of the band, of its amplitude: E
  double sup = 0;    // c: |interpolant - q| <= c sup |q| for every bounded q of the band
  double norm = 0;   // sum of the magnitudes
  /// |slope of the interpolant| <= slope (largest |q(n + 1) - q(n)|) + slope_sum (largest |q(n)|), for any
  /// values q at the columns.
  double slope = 0, slope_sum = 0;
  /// Evaluated in fp32 from a g that errs by at most 2^-25: sum over the taps of what a weight errs.
  double rounding = 0;
  /// |sum over the taps of their weights times y^n q(y)| <= moments()[n - 1] sup |q|, y from the place, for
  /// every bounded q of the band: n = 1 and 2. Computed at the first call (some 150 ms), then kept.
  [[nodiscard]] const std::array<double, 2>& moments() const;
  /// What the interpolant errs more, of sup |q|, where it is of (1 + tau y)^-2 q(y / (1 + tau y)), y from any
  /// place: docs/error-bounds.md, section 16.
  [[nodiscard]] double error_of_wedge(double tau) const;
  /// |E(w)| of the wave w, radians a column, |w| <= band: at most that over all f.
  [[nodiscard]] double error_at(double w) const;
};

/// Computed at the first call (some 50 ms), then kept.
const ColumnTaps& six_tap_facts();
const ColumnTaps& eight_tap_facts();

}  // namespace vdvr
