// How densely projections and gold are sampled: chosen by the plan, read by everything after it.
#pragma once

#include <optional>
#include <string_view>

namespace vdvr {

/// Of the upsampled projections, along u. Cubic: Lagrange's, through four samples. Six taps: nearly minimax,
/// of columns at 8x or more.
enum class Interpolation { linear, cubic, six_taps };
/// "linear", "cubic", "six-taps": as files and options write them.
constexpr const char* text_of(Interpolation interpolation) {
  return interpolation == Interpolation::six_taps ? "six-taps"
         : interpolation == Interpolation::cubic  ? "cubic"
                                                  : "linear";
}
constexpr std::optional<Interpolation> interpolation_of(std::string_view text) {
  if (text == "linear") return Interpolation::linear;
  if (text == "cubic") return Interpolation::cubic;
  if (text == "six-taps") return Interpolation::six_taps;
  return {};
}

struct Rates {
  int upsampling = 8;  ///< of the filtered projections, in u; a power of two
  Interpolation interpolation = Interpolation::linear;
  int gold = 8;  ///< gold samples per cell of the grid and axis; a power of two
  bool operator==(const Rates&) const = default;
};

}  // namespace vdvr
