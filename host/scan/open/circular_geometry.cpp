// Circular scans as scan.json describes them (docs/inputs.md, "Cone beam"). Angles and signs are RTK's
// gantry, in-plane and out-of-plane angles, and its projection offsets.
#include "host/scan/open/circular_geometry.hpp"

#include <fmt/format.h>

#include <tuple>
#include "host/base/system/casts.hpp"

namespace vdvr::io {
namespace {

int sense_of(const Description& about, std::vector<std::string>& notes) {
  if (!about.has("sense")) {
    notes.push_back(
        "sense of rotation assumed: angles grow from x to y ('geometry.sense': -1 turns the other way)");
    return 1;
  }
  const double sense = about.number("sense");
  if (sense != 1 && sense != -1)
    about.fail(fmt::format("{} is {}; it must be 1 or -1", about.quoted("sense"), sense));
  return sense > 0 ? 1 : -1;
}

}  // namespace

Description circular_description(const Description& scan) {
  return scan.member("geometry", {"source_to_axis", "source_to_detector", "pitch", "center", "row", "angles",
                                  "tilt", "sense", "offset_u", "offset_v"});
}

ConeViews circular_geometry(const Description& about, const StackShape& stack,
                            const std::vector<double>& theta_deg) {
  ConeViews out;
  const std::string where = (about.folder() / "scan.json").string() + ": 'geometry'";
  require_views(where, "angles", static_cast<std::int64_t>(theta_deg.size()), stack);
  CircularView view;
  view.source_to_axis = about.positive("source_to_axis");
  view.source_to_detector = about.positive("source_to_detector");
  std::tie(view.pitch_u, view.pitch_v) = about.pair("pitch");
  view.center = about.number_or("center", stack.middle_column());
  view.row = about.number_or("row", stack.middle_row());
  view.detector_offset_u = about.number_or("offset_u", 0);
  view.detector_offset_v = about.number_or("offset_v", 0);
  if (about.has("tilt")) {
    if (!about.is_list("tilt")) about.fail(about.quoted("tilt") + " must be [in plane, out of plane]");
    const auto [in_plane, out_of_plane] = about.pair("tilt");
    view.in_plane_rad = in_plane * radians_per_degree;
    view.out_of_plane_rad = out_of_plane * radians_per_degree;
  }
  const int sense = sense_of(about, out.notes);
  std::vector<double> theta_rad;
  for (const double theta : theta_deg) theta_rad.push_back(theta * radians_per_degree);
  require_radians(where, "angles", theta_rad, not_radians);
  for (std::size_t k = 0; k < theta_rad.size(); ++k) {
    view.theta_rad = sense * theta_rad[k];
    out.views.push_back(checked_view(view, where, static_cast<std::int64_t>(k)));
  }
  out.source_to_detector = view.source_to_detector;
  out.center_source = about.has("center") || about.has("offset_u") ? "file" : "default";
  if (out.center_source == "default")
    out.notes.push_back(
        fmt::format("the axis is assumed at the detector's middle column, {}; give 'geometry.center' or "
                    "`center` where it "
                    "is elsewhere",
                    view.center));
  if (!about.has("row") && !about.has("offset_v"))
    out.notes.push_back(
        fmt::format("the source's plane is assumed at the detector's middle row, {}", view.row));
  return out;
}

}  // namespace vdvr::io
