// The covered region of a cone-beam scan.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

/// Points that every view sees on the detector: between its outer columns' outer edges and its outer rows'
/// centres. Four planes through the source bound a view's share, so that the region is convex.
class ConeCoverage {
 public:
  /// The matrices are of these columns and rows. Throws InputError where the isocentre is not seen.
  ConeCoverage(const std::vector<ViewMatrix>& views, std::int64_t columns, std::int64_t rows);

  /// The least distance to any of the planes: >= 0 inside; outside, minus a lower bound of the distance to
  /// the region. Cost: four products a view.
  [[nodiscard]] double margin(const Vec3& point) const;
  /// Heights of the column over (x, y) whose margin is at least `least`: from .first to .second; none where
  /// .first > .second.
  [[nodiscard]] std::pair<double, double> heights(double x, double y, double least) const;
  /// Of the circle about the axis, in the isocentre's plane, that all views see.
  [[nodiscard]] double inner_radius() const { return inner_; }

 private:
  std::vector<std::array<double, 4>> planes_;  // unit normals inwards, and what the axis' point has
  double inner_ = 0, slack_ = 0;
};

}  // namespace vdvr
