// vdvr residual: what was measured less what F has along the ray, and which rays no interpolation explains.
#include "vdvr/expert/residual_picture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

/// FIRST,LAST or one row, of the prepared projections.
ResidualOptions rows_option(const Arguments& args) {
  ResidualOptions options;
  options.max_memory_bytes = common_options(args).max_memory;
  if (!args.has("rows")) return options;
  const auto rows = args.numbers("rows", 0).value();
  const double first = rows.front(), last = rows.back();
  constexpr double most = 1 << 30;
  if (rows.size() > 2 || !(first >= 0 && last >= first && last < most) || first != std::floor(first) ||
      last != std::floor(last))
    throw InputError(fmt::format("--rows: '{}' is not FIRST,LAST or one row", args.text("rows")));
  options.first_row = static_cast<std::int64_t>(first);
  options.rows = static_cast<std::int64_t>(last - first) + 1;
  return options;
}

struct Outputs {
  fs::path values, picture;  ///< empty: not wanted
};

Outputs outputs_of(const Arguments& args, bool force, const std::vector<fs::path>& inputs) {
  Outputs out;
  const fs::path output = args.path("output");
  if (output.extension() == ".png") {
    refuse(args, {"picture"}, "is a second output; --output is a picture already");
    out.picture = output;
  } else {
    if (!is_residual_path(output))
      throw InputError(fmt::format("{}: end the name in .h5, .npy, .mha, .nrrd or .png", output.string()));
    out.values = output;
    if (args.has("picture")) {
      out.picture = args.path("picture");
      if (out.picture.extension() != ".png")
        throw InputError(fmt::format("{}: write the picture as .png", out.picture.string()));
    }
  }
  for (const fs::path& path : {out.values, out.picture})
    if (!path.empty()) check_output(path, force, inputs);
  return out;
}

double share(std::int64_t part, std::int64_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0;
}

Json line_json(const ResidualLine& line, double median) {
  return {{"index", line.index}, {"rays", line.rays},
          {"rms", line.rms},     {"times_median", median > 0 ? Json(line.rms / median) : Json()},
          {"mean", line.mean},   {"unexplained", share(line.beyond, line.rays)}};
}

Json summary_json(const Residual& r, const ResidualSummary& s) {
  Json worst = nullptr;
  if (s.worst[0] >= 0) {
    const std::size_t at = r.index(s.worst[0], s.worst[1], s.worst[2]);
    worst = {{"view", s.worst[0]}, {"row", s.worst[1]}, {"column", s.worst[2]},
             {"lo", r.lo[at]},     {"hi", r.hi[at]},    {"reach", r.reach[at]}};
  }
  Json views = Json::array(), columns = Json::array();
  for (const ResidualLine& line : s.views) views.push_back(line.rms);
  for (const ResidualLine& line : s.columns) columns.push_back(line.rms);
  return {{"rays", s.rays},
          {"compared", s.compared},
          {"unexplained", share(s.beyond_interpolation, s.compared)},
          {"unexplained_rays", s.beyond_interpolation},
          {"beyond_field", share(s.beyond_field, s.compared)},
          {"rms", s.rms},
          {"measured_rms", s.measured_rms},
          {"largest_width", s.width},
          {"largest_excess", s.largest_excess},
          {"worst_ray", worst},
          {"worst_view", line_json(s.worst_view, s.median_view_rms)},
          {"worst_column", line_json(s.worst_column, s.median_column_rms)},
          {"at_edge", s.at_edge},
          {"view_rms", views},
          {"column_rms", columns}};
}

void print_line(const char* what, const ResidualLine& line, double median, const std::string& more) {
  fmt::print("{:<15}{}{}: rms {:.3g}, {:.1f} times the median; mean {:+.3g}; {:.1f} % unexplained\n", what,
             line.index, more, line.rms, median > 0 ? line.rms / median : 0, line.mean,
             100 * share(line.beyond, line.rays));
}

