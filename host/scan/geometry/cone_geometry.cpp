// Matrices of cone-beam views: what they say, and how circular scans are written as them
// (docs/geometry.md, "Cone beam").
#include "vdvr/expert/cone_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/scan/geometry/angular_gaps.hpp"
#include "host/scan/geometry/vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Rows and columns of a detector that are more skew than that are not taken for a rounded right angle.
constexpr double most_skew = 1e-3;

constexpr double turn = 2 * std::numbers::pi;

Vec3 row_of(const ViewMatrix& m, std::size_t i) { return {m[i][0], m[i][1], m[i][2]}; }

// The point that all three rows map to 0: Cramer's rule.
Vec3 source_of(const ViewMatrix& m) {
  const Vec3 a = row_of(m, 0), b = row_of(m, 1), c = row_of(m, 2), bc = cross(b, c), ca = cross(c, a),
             ab = cross(a, b);
  const double volume = dot(a, bc);
  if (!(std::abs(volume) > 1e-12 * length(a) * length(b) * length(c)))
    throw InputError("a view's matrix is singular: its rows are no camera");
  Vec3 out{};
  for (std::size_t i = 0; i < 3; ++i)
    out[i] = -(m[0][3] * bc[i] + m[1][3] * ca[i] + m[2][3] * ab[i]) / volume;
  return out;
}

std::vector<double> source_angles(const ConeGeometry& cone) {
  std::vector<double> angles;
  for (const ViewMatrix& matrix : cone.views) angles.push_back(cone_view(matrix).angle());
  return angles;
}

}  // namespace

const char* text_of(Redundancy redundancy) {
  switch (redundancy) {
    case Redundancy::short_scan:
      return "short-scan";
    case Redundancy::displaced:
      return "displaced";
    default:
      return "full-turn";
  }
}

std::optional<Redundancy> redundancy_of(const std::string& text) {
  for (const Redundancy r : {Redundancy::full_turn, Redundancy::short_scan, Redundancy::displaced})
    if (text == text_of(r)) return r;
  return {};
}

double ConeView::angle() const { return std::atan2(source[1], source[0]); }

Vec3 ConeView::ray(double column, double row_) const {
  const Vec3 through = sum(scaled(normal, source_to_axis), sum(scaled(along_u, (column - foot_u) * pitch_u),
                                                               scaled(along_v, (row_ - foot_v) * pitch_v)));
  return scaled(through, 1 / length(through));
}

Vec3 projected(const ViewMatrix& m, const Vec3& p) {
  const auto of = [&](std::size_t i) { return m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3]; };
  const double lambda = of(2);
  return {of(0) / lambda, of(1) / lambda, lambda};
}

Vec3 projected_direction(const ViewMatrix& m, const Vec3& d) {
  const auto of = [&](std::size_t i) { return m[i][0] * d[0] + m[i][1] * d[1] + m[i][2] * d[2]; };
  const double lambda = of(2);
  return {of(0) / lambda, of(1) / lambda, lambda};
}

ViewMatrix normalised(ViewMatrix matrix) {
  const double scale = matrix[2][3];
  if (!std::isfinite(scale) || scale == 0)
    throw InputError("the isocentre lies in the plane of a view's source; check the matrix and its unit");
  for (auto& row : matrix)
    for (double& value : row) value /= scale;
  return matrix;
}

ConeView cone_view(const ViewMatrix& matrix) {
  for (const auto& row : matrix)
    for (const double value : row)
      if (!std::isfinite(value)) throw InputError("a view's matrix is not finite");
  const Vec3 a = row_of(matrix, 0), b = row_of(matrix, 1), c = row_of(matrix, 2);
  ConeView view;
  view.source = source_of(matrix);
  const double depth = length(c);
  view.source_to_axis = 1 / depth;
  view.normal = scaled(c, 1 / depth);
  // Moves along a row change v as little as lambda, moves along a column neither u nor lambda.
  const Vec3 row = cross(b, c), column = cross(c, a);
  view.pitch_u = depth / length(cross(a, c));
  view.pitch_v = depth / length(cross(b, c));
  view.along_u = scaled(row, (dot(row, a) < 0 ? -1 : 1) / length(row));
  view.along_v = scaled(column, (dot(column, b) < 0 ? -1 : 1) / length(column));
  if (!(std::abs(dot(view.along_u, view.along_v)) <= most_skew))
    throw InputError(fmt::format(
        "a view's rows and columns meet at {:.2f} degrees; detectors with other than right "
        "angles are not supported",
        std::acos(std::clamp(dot(view.along_u, view.along_v), -1.0, 1.0)) * 180 / std::numbers::pi));
  view.center = matrix[0][3] / matrix[2][3];
  view.row = matrix[1][3] / matrix[2][3];
  const Vec3 foot = projected_direction(matrix, view.normal);
  view.foot_u = foot[0];
  view.foot_v = foot[1];
  return view;
}

