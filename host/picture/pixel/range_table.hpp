// What a transfer function can show over an interval of values, however wide, in two look-ups
// (docs/pixel-bounds.md, section 3).
#pragma once

#include <array>
#include <vector>

#include "host/base/opencl/cl.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// Row k * bins + i is of bins i to i + 2^k - 1: (largest extinction, minus the least, largest red and
/// green), (largest blue, minus the least red, green, blue); colours of values that show alone. Extinctions
/// in halvings a base cell. The two end bins stand for all values beyond. Rounded outward.
///
/// Behind them stand the transfer function's own (extinction, red, green, blue), to the nearest float: at the
/// bins + 1 edges of bins from row first_edge on, and from first_bend on below and above each bend, which are
/// the values of control points. Between two of these that follow each other opacity and colours are
/// straight.
struct RangeTable {
  float lo = 0, scale = 1;  ///< bin = (value - lo) * scale
  int bins = 0, first_edge = 0, first_bend = 0;
  float extinction_error = 0;  ///< of edges and bends, beside float's own
  std::vector<cl_float4> rows;
  /// The first bin from this one on that may show something; behind them, of bins + 1 edges, how many bends
  /// lie below or are the edge itself.
  std::vector<cl_int> next_shown;
  std::array<float, 3> colour_lo{}, colour_hi{};  ///< of all that may show; lo above hi where nothing may

  /// Whether no value of [from, to] shows anything, by the bins that kernels take.
  [[nodiscard]] bool is_clear(float from, float to) const;
};

/// With bins below an eighth of `bound`, 2048 to 16384 of them. `or_clear`: beside the values of an interval
/// there may be others, which show nothing.
RangeTable make_range_table(const TransferFunction& transfer, double bound, bool or_clear = false);

}  // namespace vdvr
