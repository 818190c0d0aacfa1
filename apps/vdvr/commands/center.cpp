// vdvr center: the centre that the data tell, how sure that is, and slices around it to look at.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/understood.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/center_sheet.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/find_roll.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr::cli {
namespace {

// From columns of the prepared, and upright, projections to the detector's.
struct DetectorColumns {
  int binning = 1;
  std::int64_t cut = 0;
  [[nodiscard]] double operator()(double center) const {
    return unbinned_center(center + static_cast<double>(cut), binning);
  }
};

Json witness_json(const CenterWitness& w, const DetectorColumns& columns) {
  const int binning = columns.binning;
  return {{"center", columns(w.center)},
          {"uncertainty", w.uncertainty * binning},
          {"quality", w.quality},
          {"method", w.method}};
}

Json found_json(const std::optional<CenterEstimate>& found, const DetectorColumns& columns) {
  if (!found) return nullptr;
  Json json = witness_json(*found, columns);
  json["sure"] = found->sure;
  json["doubt"] = found->doubt;
  json["others"] = Json::array();
  for (const CenterWitness& w : found->others) json["others"].push_back(witness_json(w, columns));
  return json;
}

/// Half a column, or as far as methods differ; without any of them a sixteenth of the detector in all.
double step_of(const std::optional<CenterEstimate>& found, std::int64_t columns, std::int64_t count) {
  const double half = 0.5 * std::ceil(static_cast<double>(columns) / 1024),
               steps = static_cast<double>(count - 1);
  if (!found) return std::max(half, static_cast<double>(columns) / 16 / steps);
  if (found->sure) return half;
  double reach = 4 * found->uncertainty;
  for (const CenterWitness& w : found->others)
    if (w.quality >= 0.5) reach = std::max(reach, 1.25 * std::abs(w.center - found->center));
  return std::max(half, std::min(2 * reach, static_cast<double>(columns) / 8) / steps);
}

struct Search {
  FieldOptions field;
  std::int64_t row = -1, count = 15;
  std::optional<double> step;
};

CenterSheetOptions sheet_of(const ProjectionSet& scan, const std::optional<CenterEstimate>& found,
                            const Search& wanted) {
  const int binning = wanted.field.preparation.binning;
  const DetectorColumns columns{binning, scan.geometry.extension.cut};
  const double middle = wanted.field.center ? *wanted.field.center - static_cast<double>(columns.cut)
                        : found             ? found->center
                                            : scan.geometry.center;
  const double step =
      wanted.step ? *wanted.step / binning : step_of(found, scan.geometry.columns, wanted.count);
  CenterSheetOptions options;
  options.field = wanted.field;
  options.row = wanted.row;
  options.marked = static_cast<std::size_t>(wanted.count / 2);
  for (std::int64_t k = 0; k < wanted.count; ++k) {
    options.centers.push_back(middle + static_cast<double>(k - wanted.count / 2) * step);
    options.captions.push_back(fmt::format("{:.2f}", columns(options.centers.back())));
  }
  options.title =
      fmt::format("{}: row {}, columns of the axis; marked {}", scan.report.name, wanted.row * binning,
                  wanted.field.center ? "as --center says"
                  : !found            ? "the scan's own: none was found"
                  : found->sure       ? "the centre found"
                                      : "the centre found, UNSURE");
  return options;
}

void print_found(const std::optional<CenterEstimate>& found, const DetectorColumns& columns) {
  const int binning = columns.binning;
  if (!found) {
    fmt::print("centre         not found: no method applies to these views, or none explains them\n");
    return;
  }
  fmt::print("centre         {:.2f} +- {:.2g}, {}\n", columns(found->center),
             std::max(0.01, found->uncertainty * binning), found->sure ? "sure" : "UNSURE: " + found->doubt);
  fmt::print("  method       {}, which explains {:.1f} %\n", found->method, 100 * found->quality);
  for (const CenterWitness& w : found->others)
    fmt::print("  beside it    {:.2f} +- {:.2g}, {}, which explains {:.1f} %\n", columns(w.center),
               std::max(0.01, w.uncertainty * binning), w.method, 100 * w.quality);
}

Json roll_json(const std::optional<RollEstimate>& roll) {
  if (!roll) return nullptr;
  return {{"degrees", roll->roll_deg},
          {"uncertainty", roll->uncertainty_deg},
          {"significant", roll->significant},
          {"method", roll->method}};
}

void print_roll(const std::optional<RollEstimate>& roll, const ParallelGeometry& g) {
  if (!roll) {
    fmt::print("axis roll      not found: too few rows, or rows that do not know their centres\n");
    return;
  }
  fmt::print("axis roll      {}\n", words_of(*roll, g.axis_roll_deg));
}

Search search_of(const Arguments& args, const std::filesystem::path& path, const CommonOptions& common) {
  Search wanted;
  wanted.field = field_options(args);
  // The axis is looked for in the views as they are.
  wanted.field.preparation.half_acquisition = false;
  wanted.field.preparation.padding = Padding::none;
  wanted.count = args.integer_or("count", wanted.count, 3, 99);
  if (wanted.count % 2 == 0)
    throw InputError(
        fmt::format("--count: {} is even; the slice in the middle needs an odd one", wanted.count));
  if (args.has("step")) wanted.step = args.positive_or("step", 0);
  if (!args.has("output"))
    refuse(args, {"row", "step", "count"}, "is for the sheet, which --output asks for");
  else {
    if (args.path("output").extension() != ".png")
      throw InputError(fmt::format("{}: write the sheet as .png", args.text("output")));
    check_output(args.path("output"), common.force, {path});
  }
  return wanted;
}

}  // namespace

