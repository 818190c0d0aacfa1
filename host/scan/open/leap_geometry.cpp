// LEAP's members by the names of its Python arguments, lengths in mm, `phis` in degrees. LEAP takes 90
// degrees off `phis`, so that at 0 its source lies at -y, its columns run along +x and its rows along +z: as
// ours. `tau` moves source and detector together against the columns.
#include "host/scan/open/leap_geometry.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "host/base/system/casts.hpp"
#include "host/base/system/lower.hpp"
#include "host/scan/geometry/description.hpp"
#include "host/scan/geometry/vectors.hpp"

namespace vdvr::io {
namespace {

const std::set<std::string> members_of_leap{
    "geometry",      "numAngles",       "numRows",   "numCols",      "pixelHeight", "pixelWidth",
    "centerRow",     "centerCol",       "phis",      "angularRange", "sod",         "sdd",
    "tau",           "helicalPitch",    "tiltAngle", "detectorType", "rowVectors",  "colVectors",
    "moduleCenters", "sourcePositions", "numX",      "numY",         "numZ",        "voxelWidth",
    "voxelHeight",   "offsetX",         "offsetY",   "offsetZ"};
const std::set<std::string> modular_members{"rowVectors", "colVectors", "moduleCenters", "sourcePositions"};
const std::set<std::string> circular_members{"centerRow", "centerCol", "phis",         "angularRange", "sod",
                                             "sdd",       "tau",       "helicalPitch", "tiltAngle"};

// Whether it is modular beam; throws for what is neither that nor a flat circular scan.
bool is_modular(const Description& about) {
  const bool vectors = about.has("sourcePositions");
  const std::string stated = about.has("geometry") ? lower(about.text("geometry"))
                             : vectors             ? "modular"
                                                   : "cone";
  if (stated != "cone" && stated != "modular")
    about.fail(fmt::format("'geometry' is '{}'; 'CONE' and 'MODULAR' can be read", about.text("geometry")));
  if (about.has("detectorType") && lower(about.text("detectorType")) != "flat")
    about.fail(
        fmt::format("'detectorType' is '{}'; only flat detectors can be read", about.text("detectorType")));
  if (const double pitch = about.number_or("helicalPitch", 0); pitch != 0)
    about.fail(fmt::format("'helicalPitch' is {}; helical scans are not supported", pitch));
  const bool modular = stated == "modular";
  for (const std::string& key : modular ? circular_members : modular_members)
    if (about.has(key) && key != "helicalPitch")
      about.fail(
          fmt::format("'{}' has no place in {} beam; leave it out", key, modular ? "modular" : "cone"));
  return modular;
}

// Degrees: a list, or the range over which numAngles are spread as setAngleArray does it.
std::vector<double> leap_angles(const Description& about, const StackShape& stack) {
  if (about.has("phis") == about.has("angularRange")) about.fail("needs one of 'phis' and 'angularRange'");
  if (about.has("phis") && about.is_list("phis")) {
    std::vector<double> angles = about.numbers("phis");
    if (static_cast<std::int64_t>(angles.size()) != stack.views)
      about.fail(fmt::format("'phis' has {} values for {} projections", angles.size(), stack.views));
    return angles;
  }
  const double range = about.number(about.has("phis") ? "phis" : "angularRange");
  std::vector<double> angles;
  for (std::int64_t k = 0; k < stack.views; ++k)
    angles.push_back(static_cast<double>(k) * range / static_cast<double>(stack.views));
  return angles;
}

// A view at angle 0 and without a shift, turned by `tilt` about the ray through the detector's (center, row).
void leap_circular_views(const Description& about, const std::string& where, const StackShape& stack,
                         ConeViews& out) {
  const double sod = about.positive("sod"), sdd = about.positive("sdd"), tau = about.number_or("tau", 0),
               tilt = about.number_or("tiltAngle", 0) * radians_per_degree,
               width = about.positive("pixelWidth"), height = about.positive("pixelHeight");
  // From where the ray at right angles hits the detector to its middle.
  const double across = width * (stack.middle_column() - about.number("centerCol")),
               along = height * (stack.middle_row() - about.number("centerRow"));
  const std::vector<double> angles = leap_angles(about, stack);
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const double s = std::sin(angles[k] * radians_per_degree), c = std::cos(angles[k] * radians_per_degree);
    const Vec3 column{c, s, 0}, away{s, -c, 0};
    DetectorVectors d;
    const Vec3 u{column[0] * std::cos(tilt), column[1] * std::cos(tilt), std::sin(tilt)},
        v{-column[0] * std::sin(tilt), -column[1] * std::sin(tilt), std::cos(tilt)};
    d.source = sum(scaled(away, sod), scaled(column, -tau));
    d.middle =
        sum(sum(scaled(away, sod - sdd), scaled(column, -tau)), sum(scaled(u, across), scaled(v, along)));
    d.along_u = scaled(u, width);
    d.along_v = scaled(v, height);
    out.views.push_back(checked_view(d, stack, where, static_cast<std::int64_t>(k)));
  }
  out.source_to_detector = sdd;
}

Vec3 unit_vector(const Description& about, const std::string& key, const double* values, std::size_t view) {
  const Vec3 vector{values[0], values[1], values[2]};
  constexpr double same = 1e-3;  // LEAP keeps them as float32, users write a few digits
  if (!(std::abs(length(vector) - 1) <= same))
    about.fail(fmt::format("{}: entry {} has the length {}; LEAP's are unit vectors", about.quoted(key), view,
                           length(vector)));
  return scaled(vector, 1 / length(vector));
}

void modular_views(const Description& about, const std::string& where, const StackShape& stack,
                   ConeViews& out) {
  const double width = about.positive("pixelWidth"), height = about.positive("pixelHeight");
  const auto positions = [&](const std::string& key) {
    std::vector<double> all = about.table(key, 3);
    if (static_cast<std::int64_t>(all.size()) != 3 * stack.views)
      about.fail(fmt::format("'{}' has {} entries for {} projections", key, all.size() / 3, stack.views));
    return all;
  };
  const auto sources = positions("sourcePositions"), middles = positions("moduleCenters"),
             rows = positions("rowVectors"), columns = positions("colVectors");
  for (std::size_t k = 0; k < static_cast<std::size_t>(stack.views); ++k) {
    const auto vector = [k](const std::vector<double>& all) {
      return Vec3{all[3 * k], all[3 * k + 1], all[3 * k + 2]};
    };
    const DetectorVectors d{vector(sources), vector(middles),
                            scaled(unit_vector(about, "colVectors", columns.data() + 3 * k, k), width),
                            scaled(unit_vector(about, "rowVectors", rows.data() + 3 * k, k), height)};
    out.views.push_back(checked_view(d, stack, where, static_cast<std::int64_t>(k)));
  }
}

}  // namespace

ConeViews leap_geometry(const std::filesystem::path& path, const StackShape& stack) {
  const Description about(path, members_of_leap);
  const std::string where = path.string();
  const bool modular = is_modular(about);
  require_detector(where, about.integer("numCols"), about.integer("numRows"), stack);
  if (about.has("numAngles")) require_views(where, "angles ('numAngles')", about.integer("numAngles"), stack);
  ConeViews out;
  out.center_source = "file";
  out.unit = "mm";
  if (modular) modular_views(about, where, stack, out);
  else leap_circular_views(about, where, stack, out);
  out.notes.emplace_back(modular
                             ? "LEAP's rowVectors point from row to row, its colVectors from column to column"
                             : "LEAP's phis are assumed to be degrees, at 0 with the source at -y");
  return out;
}

}  // namespace vdvr::io
