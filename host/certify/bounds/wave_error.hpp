// wave_error_bound of expert/error_map.hpp in two steps, for sums over many waves: what an axis gives is the
// same for all waves of one frequency along it.
#pragma once

#include <array>

namespace vdvr {

/// Bounds for 2 and for 3 axes where prod cos(kappa_j / 2) is i / steps * kExactProduct.
constexpr int wave_error_steps = 256;
using WaveErrorTable = std::array<std::array<double, wave_error_steps + 1>, 2>;
const WaveErrorTable& wave_error_table();

/// 1 - cos(kappa / 2); infinite beyond Nyquist.
double wave_error_of_axis(double kappa);

/// wave_error_bound, to the bit, of what axes give; 0 for those that there are not.
double wave_error_bound_of(const std::array<double, 3>& of_axes);

}  // namespace vdvr