int center_command(Arguments& args) {
  args.positional("IN", "projections")
      .value("output,o", "SHEET.png",
             "slices around the centre and a figure of merit; without it none are drawn")
      .value("row", "R", "row of the detector (default the middle one)")
      .value("step", "S", "columns from slice to slice (default 0.5, more where it is unsure)")
      .value("count", "N", "slices, an odd number (default 15)");
  add_scan(args);
  add_field(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto path = args.path("IN");
  Search wanted = search_of(args, path, common);
  const bool draws = args.has("output");

  ProgressLine progress(args.who(), common.quiet);
  const ProjectionSet scan = load_any_scan(path, args, wanted.field, progress.callback());
  const int binning = wanted.field.preparation.binning;
  const DetectorColumns columns{binning, scan.geometry.extension.cut};
  wanted.row =
      args.integer_or("row", scan.geometry.rows * binning / 2, 0, scan.geometry.rows * binning - 1) / binning;
  report(progress.callback(), "search", 0);
  const auto found = find_center(scan);
  const auto roll = find_roll(scan);
  ParallelGeometry in_use = scan.geometry;
  if (found && !wanted.field.center) in_use.center = found->center;
  const bool half = !scan.cone && looks_half_acquired(in_use);
  Json json = {{"file", path.string()},
               {"geometry", geometry_json(scan.geometry)},
               {"report", report_json(scan.report)},
               {"found", found_json(found, columns)},
               {"roll", roll_json(roll)},
               {"half_acquisition", half}};
  std::optional<CenterSheet> sheet;
  CenterSheetOptions options;
  if (draws) {
    Device device = open_device(common);
    options = sheet_of(scan, found, wanted);
    sheet = center_sheet(device, scan, options, progress.callback());
    throw_if_stopped();
    write_png(args.path("output"), sheet->image);
    Json slices = Json::array();
    for (std::size_t k = 0; k < options.centers.size(); ++k)
      slices.push_back({{"center", columns(options.centers[k])}, {"merit", sheet->merit[k]}});
    json["sheet"] = {{"output", args.text("output")},
                     {"row", wanted.row * binning},
                     {"slices", slices},
                     {"best", sheet->best ? Json(columns(options.centers[*sheet->best])) : Json()},
                     {"joined", sheet->joined}};
  }
  progress.clear();
  json["seconds"] = seconds_json(progress.seconds());
  print_result(common, json, [&] {
    print_found(found, columns);
    print_roll(roll, scan.geometry);
    fmt::print("in use         {:.2f}, from: {}\n", columns(scan.geometry.center), scan.report.center_source);
    if (half)
      fmt::print(
          "half acquired  a full turn about an axis off the middle{}; `run`, `build` and the others weigh "
          "them so "
          "(--half-acquisition auto)\n",
          sheet && sheet->joined ? ": slices are of opposite views joined" : ", opposite views to be joined");
    if (sheet) {
      if (sheet->best)
        fmt::print("merit          best at {:.2f} of the slices\n", columns(options.centers[*sheet->best]));
      else fmt::print("merit          best at an end of the slices, so it says nothing\n");
      fmt::print("written        {}\n", args.text("output"));
    }
  });
  return 0;
}

}  // namespace vdvr::cli
