// What a transfer function can show over an interval of values, however wide, in two look-ups
// (docs/pixel-bounds.md, section 3). Called by pixel_bounds.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/opencl/cl.hpp"
#include "vdvr/transfer_function.hpp"

namespace vdvr {

/// Row k * bins + i is of bins i to i + 2^k - 1: (largest extinction, minus the least, largest red and
/// green), (largest blue, minus the least red, green, blue); colours of values that show alone. Extinctions
/// in halvings a base cell. The two end bins stand for all values beyond. Rounded outward.
struct RangeTable {
  float lo = 0, scale = 1;  ///< bin = (value - lo) * scale
  int bins = 0;
  std::vector<cl_float4> rows;
  std::vector<cl_int> next_shown;                 ///< the first bin from this one on that may show something
  std::array<float, 3> colour_lo{}, colour_hi{};  ///< of all that may show; lo above hi where nothing may

  /// Whether no value of [from, to] shows anything, by the bins that kernels take.
  [[nodiscard]] bool is_clear(float from, float to) const;
};

/// With bins below an eighth of `bound`, 2048 to 16384 of them. `or_clear`: beside the values of an interval
/// there may be others, which show nothing.
RangeTable make_range_table(const TransferFunction& transfer, double bound, bool or_clear = false);

}  // namespace vdvr
