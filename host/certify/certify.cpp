// What a program over the library needs to certify: plan, build and the certificate completed.
#include "vdvr/expert/certify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/certify/build_journal.hpp"
#include "host/certify/gold/gold_settings.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/scan/input_statement_json.hpp"
#include "host/volume/covered_range.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/region_of_interest.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {
namespace {

// What the stages below take for granted of one another.
void check_options(const CertifyOptions& options) {
  const BuildOptions& build = options.build;
  if (build.window && !(build.window->first <= build.window->second))
    throw InputError(fmt::format("`window`: {} lies above {}", build.window->first, build.window->second));
  if (build.roi)
    for (std::size_t a = 0; a < 3; ++a)
      if (!((*build.roi)[a] < (*build.roi)[a + 3]))
        throw InputError(fmt::format("`roi`: {} is not below {}", (*build.roi)[a], (*build.roi)[a + 3]));
  if (build.refinement && build.window)
    throw InputError(
        "`window` leaves bricks without a bound, and tolerances in sigma or of pictures go by bounds of "
        "bricks: give "
        "`epsilon` as a share of the range such as 3%, or no `window`");
  const PlanSettings& plan = options.plan;
  if (plan.levels == Levels::isotropic && plan.coarsening.value_or(LevelTriple{}) != LevelTriple{})
    throw InputError("`coarsening`: isotropic levels have the grid itself as their base");
  if (plan.comparison.closing != Closing::paper) return;
  if (plan.comparison.coefficients != Coefficients::sampled)
    throw InputError("`closing` paper feeds bricks with samples of F: take `coefficients` sampled with it");
  if (plan.levels != Levels::isotropic)
    throw InputError("`closing` paper is defined for isotropic levels only");
}

constexpr const char* of_region_note =
    "the grid is that part of the default one whose bricks meet `roi`: the range is the range there";

bool is_cropped(const CertifyOptions& options) { return options.build.roi && !options.grid.size; }

// Of the default grid, what the region of interest meets.
Grid grid_of_region(const ProjectionSet& scan, const FieldOptions& field, const std::array<double, 6>& roi,
                    const Grid& whole, int granularity) {
  const Grid grid = cropped_to(roi, whole, fitting_granularity(granularity, whole));
  const Coverage coverage = certified_coverage(scan, field);
  const std::vector<std::uint8_t> inside = covered_in_plane(grid, coverage);
  if (std::find(inside.begin(), inside.end(), 1) == inside.end())
    throw InputError(fmt::format(
        "`roi` from ({:.6g}, {:.6g}) to ({:.6g}, {:.6g}) in x and y lies outside of what the scan covers: a "
        "disc of radius {:.6g} around the axis",
        roi[0], roi[1], roi[3], roi[4], coverage.inner_radius()));
  return grid;
}

// What the volume was built with, and the scan's geometry: a reader of the file can tell which points are
// covered without the projections.
std::string options_json(const Plan& plan, const CertifyOptions& options, const ProjectionSet& scan) {
  const ParallelGeometry& geometry = scan.geometry;
  const Comparison& comparison = plan.settings.comparison;
  const LevelTriple& c = plan.layout.coarsening;
  nlohmann::ordered_json j;
  j["granularity"] = plan.layout.granularity;
  j["base"] = std::array{1 << c[2], 1 << c[1], 1 << c[0]};  // cells per base sample, x, y, z
  j["closing"] = text_of(comparison.closing);
  j["coefficients"] = text_of(comparison.coefficients);
  j["levels"] = text_of(plan.layout.levels);
  j["storage"] = text_of(options.build.storage);
  j["terms"] = text_of(comparison.terms);
  j["epsilon_of"] = comparison.epsilon_of_max ? "max" : "range";
  j["upsampling"] = plan.rates.upsampling;
  j["u_filter"] = text_of(plan.rates.interpolation);
  j["gold"] = plan.rates.gold;
  if (!options.input.none()) j["input"] = json_of(options.input);
  j["geometry"] = {{"columns", geometry.columns},
                   {"rows", geometry.rows},
                   {"pitch_u", geometry.pitch_u},
                   {"pitch_v", geometry.pitch_v},
                   {"center", center_of(plan.field, geometry)},
                   {"unit", geometry.unit},
                   {"theta_rad", geometry.theta_rad}};
  if (!geometry.column_shift.empty()) j["geometry"]["column_shift"] = geometry.column_shift;
  if (!geometry.row_shift.empty()) j["geometry"]["row_shift"] = geometry.row_shift;
  if (const HeightSeries& s = geometry.series; !s.none()) {
    j["geometry"]["series"] = {{"rows", s.rows},
                               {"first", s.first},
                               {"full_turn", s.full_turn},
                               {"theta_rad", s.theta_rad},
                               {"row_shift", s.row_shift}};
    if (!s.column_shift.empty()) j["geometry"]["series"]["column_shift"] = s.column_shift;
  }
  if (geometry.axis_roll_deg != 0) {
    j["geometry"]["axis_roll"] = geometry.axis_roll_deg;
    j["geometry"]["columns_cut"] = geometry.extension.cut;
  }
  if (const RowExtension& e = geometry.extension; e.before > 0 || e.after > 0)
    j["geometry"]["extension"] = {
        {"half_acquisition", e.half_acquisition.value_or(false)},
        {"pad", text_of(e.padding)},
        {"before", e.before},
        {"after", e.after},
        {"center", stated_center(plan.field, geometry) - static_cast<double>(e.cut)}};
  if (!scan.cone) return j.dump();
  nlohmann::ordered_json& cone = j["geometry"]["cone"];
  cone["redundancy"] = text_of(scan.cone->redundancy);
  for (const ViewMatrix& matrix : scan.cone->views)
    for (std::size_t row = 0; row < 3; ++row)
      for (const double m : matrix[row]) cone["matrices"].push_back(m);  // one after another
  return j.dump();
}

BuildResult build_or_give_up(Device& device, const ProjectionSet& scan, Plan plan,
                             const BuildOptions& options, const Progress& progress) {
  try {
    return build(device, scan, std::move(plan), options, progress);
  } catch (const ToleranceError&) {
    if (options.journal) options.journal->remove();  // going on would end here again
    throw;
  }
}

void refuse_empty_promise(const Certificate& c) {
  // A tested node has a share of each kind, if only of rounding: none at all means that nothing was tested
  // (but in a scan of nothing but zeros, whose range is 0).
  const bool tested = std::ranges::any_of(c.brick_totals, [](float total) { return total >= 0; }),
             empty = c.reference_range > 0 && c.measured_total == 0 && c.budget.gold.value == 0;
  if ((c.window || c.roi) && (empty || !tested))
    throw InputError("`window` or `roi` leaves no covered gold node to test: nothing would be certified");
  if (!tested)
    throw InputError(
        "no gold node of the grid is covered by the scan, so that nothing would be certified; change "
        "`origin`, "
        "`size` or `center`");
  if (!c.holds_buffer && !c.comparison)
    throw ToleranceError(fmt::format(
        "the volume misses its tolerance: total {:.6g} > epsilon {:.6g} at {:.6g}, {:.6g}, {:.6g}",
        c.total_buffer, c.epsilon_abs, c.worst_at[0], c.worst_at[1], c.worst_at[2]));
}

}  // namespace

