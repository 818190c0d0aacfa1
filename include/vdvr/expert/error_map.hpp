// The worst error of multilinear interpolation of one plane wave cos(k . x + phase), over all phases and
// positions, as a function of kappa_j = k_j d_j (docs/error-bounds.md, section 3; Figs. 4 and 5 of the
// paper). It depends on k d alone: the map at rate 8 is the central eighth of the map at rate 1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"

namespace vdvr {

/// 1 - prod cos(kappa_j / 2) from here on *is* the worst error, in any dimension (theorem of section 3).
inline constexpr double kExactProduct = 0.2032;

/// 1 - prod cos(kappa_j / 2), |kappa_j| <= pi: the error at the cell's centre, hence never above the worst
/// one. Accurate relative to itself for small kappa.
VDVR_API double centre_error(std::span<const double> kappa);

/// Proved for every kappa: the worst error itself where prod cos >= kExactProduct or where at most one kappa
/// is not 0, an upper bound elsewhere (at most largest_wave_error), 2 where some |kappa_j| > pi. Up to 3
/// axes; throws InputError for more.
VDVR_API double wave_error_bound(std::span<const double> kappa);

/// The largest worst error of all waves up to Nyquist, in the outermost corner: 1, 1.0618, 1.0963 for 1, 2, 3
/// axes, rounded up by at most 1e-4.
VDVR_API double largest_wave_error(int axes);

/// kappa of entry i at rate 1: (first + i) step, within [-pi, pi].
struct FrequencyAxis {
  std::int64_t first = 0, count = 1;
  double step = 0;
};

/// float values[z][y][x]; unused axes have count 1 and frequency 0.
struct ErrorMap {
  std::array<std::int64_t, 3> size{1, 1, 1};  ///< x, y, z
  std::vector<float> centre;                  ///< centre_error
  std::vector<float> bound;                   ///< wave_error_bound, fp32 rounding included
};

/// The map at spacing d / rate, on the device. Cost: one sine per axis and entry. Memory: 8 bytes per entry
/// on the device and on the host. Throws InputError for frequencies beyond Nyquist at rate 1 or rates
/// below 1.
VDVR_API ErrorMap error_map(Device& device, const std::array<FrequencyAxis, 3>& axes, int rate);

}  // namespace vdvr
