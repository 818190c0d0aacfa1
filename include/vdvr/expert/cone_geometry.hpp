// Cone-beam geometry: one 3x4 matrix for each view (docs/geometry.md, "Cone beam").
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// double m[3][4]: (u lambda, v lambda, lambda) = m (x, y, z, 1), with u and v in columns and rows of the
/// detector, whose centres are integers, and lambda = 1 at the isocentre, which is the world's origin. lambda
/// is the distance from the source along the detector's normal, over that of the isocentre.
using ViewMatrix = std::array<std::array<double, 4>, 3>;

/// How rays that are measured twice share their weight.
enum class Redundancy {
  full_turn,   ///< every ray twice: views weigh by their angular gaps alone
  short_scan,  ///< 180 degrees and the fan, or more: Parker's weights
  displaced    ///< a full turn whose detector reaches farther on one side of the axis: Wang's weights
};
VDVR_API const char* text_of(Redundancy redundancy);
VDVR_API std::optional<Redundancy> redundancy_of(const std::string& text);

struct ConeGeometry {
  std::vector<ViewMatrix> views;
  Redundancy redundancy = Redundancy::full_turn;
  bool operator==(const ConeGeometry&) const = default;
};

/// What a matrix says of its view, in the matrix' units of length.
struct ConeView {
  Vec3 source{};                    ///< where all rays start
  Vec3 along_u{}, along_v{};        ///< unit vectors on the detector, towards higher columns and rows
  Vec3 normal{};                    ///< unit vector from the source's side to the detector's
  double source_to_axis = 0;        ///< from the source to the isocentre, along the normal
  double pitch_u = 0, pitch_v = 0;  ///< at the isocentre
  double center = 0, row = 0;       ///< where the isocentre is seen
  double foot_u = 0, foot_v = 0;    ///< where the normal through the source meets the detector

  /// Of the source about the z axis: atan2(y, x).
  [[nodiscard]] double angle() const;
  /// The unit vector from the source through a pixel.
  [[nodiscard]] Vec3 ray(double column, double row) const;
};

/// Throws InputError for a matrix that is not finite, that is singular, or whose rows and columns are not at
/// right angles within a thousandth.
VDVR_API ConeView cone_view(const ViewMatrix& matrix);

/// The same view with lambda = 1 at the origin. Throws InputError where the origin lies in the source's plane
/// or behind it.
VDVR_API ViewMatrix normalised(ViewMatrix matrix);

/// A flat detector parallel to the axis and its source opposite, as circular scans are described; lengths in
/// one unit.
struct CircularView {
  double theta_rad = 0;  ///< the ray through the axis looks along (-sin, cos) of it: as in parallel beam
  double source_to_axis = 0, source_to_detector = 0;
  double pitch_u = 1, pitch_v = 1;  ///< on the detector
  double center = 0;                ///< column that the ray through the isocentre, at right angles, hits
  double row = 0;                   ///< and its row
  double in_plane_rad = 0, out_of_plane_rad = 0;  ///< as RTK's angles
  double source_offset_u = 0, source_offset_v = 0;
  double detector_offset_u = 0, detector_offset_v = 0;  ///< on the detector
};
VDVR_API ViewMatrix circular_view(const CircularView& view);

/// The angles of the sources about the axis: where they begin after their largest gap, and how far they go.
struct SourceArc {
  double first_rad = 0, arc_rad = 0;
  double largest_gap_rad = 0;
};
VDVR_API SourceArc source_arc(const ConeGeometry& cone);

/// What the views themselves tell: a wedge of more than 20 degrees that no source was in leaves a short scan;
/// of a full turn a detector that reaches at least a tenth of its width farther on one side is displaced.
VDVR_API Redundancy natural_redundancy(const ConeGeometry& cone, std::int64_t columns);

/// The view whose column `center` is where the isocentre is seen.
VDVR_API ViewMatrix recentred(ViewMatrix matrix, double center);

/// (u, v, lambda) of a point.
VDVR_API Vec3 projected(const ViewMatrix& matrix, const Vec3& point);
/// u and v of the points infinitely far away in a direction, and by how much lambda grows along it.
VDVR_API Vec3 projected_direction(const ViewMatrix& matrix, const Vec3& direction);

}  // namespace vdvr