void print_summary(const Residual& r, const ResidualSummary& s, const Outputs& outputs) {
  fmt::print("rows           {} to {}, {} rays, of which {} cross the covered region\n", r.first_row,
             r.first_row + r.rows - 1, s.rays, s.compared);
  fmt::print("residual       rms {:.3g} of {:.3g} measured; proved to {:.2g}\n", s.rms, s.measured_rms,
             s.width);
  fmt::print(
      "unexplained    {:.2f} % of the rays: no field within the certificate's bounds of F has what was "
      "measured\n",
      100 * share(s.beyond_interpolation, s.compared));
  if (s.worst[0] >= 0) {
    const std::size_t at = r.index(s.worst[0], s.worst[1], s.worst[2]);
    fmt::print("worst ray      view {}, row {}, column {}: {:+.4g}, where interpolation explains {:.2g}\n",
               s.worst[0], s.worst[1], s.worst[2], r.middle(at), r.reach[at]);
  }
  print_line(
      "worst view", s.worst_view, s.median_view_rms,
      fmt::format(" ({:.2f} degrees)", r.geometry.theta_rad[static_cast<std::size_t>(s.worst_view.index)] *
                                           180 / std::numbers::pi));
  print_line("worst column", s.worst_column, s.median_column_rms, "");
  if (s.at_edge > 0.05)
    fmt::print(
        "at the edge    up to {:.0f} % of the largest value: parts of the object may lie beyond what is "
        "covered, and are in the residual\n",
        100 * s.at_edge);
  for (const fs::path& path : {outputs.values, outputs.picture})
    if (!path.empty()) fmt::print("written        {}\n", path.string());
}

}  // namespace

int residual_command(Arguments& args) {
  args.positional("SCAN", "the projections that FILE was built from, of parallel beam")
      .positional("FILE",
                  "the certified volume: it says what F is, and how far interpolation may lie from it")
      .value(
          "output,o", "OUT",
          "lo, hi and reach of every ray as .h5 or .npy, the middles as .mha or .nrrd, or a picture as .png")
      .value("picture", "PNG", "the picture beside it")
      .value("rows", "FIRST,LAST", "rows of the detector, or one row (default all)")
      .value("picture-row", "R", "row in the picture (default the middle one of them)");
  add_scan(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const fs::path projections = args.path("SCAN"), path = args.path("FILE");
  const Outputs outputs = outputs_of(args, common.force, {projections, path});
  const ResidualOptions options = rows_option(args);
  if (outputs.picture.empty()) refuse(args, {"picture-row"}, "is for the picture, which --picture asks for");
  require_certified(path, args);

  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = open_certified(path, args);
  const ProjectionSet scan = load_certified_scan(projections, args, file.certificate, progress.callback());
  check_projections(projections, scan, file.certificate);
  const Residual result = residual(scan, file.volume, file.certificate, options, progress.callback());
  const ResidualSummary summary = summary_of(result, scan);
  const std::int64_t last = result.first_row + result.rows - 1,
                     row = args.integer_or("picture-row", result.first_row + result.rows / 2,
                                           result.first_row, last);
  const std::string caption = fmt::format("{}, row {}: measured less integral of F", scan.report.name, row);
  Image picture;
  if (!outputs.picture.empty()) picture = residual_picture(result, summary, row, caption);
  throw_if_stopped();
  if (!outputs.values.empty()) write_residual(outputs.values, result);
  if (!outputs.picture.empty()) write_png(outputs.picture, picture);
  progress.clear();

  Json json = {{"scan", projections.string()},
               {"file", path.string()},
               {"output", args.text("output")},
               {"picture", outputs.picture.empty() ? Json() : Json(outputs.picture.string())},
               {"rows", {result.first_row, last}},
               {"epsilon_abs", file.certificate.epsilon_abs}};
  json.update(summary_json(result, summary));
  json["seconds"] = seconds_json(progress.seconds());
  print_result(common, json, [&] { print_summary(result, summary, outputs); });
  return 0;
}

}  // namespace vdvr::cli
