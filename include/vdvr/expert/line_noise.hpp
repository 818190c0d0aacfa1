// The noise of a pixel's line integral.
#pragma once

#include <string>
#include <vector>

namespace vdvr {

/// The variance of a line integral p that a pixel measured: constant + photon e^p + read e^(2p). Of counts
/// with N photons in the open beam `photon` is 1 / N; `read` is the variance of the dark over the square of
/// the open beam.
struct LineIntegralNoise {
  double constant = 0;
  std::vector<float> photon{}, read{};  ///< [row v][column u], or one for all pixels, or none: 0
  double photons = 0;                   ///< in the open beam, median of the pixels; 0: of no such model
  std::string source{};                 ///< "stated", "flats", "second differences", "empty wedge"
  /// What a preparation made of white noise: its power over frequency along columns, the white noise's being
  /// 1, at (m + 1/2) / 2n cycles a column for 0 <= m < n. None: it is white.
  std::vector<float> spectrum{};
  /// Correlation of rows 1, 2, ... apart after the ramp. None: 0.
  std::vector<float> row_correlation{};
};

}  // namespace vdvr
