// The transfer function as tables that kernels read, and what those tables leave out of a picture.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "host/base/opencl/cl.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// Rows of (rgb, opacity), and behind them opacities alone, four a row, in the order that kernels read
/// (raycast.cl; with pre-integration raycast_preintegrated.h).
struct BakedTransfer {
  std::vector<cl_float4> rows;
  int size = 0;             ///< entries along one value
  float lo = 0, scale = 0;  ///< entry = (value - lo) * scale
  /// [entry]: 0 where it or the stretch to the next shows anything, else 1 and on, one number a stretch.
  std::vector<std::uint8_t> stretch;

  /// The entry that kernels start from, by the same fp32 operations.
  [[nodiscard]] int first_entry(float value) const;
  /// Between which places, (value - lo) * scale, a value may show something; from above to where none does.
  [[nodiscard]] std::pair<float, float> shown_places() const;
  /// 0 where values within [lo, hi] may show something, else the stretch that they all lie in.
  [[nodiscard]] std::uint8_t stretch_of(float lo, float hi) const;
};

/// 1024 entries over the transfer function's own values; colours once, opacities of step / 2^l for each level
/// l up to `levels` - 1.
BakedTransfer bake(const TransferFunction& transfer, double step, int levels);
/// The same for VDVR_ADAPTED_LEVELS levels, and behind them by entry the total variation, from the first
/// entry on, of what a step adds to a pixel: its opacity, or opacity times colour, whichever changes most.
BakedTransfer bake_adaptive(const TransferFunction& transfer, double step);
/// 256 x 256 entries by front and back value over `range`, which holds every value of the field: what a path
/// of one step emits and absorbs along which the field is linear. About 20 ms, 1.25 MiB.
BakedTransfer bake_preintegrated(const TransferFunction& transfer, double step,
                                 const std::pair<float, float>& range);

}  // namespace vdvr