// T(source - detector offset) perspective T(-source offset) Rz(-in plane) Rx(-out of plane) Ry(-gantry), in
// RTK's world, whose y is our z and whose z is our -y (RTK, documentation of
// ThreeDCircularProjectionGeometry).
ViewMatrix circular_view(const CircularView& v) {
  const double cg = std::cos(v.theta_rad), sg = std::sin(v.theta_rad), co = std::cos(v.out_of_plane_rad),
               so = std::sin(v.out_of_plane_rad), ci = std::cos(v.in_plane_rad),
               si = std::sin(v.in_plane_rad);
  const double sid = v.source_to_axis, sdd = v.source_to_detector;
  // Rows: x', y', z' of a point of ours before the source's offset is taken off.
  // Ry(-g): x1 = cg x - sg z_r, z1 = sg x + cg z_r with z_r = -y;  y1 = z.
  const std::array<double, 3> x1{cg, sg, 0}, y1{0, 0, 1}, z1{sg, -cg, 0};
  std::array<double, 3> x3{}, y3{}, z3{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double y2 = co * y1[i] + so * z1[i], z2 = -so * y1[i] + co * z1[i];  // Rx(-out)
    x3[i] = ci * x1[i] + si * y2;                                              // Rz(-in)
    y3[i] = -si * x1[i] + ci * y2;
    z3[i] = z2;
  }
  const double zoom_u = sdd / (sid * v.pitch_u), zoom_v = sdd / (sid * v.pitch_v);
  const double u0 = v.center + (v.source_offset_u - v.detector_offset_u) / v.pitch_u,
               v0 = v.row + (v.source_offset_v - v.detector_offset_v) / v.pitch_v;
  ViewMatrix m{};
  for (std::size_t i = 0; i < 3; ++i) {
    m[2][i] = -z3[i] / sid;
    m[0][i] = zoom_u * x3[i] + u0 * m[2][i];
    m[1][i] = zoom_v * y3[i] + v0 * m[2][i];
  }
  m[2][3] = 1;
  m[0][3] = u0 - zoom_u * v.source_offset_u;
  m[1][3] = v0 - zoom_v * v.source_offset_v;
  return m;
}

SourceArc source_arc(const ConeGeometry& cone) {
  std::vector<double> angles = source_angles(cone);
  for (double& angle : angles)
    if (angle < 0) angle += turn;
  SourceArc arc;
  if (angles.empty()) return arc;
  std::sort(angles.begin(), angles.end());
  std::vector<double> gaps;
  std::size_t widest = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    gaps.push_back(i + 1 < angles.size() ? angles[i + 1] - angles[i] : angles[0] + turn - angles[i]);
    if (gaps[i] > gaps[widest]) widest = i;
  }
  arc.first_rad = angles[(widest + 1) % angles.size()];
  arc.largest_gap_rad = gaps[widest];
  arc.arc_rad = turn - arc.largest_gap_rad;
  return arc;
}

Redundancy natural_redundancy(const ConeGeometry& cone, std::int64_t columns) {
  constexpr double open_gap = std::numbers::pi / 9;  // RTK's threshold for a short scan
  const std::vector<double> wedges = angular_gaps(source_angles(cone), turn).wedges_rad();
  if (!wedges.empty() && wedges.front() > open_gap) return Redundancy::short_scan;
  // The reach that all views have on either side.
  const double last = static_cast<double>(columns - 1);
  double below = last, above = last;
  for (const ViewMatrix& matrix : cone.views) {
    const double center = matrix[0][3] / matrix[2][3];
    below = std::min(below, center);
    above = std::min(above, last - center);
  }
  return std::abs(above - below) >= 0.1 * (above + below) ? Redundancy::displaced : Redundancy::full_turn;
}

ViewMatrix recentred(ViewMatrix matrix, double center) {
  const double shift = center - matrix[0][3] / matrix[2][3];
  for (std::size_t j = 0; j < 4; ++j) matrix[0][j] += shift * matrix[2][j];
  return matrix;
}

}  // namespace vdvr
