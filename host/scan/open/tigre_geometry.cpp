// TIGRE's members by its Python names, pairs in the order v, u. At angle 0 its source lies at +x, its columns
// run along +y and its stored rows along +z: our view at 90 degrees. `COR` moves source and detector together
// along the columns.
#include "host/scan/open/tigre_geometry.hpp"

#include <fmt/format.h>

#include <numbers>

#include "host/scan/geometry/description.hpp"

namespace vdvr::io {
namespace {

// One value for each view: of a number, or of a list of `views` numbers.
std::vector<double> by_view(const Description& about, const std::string& key, const StackShape& stack) {
  const auto views = static_cast<std::size_t>(stack.views);
  if (!about.has(key) || !about.is_list(key)) return std::vector<double>(views, about.number(key));
  const std::vector<double> all = about.numbers(key);
  if (all.size() != views)
    about.fail(fmt::format("{} has {} values for {} projections", about.quoted(key), all.size(), views));
  return all;
}

// The same of a list of `width` numbers or of lists of them; [view][width].
std::vector<double> rows_by_view(const Description& about, const std::string& key, std::size_t width,
                                 const StackShape& stack) {
  const auto views = static_cast<std::size_t>(stack.views);
  std::vector<double> out;
  if (!about.has(key)) return std::vector<double>(views * width, 0.0);
  if (about.is_table(key)) {
    out = about.table(key, width);
    if (out.size() != views * width)
      about.fail(
          fmt::format("{} has {} values for {} projections", about.quoted(key), out.size() / width, views));
    return out;
  }
  const std::vector<double> one = about.numbers(key);
  if (one.size() != width) about.fail(fmt::format("{} must hold {} numbers", about.quoted(key), width));
  for (std::size_t k = 0; k < views; ++k) out.insert(out.end(), one.begin(), one.end());
  return out;
}

// Radians about the axis of rotation; angles about two more axes must be 0.
std::vector<double> tigre_angles(const Description& about, const StackShape& stack) {
  if (!about.has("angles") || !about.is_table("angles")) {
    const std::vector<double> angles = about.numbers("angles");
    if (static_cast<std::int64_t>(angles.size()) != stack.views)
      about.fail(fmt::format("'angles' has {} values for {} projections", angles.size(), stack.views));
    return angles;
  }
  const std::vector<double> all = rows_by_view(about, "angles", 3, stack);
  std::vector<double> out;
  for (std::size_t i = 0; i < all.size(); i += 3) {
    if (all[i + 1] != 0 || all[i + 2] != 0)
      about.fail(fmt::format("'angles': entry {} turns about more than the axis of rotation; give 'matrices'",
                             i / 3));
    out.push_back(all[i]);
  }
  return out;
}

void require_plain(const Description& about, const StackShape& stack) {
  if (about.has("mode") && about.text("mode") != "cone")
    about.fail(fmt::format("'mode' is '{}'; 'cone' can be read", about.text("mode")));
  for (const double angle : rows_by_view(about, "rotDetector", 3, stack))
    if (angle != 0)
      about.fail(
          fmt::format("'rotDetector' holds {}; turned detectors are not read from TIGRE's geometry: give "
                      "'matrices'",
                      angle));
}

}  // namespace

ConeViews tigre_geometry(const std::filesystem::path& path, const StackShape& stack) {
  const Description about(
      path, {"mode", "DSD", "DSO", "nDetector", "dDetector", "sDetector", "offDetector", "rotDetector", "COR",
             "angles", "nVoxel", "sVoxel", "dVoxel", "offOrigin", "accuracy"});
  require_plain(about, stack);
  const std::vector<double> count = about.numbers("nDetector"), side = about.numbers("dDetector");
  if (count.size() != 2 || side.size() != 2) about.fail("'nDetector' and 'dDetector' must hold [v, u]");
  if (count[0] != static_cast<double>(stack.rows) || count[1] != static_cast<double>(stack.columns))
    about.fail(fmt::format("'nDetector' is [{}, {}], but the projections have {} rows x {} columns", count[0],
                           count[1], stack.rows, stack.columns));
  const auto sdd = by_view(about, "DSD", stack), sid = by_view(about, "DSO", stack),
             angles = tigre_angles(about, stack), offsets = rows_by_view(about, "offDetector", 2, stack),
             shift =
                 about.has("COR") ? by_view(about, "COR", stack) : std::vector<double>(angles.size(), 0.0);
  require_radians(path.string(), "'angles'", angles);
  ConeViews out;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    CircularView view;
    view.theta_rad = angles[k] + 0.5 * std::numbers::pi;
    view.source_to_axis = sid[k];
    view.source_to_detector = sdd[k];
    view.pitch_u = side[1];
    view.pitch_v = side[0];
    view.center = stack.middle_column();
    view.row = stack.middle_row();
    view.source_offset_u = shift[k];
    view.detector_offset_u = shift[k] + offsets[2 * k + 1];
    view.detector_offset_v = offsets[2 * k];
    out.views.push_back(checked_view(view, path.string(), static_cast<std::int64_t>(k)));
    out.source_to_detector = k == 0 || out.source_to_detector == sdd[k] ? sdd[k] : 0;
  }
  out.center_source = "file";
  out.unit = "mm";
  out.notes.emplace_back("TIGRE's angles are assumed to be radians, its pairs in Python's order v, u");
  return out;
}

}  // namespace vdvr::io
