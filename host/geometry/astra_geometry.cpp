// ASTRA's dictionaries. Its world has the axis of rotation along z, its rows run along +z, and at angle 0 the
// source lies at -y: as ours. Its detector is centred on the ray through the axis.
#include "host/geometry/astra_geometry.hpp"

#include <fmt/format.h>

#include "host/geometry/description.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 cross_of(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot_of(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Source, middle of the detector, step of a column and of a row. A point is source + t (middle + a u + b v -
// source) with (t a, t b, t) = [u v middle-source]^-1 (point - source).
ViewMatrix vector_view(const double* values, const StackShape& stack, const std::string& where,
                       std::int64_t view) {
  const auto vector = [&](std::size_t i) {
    return Vec3{values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  };
  const Vec3 source = vector(0), u = vector(2), v = vector(3), depth = minus(vector(1), source);
  const std::array<Vec3, 3> rows{cross_of(v, depth), cross_of(depth, u), cross_of(u, v)};
  const double volume = dot_of(u, rows[0]);
  if (!(std::abs(volume) > 0))
    throw FileError(
        fmt::format("{}: view {}: the source lies in the detector's plane, or its columns and "
                    "rows are parallel",
                    where, view));
  // As far as the origin lies towards the detector.
  if (!(-dot_of(source, rows[2]) / volume > 0))
    throw FileError(
        fmt::format("{}: view {}: the isocentre lies on or behind the source's plane", where, view));
  const auto row = [&](std::size_t i) -> std::array<double, 4> {
    const Vec3& r = rows[i];
    return {r[0] / volume, r[1] / volume, r[2] / volume, -dot_of(r, source) / volume};
  };
  const std::array<double, 4> a = row(0), b = row(1), t = row(2);
  ViewMatrix matrix{};
  for (std::size_t j = 0; j < 4; ++j) {
    matrix[0][j] = a[j] + stack.middle_column() * t[j];
    matrix[1][j] = b[j] + stack.middle_row() * t[j];
    matrix[2][j] = t[j];
  }
  return checked_view(matrix, where, view);
}

void circular_views(const Description& about, const std::string& where, const StackShape& stack,
                    ConeViews& out) {
  CircularView view;
  view.source_to_axis = about.positive("DistanceOriginSource");
  const double behind = about.number("DistanceOriginDetector");
  if (!(behind >= 0))
    about.fail(fmt::format("'DistanceOriginDetector' is {}; it must not be negative", behind));
  view.source_to_detector = out.source_to_detector = view.source_to_axis + behind;
  view.pitch_u = about.positive("DetectorSpacingX");
  view.pitch_v = about.positive("DetectorSpacingY");
  view.center = stack.middle_column();
  view.row = stack.middle_row();
  const std::vector<double> angles = about.numbers("ProjectionAngles");
  require_views(where, "ProjectionAngles", static_cast<std::int64_t>(angles.size()), stack);
  for (std::size_t k = 0; k < angles.size(); ++k) {
    view.theta_rad = angles[k];
    out.views.push_back(checked_view(view, where, static_cast<std::int64_t>(k)));
  }
}

}  // namespace

ConeViews astra_geometry(const std::filesystem::path& path, const StackShape& stack) {
  const Description about(
      path, {"type", "DetectorSpacingX", "DetectorSpacingY", "DetectorRowCount", "DetectorColCount",
             "ProjectionAngles", "DistanceOriginSource", "DistanceOriginDetector", "Vectors"});
  const std::string where = path.string(), type = about.has("type") ? about.text("type") : "";
  if (type != "cone" && type != "cone_vec")
    about.fail(fmt::format("'type' is '{}'; 'cone' and 'cone_vec' can be read", type));
  require_detector(where, about.integer("DetectorColCount"), about.integer("DetectorRowCount"), stack);
  ConeViews out;
  out.center_source = "file";
  if (type == "cone") {
    circular_views(about, where, stack, out);
    out.notes.emplace_back("ASTRA's rows are taken in the stack's order, [view][row][column]");
    return out;
  }
  const std::vector<double> vectors = about.table("Vectors", 12);
  require_views(where, "Vectors", static_cast<std::int64_t>(vectors.size() / 12), stack);
  for (std::int64_t k = 0; k < stack.views; ++k)
    out.views.push_back(vector_view(vectors.data() + 12 * k, stack, where, k));
  out.notes.emplace_back("ASTRA's rows are taken in the stack's order, [view][row][column]");
  return out;
}

}  // namespace vdvr::io
