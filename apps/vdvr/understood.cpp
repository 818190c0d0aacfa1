#include "apps/vdvr/understood.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/common/messages.hpp"
#include "apps/vdvr/cone.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr::cli {
namespace {

/// How the angles follow each other.
struct Turn {
  double first = 0, last = 0, low = 0, high = 0;  ///< degrees
  double least_step = 0, largest_step = 0;        ///< from view to view, with their signs
  std::int64_t back = 0;                          ///< steps against the direction of most

  [[nodiscard]] const char* direction() const {
    return back > 0 ? "mixed" : largest_step > 0 ? "rising" : least_step < 0 ? "falling" : "none";
  }
};

Turn turn_of(const std::vector<double>& theta_rad) {
  Turn t;
  if (theta_rad.empty()) return t;
  const auto [low, high] = std::minmax_element(theta_rad.begin(), theta_rad.end());
  t.first = theta_rad.front() * degrees_per_radian;
  t.last = theta_rad.back() * degrees_per_radian;
  t.low = *low * degrees_per_radian;
  t.high = *high * degrees_per_radian;
  std::int64_t up = 0, down = 0;
  for (std::size_t k = 1; k < theta_rad.size(); ++k) {
    const double step = (theta_rad[k] - theta_rad[k - 1]) * degrees_per_radian;
    t.least_step = k == 1 ? step : std::min(t.least_step, step);
    t.largest_step = k == 1 ? step : std::max(t.largest_step, step);
    up += step > 0 ? 1 : 0;
    down += step < 0 ? 1 : 0;
  }
  t.back = std::min(up, down);
  return t;
}

std::string arc_text(const Turn& t) {
  // Steps are the same where they differ by rounding of angles only.
  const bool even = t.largest_step - t.least_step <= 1e-6 * std::max(1.0, t.high - t.low);
  const std::string steps = even ? fmt::format("in steps of {:.6g}", t.largest_step)
                                 : fmt::format("in steps of {:.4g} to {:.4g}", t.least_step, t.largest_step);
  std::string text =
      fmt::format("{:.6g} to {:.6g} degrees, {}, {}", t.first, t.last, steps,
                  t.back > 0 ? fmt::format("in mixed order ({} steps against the others)", t.back)
                             : std::string(t.direction()));
  const double arc = t.high - t.low + (even ? std::abs(t.largest_step) : 0);
  text += fmt::format("; {:.4g} turns", arc / 360);
  return text;
}

std::string reference_text(std::int64_t count, const char* what) {
  return count > 0 ? fmt::format("{} {}", count, what) : fmt::format("a level for {}", what);
}

std::string values_text(const Understood& r) {
  std::string text = text_of(r.values);
  if (r.values == SampleValues::counts)
    text += fmt::format(", by {} and {}", reference_text(r.flats, "flats"), reference_text(r.darks, "darks"));
  if (r.values != SampleValues::counts && !r.values_source.empty())
    text += fmt::format(", as {} says", with_options(r.values_source));
  return text;
}

std::vector<Assumption> assumed(const ProjectionSet& scan, const Understood& r) {
  std::vector<Assumption> all = r.assumed;
  if (!scan.cone)
    all.push_back({"angles grow from x to y, rows along the axis",
                   "no format says it; a wrong one gives a mirror image", "negated 'angles'"});
  return all;
}

// By view of the files.
const std::vector<double>& measured_angles(const ParallelGeometry& g) {
  return g.series.none() ? g.theta_rad : g.series.theta_rad;
}

}  // namespace

Json understood_json(const ProjectionSet& scan, const Understood& r) {
  const std::vector<double>& theta = measured_angles(scan.geometry);
  const Turn t = turn_of(theta);
  Json frames = Json::array(), assumptions = Json::array();
  for (const NamedView& f : r.frames)
    frames.push_back({{"view", f.view},
                      {"projection", f.projection},
                      {"name", f.name},
                      {"angle_deg", theta.at(static_cast<std::size_t>(f.view)) * degrees_per_radian}});
  for (const Assumption& a : assumed(scan, r))
    assumptions.push_back({{"what", a.what}, {"why", a.why}, {"otherwise", with_options(a.otherwise)}});
  return {{"values", text_of(r.values)},
          {"values_source", with_options(r.values_source)},
          {"flats", r.flats},
          {"darks", r.darks},
          {"stated", text_of(r.stated)},
          {"beam", scan.cone ? "cone" : "parallel"},
          {"arc",
           {{"first_deg", t.first},
            {"last_deg", t.last},
            {"covered_deg", t.high - t.low},
            {"least_step_deg", t.least_step},
            {"largest_step_deg", t.largest_step},
            {"direction", t.direction()}}},
          {"frames", frames},
          {"assumed", assumptions},
          {"warnings", r.warnings}};
}