Grid grid_to_certify(const ProjectionSet& scan, const CertifyOptions& options) {
  check_options(options);
  FieldOptions field = options.field;
  field.center = stated_center(field, scan.geometry);
  Grid grid = certified_grid(scan, field, options.grid);
  if (is_cropped(options))
    grid = grid_of_region(scan, field, *options.build.roi, grid, options.plan.granularity);
  return grid;
}

Plan make_plan(Device& device, const ProjectionSet& scan, const Tolerance& tolerance,
               const CertifyOptions& options, const Progress& progress) {
  const Grid grid = grid_to_certify(scan, options);
  FieldOptions field = options.field;
  field.center = stated_center(field, scan.geometry);
  Plan plan = make_plan(device, scan, grid, field, options.rates, tolerance, options.plan, progress);
  if (is_cropped(options)) plan.notes.emplace_back(of_region_note);
  return plan;
}

BuildResult certify(Device& device, const ProjectionSet& scan, const Tolerance& tolerance,
                    const CertifyOptions& options, const Progress& progress) {
  CertifyOptions used = options;
  used.plan.forecast = false;
  return certify(device, scan, make_plan(device, scan, tolerance, used, progress), used, progress);
}

BuildResult certify(Device& device, const ProjectionSet& scan, Plan plan, const CertifyOptions& options,
                    const Progress& progress) {
  check_options(options);
  std::string noted = options_json(plan, options, scan);
  BuildResult result = build_or_give_up(device, scan, std::move(plan), options.build, progress);
  Certificate& c = result.certificate;
  refuse_empty_promise(c);
  c.options_json = std::move(noted);
  c.content_sha256 = content_sha256(result.volume);
  return result;
}

}  // namespace vdvr
