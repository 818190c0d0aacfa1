// How densely projections and gold are sampled: chosen by the plan, read by everything after it.
#pragma once

#include <optional>
#include <string_view>

namespace vdvr {

/// Of the upsampled projections, along u. Cubic: Lagrange's, through four samples. Six taps: nearly minimax,
/// of columns at 8x or more. Eight taps: alike, of cone beam, both ways at 6x.
enum class Interpolation { linear, cubic, six_taps, eight_taps };
/// "linear", "cubic", "six-taps", "eight-taps": as files and options write them.
constexpr const char* text_of(Interpolation interpolation) {
  return interpolation == Interpolation::eight_taps ? "eight-taps"
         : interpolation == Interpolation::six_taps ? "six-taps"
         : interpolation == Interpolation::cubic    ? "cubic"
                                                    : "linear";
}
constexpr std::optional<Interpolation> interpolation_of(std::string_view text) {
  if (text == "linear") return Interpolation::linear;
  if (text == "cubic") return Interpolation::cubic;
  if (text == "six-taps") return Interpolation::six_taps;
  if (text == "eight-taps") return Interpolation::eight_taps;
  return {};
}

/// Whether what it errs follows from the sup of what is interpolated, not from derivatives.
constexpr bool needs_values_alone(Interpolation interpolation) {
  return interpolation == Interpolation::six_taps || interpolation == Interpolation::eight_taps;
}

constexpr int dense_differences = 8, sparse_differences = 4;

struct Rates {
  int upsampling = 8;  ///< of the filtered projections, in u: a power of two, of cone beam 6
  Interpolation interpolation = Interpolation::linear;
  int gold = 8;  ///< gold samples per cell of the grid and axis; a power of two
  /// Of cone beam, nodes to a pixel at which fourth differences are taken: 8, or 4 where that does.
  int differences = dense_differences;
  bool operator==(const Rates&) const = default;
};

}  // namespace vdvr