namespace {

void print_understood(const ProjectionSet& scan, const Understood& r) {
  const std::vector<double>& theta = measured_angles(scan.geometry);
  for (const std::string& warning : r.warnings) fmt::print("  WARNING      {}\n", with_options(warning));
  fmt::print("  values       {}\n", values_text(r));
  if (!r.stated.none()) fmt::print("  stated       {}\n", text_of(r.stated));
  fmt::print("  arc          {}\n", arc_text(turn_of(theta)));
  for (const NamedView& f : r.frames)
    fmt::print("  {:<12} {:.6g} degrees: {}\n",
               f.view == 0                       ? "first view"
               : f.view == 1 && theta.size() > 2 ? "second view"
                                                 : "last view",
               theta[static_cast<std::size_t>(f.view)] * degrees_per_radian, f.name);
  for (const Assumption& a : assumed(scan, r))
    fmt::print("  assumed      {}: {}; {} say otherwise\n", a.what, a.why, with_options(a.otherwise));
}

// The steps that made rows longer.
Preparation extended_by(const RowExtension& e) {
  Preparation p;
  p.half_acquisition = e.half_acquisition;
  p.padding = e.padding;
  return p;
}

}  // namespace

std::string words_of(const RollEstimate& roll, double stated) {
  // Another digit than those that are known.
  const int digits =
      std::clamp(1 - static_cast<int>(std::floor(std::log10(std::max(1e-5, roll.uncertainty_deg)))), 1, 5);
  const std::string found = fmt::format("{:.{}f} +- {:.1g} degrees, by {}", roll.roll_deg, digits,
                                        std::max(1e-5, roll.uncertainty_deg), roll.method);
  if (roll.significant)
    return fmt::format("{}{}: the axis leans; --axis-roll {:.{}f}", found,
                       stated == 0 ? "" : fmt::format(", not {:g}", stated), roll.roll_deg, digits);
  return found + (stated == 0 ? ": none to speak of" : ", as is stated");
}

void print_scan(const ProjectionSet& scan, const Understood* understood) {
  const ParallelGeometry g = own_detector(scan.geometry);
  const InputReport& r = scan.report;
  fmt::print("scan           {} ({}), {} views of {} x {} pixels, {}\n", r.name, r.format, g.views(),
             g.columns, g.rows, scan.cone ? "cone beam" : "parallel beam");
  if (understood) print_understood(scan, *understood);
  fmt::print("  pitch        {:.6g} x {:.6g} {}\n", g.pitch_u, g.pitch_v, g.unit);
  fmt::print("  centre       column {:.4f} ({})\n", stated_center({}, scan.geometry), r.center_source);
  if (g.axis_roll_deg != 0)
    fmt::print("  axis roll    {:g} degrees in the detector's plane\n", g.axis_roll_deg);
  if (const HeightSeries& s = g.series; !s.none())
    fmt::print("  heights      all that are seen from every direction, of {} views of {} rows\n",
               s.theta_rad.size(), s.rows);
  if (const RowExtension& e = scan.geometry.extension; e.before > 0 || e.after > 0)
    fmt::print("  rows         longer: {} columns before, {} after, for {}\n", e.before, e.after,
               text_of(extended_by(e)));
  if (scan.cone) print_cone(scan);
  if (r.dead_pixels != 0) fmt::print("  dead pixels  {} replaced\n", r.dead_pixels);
  if (r.air_background) fmt::print("  background   linear air background taken off\n");
  fmt::print("  sha256       {}\n", r.sha256);
  std::vector<std::string> notes = r.notes;
  if (understood)
    std::erase_if(notes, [&](const std::string& note) {
      return std::find(understood->warnings.begin(), understood->warnings.end(), note) !=
             understood->warnings.end();
    });
  print_notes(notes);
}

}  // namespace vdvr::cli
