// Which directions a scan sees: views that nearly coincide as one direction, the gaps between directions, and
// which of these are wedges that nothing saw (docs/geometry.md, "Weights of views").
#pragma once

#include <cstddef>
#include <vector>

namespace vdvr {

/// Views that nearly coincide modulo the period, and the gap from their mean to that of the next direction.
struct Direction {
  std::vector<std::size_t> views;
  double place_rad = 0;  ///< their mean; slightly negative for a direction that lies across the seam
  double gap_after_rad = 0;
  bool wedge_after = false;  ///< nothing saw that gap
};

struct AngularGaps {
  std::vector<Direction> directions;  ///< in ascending order of place
  /// Half of the angle that was seen lies in gaps of at most that; wedges aside.
  double usual_rad = 0;
  /// All views lie within a hundredth of the rest of the period.
  bool one_direction = false;
  /// A gap that is no wedge could be one: it is four times as wide as usual, or gaps between bursts of views
  /// make up a third of the period.
  bool doubtful = false;

  [[nodiscard]] std::vector<double> wedges_rad() const;  ///< their widths, the widest first
  [[nodiscard]] double widest_filled_rad() const;        ///< of the other gaps
};

/// Angles in any order, also beyond the period: pi where opposite views see the same, else 2 pi. At least
/// one. O(n log n) time.
AngularGaps angular_gaps(const std::vector<double>& theta_rad, double period_rad);

}  // namespace vdvr
