// ASTRA's dictionaries. Its world has the axis of rotation along z, its rows run along +z, and at angle 0 the
// source lies at -y: as ours. Its detector is centred on the ray through the axis.
#include "host/scan/open/astra_geometry.hpp"

#include <fmt/format.h>

#include "host/scan/geometry/description.hpp"

namespace vdvr::io {
namespace {

// Twelve numbers: source, middle of the detector, step of a column and of a row.
DetectorVectors vectors_of(const double* values) {
  const auto vector = [&](std::size_t i) {
    return Vec3{values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  };
  return {vector(0), vector(1), vector(2), vector(3)};
}

void astra_circular_views(const Description& about, const std::string& where, const StackShape& stack,
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
  require_radians(where, "ProjectionAngles", angles);
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
    astra_circular_views(about, where, stack, out);
    out.notes.emplace_back("ASTRA's rows are taken in the stack's order, [view][row][column]");
    return out;
  }
  const std::vector<double> vectors = about.table("Vectors", 12);
  require_views(where, "Vectors", static_cast<std::int64_t>(vectors.size() / 12), stack);
  for (std::int64_t k = 0; k < stack.views; ++k)
    out.views.push_back(checked_view(vectors_of(vectors.data() + 12 * k), stack, where, k));
  out.notes.emplace_back("ASTRA's rows are taken in the stack's order, [view][row][column]");
  return out;
}

}  // namespace vdvr::io
