// Angles and cone-beam geometry of a scan.json; see scan_members.hpp.
#include "host/scan/open/scan_members.hpp"

#include <fmt/format.h>

#include "host/files/io/raster_file.hpp"
#include "host/scan/open/astra_geometry.hpp"
#include "host/scan/open/cil_geometry.hpp"
#include "host/scan/open/circular_geometry.hpp"
#include "host/scan/open/leap_geometry.hpp"
#include "host/scan/open/matrix_geometry.hpp"
#include "host/scan/open/nikon_geometry.hpp"
#include "host/scan/open/rtk_geometry.hpp"
#include "host/scan/open/tigre_geometry.hpp"
#include "host/scan/raw/name_angles.hpp"
#include "host/scan/raw/raster_scan.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

// Names that tell views apart.
std::vector<std::string> names_of_views(const RawScan& scan) {
  return scan.shared_files ? std::vector<std::string>{} : scan.view_files;
}

std::vector<double> angles_of(const Description& about, const Description& root, RawScan& scan) {
  if (about.is_list("angles")) return in_degrees(about.numbers("angles"), scan.angle_unit);
  const std::string name = about.text("angles");
  std::error_code error;
  if (name == "names" && !fs::exists(root.inside(name, "angles"), error)) {
    std::string why;
    const auto found = angles_in_names(names_of_views(scan), why);
    if (found.empty())
      about.fail(fmt::format("{} are to be taken from the names of the projections, but {}",
                             about.quoted("angles"), why));
    return in_degrees(found, scan.angle_unit);
  }
  auto angles = read_numbers(root.inside(name, "angles"));
  use_file(scan, root, name);
  return in_degrees(std::move(angles), scan.angle_unit);
}

// Names that hold an angle say the same as the angles.
void require_names(const Description& about, const RawScan& scan, const std::vector<double>& angles) {
  if (const std::string wrong = names_against(names_of_views(scan), angles); !wrong.empty())
    about.fail(wrong);
}

// Of `geometry`: its own angles, else those of scan.json, else those of the HDF5 file.
std::vector<double> circular_angles(const Description& about, const Description& geometry, RawScan& scan) {
  if (about.has("angle_range") && !about.has("angles")) about.fail("'angle_range' needs 'angles'");
  std::vector<double> outer;
  if (about.has("angles")) outer = listed_angles(about, scan);
  if (!geometry.has("angles")) {
    if (about.has("angles")) return outer;
    if (scan.theta_deg.empty())
      about.fail("'geometry.angles' is missing: a file of degrees, or a list; one angle for each projection");
    return scan.theta_deg;
  }
  const std::vector<double> angles = angles_of(geometry, about, scan);
  require_names(about, scan, angles);
  if (about.has("angles") && outer.size() != angles.size())
    about.fail(fmt::format("'angles' gives {} angles, 'geometry.angles' {}; leave one of them out",
                           outer.size(), angles.size()));
  return angles;
}

// The one stack that 'projections' must be, whose pixels lie in space.
RasterHeader placed_stack(const Description& about) {
  const auto names = about.has("projections") ? about.matches("projections") : std::vector<std::string>{};
  if (names.size() != 1 || !is_raster_file(about.folder() / names.front()))
    about.fail(
        "'rtk_geometry' needs one MetaImage stack (.mha, .mhd) as 'projections': its Offset and "
        "ElementSpacing place the pixels");
  const RasterHeader header = read_raster_header(about.folder() / names.front());
  if (header.format != "mha")
    about.fail(fmt::format(
        "'projections' is {}; with 'rtk_geometry' the stack must be MetaImage (.mha, .mhd)", header.format));
  return header;
}

ConeViews read_geometry(const Description& about, const std::string& kind, RawScan& scan) {
  const StackShape stack{scan.projections.count, scan.rows, scan.columns};
  if (kind == "geometry") {
    const Description geometry = circular_description(about);
    if (geometry.has("center") && about.has("center"))
      about.fail("'center' and 'geometry.center' both name the axis' column; leave one of them out");
    return circular_geometry(geometry, stack, circular_angles(about, geometry, scan));
  }
  for (const char* key : {"angles", "angle_range"})
    if (about.has(key))
      about.fail(fmt::format("'{}' contradicts '{}', which brings its own; leave it out", key, kind));
  if (kind == "beam") return std::move(scan.cone->geometry);
  const std::string name = about.text(kind);
  const fs::path path = about.inside(name, kind);
  use_file(scan, about, name);
  if (kind == "matrices") return matrix_geometry(path, stack);
  if (kind == "rtk_geometry") return rtk_geometry(path, placed_stack(about), stack);
  if (kind == "nikon") return nikon_geometry(read_nikon(path), stack);
  if (kind == "astra") return astra_geometry(path, stack);
  if (kind == "tigre") return tigre_geometry(path, stack);
  if (kind == "cil") return cil_geometry(path, stack);
  return leap_geometry(path, stack);
}

// Lengths of a geometry are in the unit that scan.json names, else that of its format or of the projections.
void choose_unit(const Description& about, RawScan& scan) {
  ConeViews& geometry = scan.cone->geometry;
  if (about.has("unit")) return;
  if (!geometry.unit.empty()) {
    scan.unit = geometry.unit;
  } else if (!about.has("hdf5") && scan.unit == "pixel") {
    scan.unit = "mm";
    geometry.notes.emplace_back("the unit of lengths is assumed to be mm; 'unit' names another");
  }
}

}  // namespace

std::optional<std::string> cone_kind(const Description& about) {
  std::optional<std::string> found;
  for (const char* kind : cone_kinds) {
    if (!about.has(kind)) continue;
    if (found)
      about.fail(
          fmt::format("'{}' and '{}' both describe the geometry; leave one of them out", *found, kind));
    found = kind;
  }
  return found;
}

void use_file(RawScan& scan, const Description& about, const std::string& name) {
  scan.files.emplace_back(name, about.folder() / name);
}

std::vector<double> listed_angles(const Description& about, RawScan& scan) {
  std::vector<double> angles = angles_of(about, about, scan);
  if (about.has("angle_range")) {
    const auto [first, end] =
        about.half_open("angle_range", static_cast<std::int64_t>(angles.size()), "angles");
    angles = {angles.begin() + first, angles.begin() + end};
  }
  require_names(about, scan, angles);
  return angles;
}

void set_cone(const Description& about, const std::string& kind, RawScan& scan) {
  if (about.has("pitch"))
    about.fail(
        fmt::format("'pitch' is that of parallel beam; '{}' brings its own (in 'geometry' it is a "
                    "member of that object)",
                    kind));
  // An HDF5 file's centre is that of parallel beam; --center and scan.json's move the axis.
  if (!about.has("center")) scan.center.reset();
  RawCone cone;
  cone.member = kind;
  if (about.has("redundancy")) {
    cone.redundancy = redundancy_of(about.text("redundancy"));
    if (!cone.redundancy)
      about.fail(
          fmt::format("'redundancy' is \"{}\"; it must be \"full-turn\", \"short-scan\" or "
                      "\"displaced\"",
                      about.text("redundancy")));
  }
  cone.geometry = read_geometry(about, kind, scan);
  scan.cone = std::move(cone);
  scan.theta_deg.clear();
  choose_unit(about, scan);
  const auto& notes = scan.cone->geometry.notes;
  scan.notes.insert(scan.notes.end(), notes.begin(), notes.end());
}

}  // namespace vdvr::io
