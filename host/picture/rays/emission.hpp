// The interval that holds an ideal pixel's colour: box steps from the back to the front
// (docs/pixel-bounds.md, theorem 3), with exact ranges of the transfer function. Double precision on the
// host.
#pragma once

#include <array>
#include <vector>

#include "host/picture/rays/ray_walk.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// What a transfer function can give over an interval of values: extinction per base cell, and the colours
/// that are seen.
struct MediumRange {
  double tau_low = 0, tau_high = 0;
  std::array<double, 3> low{}, high{};  ///< of no meaning where tau_high is 0
};

class MediumRanges {
 public:
  /// `transfer`: per base cell, values rising or, at a jump, equal.
  explicit MediumRanges(const TransferFunction& transfer);
  [[nodiscard]] MediumRange over(double low, double high) const;

 private:
  struct Point {
    double value, opacity;
    std::array<double, 3> rgb;
  };
  std::vector<Point> points_;
};

struct ColourInterval {
  std::array<double, 3> low{}, high{};
};

/// The colours in front of a part of so many base cells, from those behind it.
void box_step(ColourInterval& behind, const MediumRange& shown, double length);

struct EmissionOptions {
  double kappa = 0.5;          ///< parts of a piece are as long as this share of the bound's width
  double hidden = 1.0 / 4096;  ///< transmittance behind which a ray ends
};
/// The ideal colour of F along the ray, before `background`.
ColourInterval colour_interval(const RayField& field, const WorldRay& ray, const MediumRanges& ranges,
                               const std::array<double, 3>& background, const EmissionOptions& options = {});

}  // namespace vdvr
