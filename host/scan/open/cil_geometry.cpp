// CIL's members by the names of its Python arguments (create_Cone3D, set_panel, set_angles). Its source and
// detector stand and the object turns by +angle about the axis, so that in the object's frame, which is ours,
// they turn by -(initial_angle + angle): its plugin for ASTRA does the same. With the default directions its
// detector is our view at angle 0.
#include "host/scan/open/cil_geometry.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "host/scan/geometry/description.hpp"
#include "host/scan/geometry/vectors.hpp"

namespace vdvr::io {
namespace {

using Rotation = std::array<Vec3, 3>;  // its rows

Vec3 vector_or(const Description& about, const std::string& key, const Vec3& fallback) {
  if (!about.has(key)) return fallback;
  const std::vector<double> all = about.numbers(key);
  if (all.size() != 3) about.fail(fmt::format("{} must hold three numbers, [x, y, z]", about.quoted(key)));
  return {all[0], all[1], all[2]};
}

Vec3 position(const Description& about, const std::string& key) {
  if (!about.has(key)) about.fail(fmt::format("{} is missing; it must be [x, y, z]", about.quoted(key)));
  return vector_or(about, key, {});
}

// CIL, too, takes directions of any length.
Vec3 direction_or(const Description& about, const std::string& key, const Vec3& fallback) {
  const Vec3 vector = vector_or(about, key, fallback);
  const double norm = length(vector);
  if (!(norm > 0) || !std::isfinite(norm)) about.fail(fmt::format("{} has no direction", about.quoted(key)));
  return scaled(vector, 1 / norm);
}

Vec3 rotated(const Rotation& r, const Vec3& a) { return {dot(r[0], a), dot(r[1], a), dot(r[2], a)}; }

// The shortest rotation that brings a unit vector to +z; half a turn about x for -z.
Rotation to_z(const Vec3& a) {
  if (a[0] == 0 && a[1] == 0) return {Vec3{1, 0, 0}, {0, a[2], 0}, {0, 0, a[2]}};
  // Either is 1 / (1 + a[2]); this one does not cancel.
  const double part = a[2] > 0 ? 1 / (1 + a[2]) : (1 - a[2]) / (a[0] * a[0] + a[1] * a[1]);
  return {Vec3{1 - part * a[0] * a[0], -part * a[0] * a[1], -a[0]},
          {-part * a[0] * a[1], 1 - part * a[1] * a[1], -a[1]},
          {a[0], a[1], a[2]}};
}

// The rotation about z that brings a vector over +y; nothing for one along z.
Rotation to_y(const Vec3& a) {
  const double norm = std::hypot(a[0], a[1]);
  if (!(norm > 0)) return {Vec3{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  return {Vec3{a[1] / norm, -a[0] / norm, 0}, {a[0] / norm, a[1] / norm, 0}, {0, 0, 1}};
}

Rotation about_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {Vec3{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
}

DetectorVectors rotated(const Rotation& r, const DetectorVectors& d) {
  return {rotated(r, d.source), rotated(r, d.middle), rotated(r, d.along_u), rotated(r, d.along_v)};
}

// As CIL stands before anything turns: the axis along +z through the origin, the detector behind it along +y.
DetectorVectors standing(const Description& about) {
  const Vec3 axis = vector_or(about, "rotation_axis_position", {0, 0, 0});
  DetectorVectors d;
  d.source = sum(position(about, "source_position"), scaled(axis, -1));
  d.middle = sum(position(about, "detector_position"), scaled(axis, -1));
  d.along_u = direction_or(about, "detector_direction_x", {1, 0, 0});
  d.along_v = direction_or(about, "detector_direction_y", {0, 0, 1});
  d = rotated(to_z(direction_or(about, "rotation_axis_direction", {0, 0, 1})), d);
  d = rotated(to_y(sum(d.middle, scaled(d.source, -1))), d);
  const auto [width, height] = about.has("pixel_size") ? about.pair("pixel_size") : std::pair(1.0, 1.0);
  for (const double side : {width, height})
    if (!(side > 0) || !std::isfinite(side))
      about.fail(fmt::format("'pixel_size' holds {}; it must be positive", side));
  // The corner that is stored first: from 'right' columns run against direction_x, from 'top' rows downwards.
  const std::string origin = about.has("origin") ? about.text("origin") : "bottom-left";
  const bool top = origin.rfind("top-", 0) == 0, right = origin.ends_with("-right");
  if (origin != fmt::format("{}-{}", top ? "top" : "bottom", right ? "right" : "left"))
    about.fail(fmt::format(
        "'origin' is '{}'; it must be 'bottom-left', 'bottom-right', 'top-left' or 'top-right'", origin));
  d.along_u = scaled(d.along_u, right ? -width : width);
  d.along_v = scaled(d.along_v, top ? -height : height);
  return d;
}

void require_plain(const Description& about) {
  if (about.has("geom_type") && about.text("geom_type") != "cone")
    about.fail(
        fmt::format("'geom_type' is '{}'; 'cone' can be read (of other cone beams give each view as "
                    "ASTRA's 'cone_vec', or 'matrices')",
                    about.text("geom_type")));
  if (about.has("num_channels") && about.integer("num_channels") != 1)
    about.fail(fmt::format("'num_channels' is {}; one channel can be read", about.integer("num_channels")));
  if (about.has("dimension_labels") &&
      about.texts("dimension_labels") != std::vector<std::string>{"angle", "vertical", "horizontal"})
    about.fail("'dimension_labels' must be [\"angle\", \"vertical\", \"horizontal\"], the stack's order");
}

double unit_of_angles(const Description& about) {
  const std::string unit = about.has("angle_unit") ? about.text("angle_unit") : "degree";
  if (unit == "degree") return std::numbers::pi / 180;
  if (unit == "radian") return 1;
  about.fail(fmt::format("'angle_unit' is '{}'; it must be 'degree' or 'radian'", unit));
}

}  // namespace

ConeViews cil_geometry(const std::filesystem::path& path, const StackShape& stack) {
  const Description about(path, {"geom_type", "source_position", "detector_position", "detector_direction_x",
                                 "detector_direction_y", "rotation_axis_position", "rotation_axis_direction",
                                 "units", "num_pixels", "pixel_size", "origin", "angles", "initial_angle",
                                 "angle_unit", "num_channels", "dimension_labels"});
  require_plain(about);
  const std::vector<double> count = about.numbers("num_pixels");
  if (count.size() != 2) about.fail("'num_pixels' must hold [horizontal, vertical]");
  if (count[0] != static_cast<double>(stack.columns) || count[1] != static_cast<double>(stack.rows))
    about.fail(fmt::format("'num_pixels' is [{}, {}], but the projections have {} columns x {} rows",
                           count[0], count[1], stack.columns, stack.rows));
  const std::vector<double> angles = about.numbers("angles");
  if (static_cast<std::int64_t>(angles.size()) != stack.views)
    about.fail(fmt::format("'angles' has {} values for {} projections", angles.size(), stack.views));
  const double first = about.number_or("initial_angle", 0), unit = unit_of_angles(about);
  if (unit == 1) require_radians(path.string(), "'angles'", angles, "'angle_unit' says radian");
  const DetectorVectors standing_still = standing(about);
  ConeViews out;
  for (std::size_t k = 0; k < angles.size(); ++k)
    out.views.push_back(checked_view(rotated(about_z(-(first + angles[k]) * unit), standing_still), stack,
                                     path.string(), static_cast<std::int64_t>(k)));
  const Vec3 normal = cross(standing_still.along_u, standing_still.along_v);
  out.source_to_detector =
      std::abs(dot(sum(standing_still.middle, scaled(standing_still.source, -1)), normal)) / length(normal);
  out.center_source = "file";
  if (about.has("units") && about.text("units").rfind("units", 0) != 0) out.unit = about.text("units");
  out.notes.emplace_back(
      "CIL's object is assumed to turn from x to y as its angles grow, so that the source turns the other "
      "way");
  return out;
}

}  // namespace vdvr::io
