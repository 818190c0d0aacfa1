// The covered region of a scan: points all of whose projections fall on the detector. Called by
// reconstruct.cpp, plan.cpp, gold_stream.cpp, build.cpp.
#pragma once

#include <utility>
#include <vector>

#include "vdvr/reconstruct.hpp"

namespace vdvr {

/// The region across z: the intersection of one strip per view, t_min <= t <= t_max; a convex polygon around
/// the axis.
class Coverage {
 public:
  /// `geometry.center` is the centre in use. Throws InputError when the axis does not fall on the detector.
  explicit Coverage(const ParallelGeometry& geometry);

  /// Distance-like margin across z: >= 0 inside; outside, minus a lower bound of the distance to the region.
  [[nodiscard]] double margin(double x, double y) const;
  /// The same where it is at least `floor`; where not, something below `floor`. Cost: far outside, that of
  /// one view, where margin() looks at all.
  [[nodiscard]] double margin_above(double x, double y, double floor) const;
  /// The same along z.
  [[nodiscard]] double margin_z(double z) const;
  [[nodiscard]] double inner_radius() const { return inner_; }
  [[nodiscard]] double half_height() const { return half_height_; }

 private:
  std::vector<double> cosine_, sine_;
  std::vector<std::size_t> nearest_;  // by sectors of directions: the view that looks along the middle best
  double t_min_, t_max_, inner_, half_height_, slack_, slack_z_;
};

/// What the options say, else a box around a cylinder about the axis. Throws InputError for a grid that is
/// empty, not finite, or too large.
Grid grid_around(const ParallelGeometry& geometry, double radius, std::pair<double, double> heights,
                 const GridOptions& options);

}  // namespace vdvr
