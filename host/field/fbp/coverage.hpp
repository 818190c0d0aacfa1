// The covered region of a scan: points all of whose projections fall on the detector; of cone beam a cylinder
// within it.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "vdvr/expert/cone_geometry.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

/// How far from the axis the detector sees on either side, in columns, to its edges. Of half acquisition,
/// where opposite views are one, as far as the longer side.
std::pair<double, double> seen_columns(const ParallelGeometry& geometry);

/// The region across z is the intersection of half-planes, a convex polygon around the axis; along z it is an
/// interval of heights.
class Coverage {
 public:
  /// Strips t_min <= t <= t_max. `geometry.center` is the centre in use. Throws InputError when the axis does
  /// not fall on the detector.
  explicit Coverage(const ParallelGeometry& geometry);
  /// Of cone beam, where `views` has matrices of the detector's columns and rows: what every view sees
  /// narrows towards the top and the bottom, and what can be certified is the largest upright cylinder in it
  /// (docs/geometry.md, "Cone beam"). Without views, that of parallel beam.
  Coverage(const ParallelGeometry& geometry, const std::vector<ViewMatrix>& views);

  /// Distance-like margin across z: >= 0 inside; outside, minus a lower bound of the distance to the region.
  [[nodiscard]] double margin(double x, double y) const;
  /// The same where it is at least `floor`; where not, something below `floor`. Cost: far outside, that of
  /// one view, where margin() looks at a few, and two radii from the axis at all.
  [[nodiscard]] double margin_above(double x, double y, double floor) const;
  /// Corners, one after another, of a convex polygon that holds every point of margin() >= -`reach`, and
  /// little more.
  [[nodiscard]] std::vector<std::array<double, 2>> outline(double reach) const;
  /// The same as margin() along z.
  [[nodiscard]] double margin_z(double z) const;
  [[nodiscard]] double inner_radius() const { return inner_; }
  /// Along z, from .first to .second.
  [[nodiscard]] const std::pair<double, double>& heights() const { return heights_; }

 private:
  // x * point_x + y * point_y + rest >= 0; (x, y) is at most of length 1.
  struct HalfPlane {
    double x = 0, y = 0, rest = 0;
    [[nodiscard]] double margin(double px, double py) const { return x * px + y * py + rest; }
  };
  void index();
  void add_least(std::int64_t sector);
  void take_cylinder(const std::vector<std::array<double, 4>>& planes);

  std::vector<HalfPlane> planes_;
  std::vector<std::size_t> nearest_;  // by sectors of directions: the half-plane that ends there first
  std::vector<HalfPlane> least_;      // by sectors, around the region: those that can have the least margin
  std::vector<std::size_t> first_;    // of a sector's, and where the last ends
  std::vector<double> within_;        // of circles around the axis, the least margin on each
  std::pair<double, double> heights_;
  double inner_ = 0, slack_ = 0, slack_z_ = 0;
};

/// What a view of cone beam sees is bounded by four planes through its source, by its columns' outer edges
/// first: unit normals inwards, and what the axis' point has.
std::array<std::array<double, 4>, 4> planes_of_view(const ViewMatrix& matrix, std::int64_t columns,
                                                    std::int64_t rows);

/// What the options say, else a box around a cylinder about the axis. Throws InputError for a grid that is
/// empty, not finite, or too large.
Grid grid_around(const ParallelGeometry& geometry, double radius, std::pair<double, double> heights,
                 const GridOptions& options);

}  // namespace vdvr
