#include "vdvr/expert/scan_of_array.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "host/scan/prepare/heights.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

void check_sizes(const SampleArray& data, const ArrayScan& d) {
  const auto views = static_cast<std::int64_t>(d.angles_deg.size());
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  for (const auto& [n, what] : {std::pair{views, "views"}, {d.rows, "rows"}, {d.columns, "columns"}})
    if (n < 1 || n > most)
      throw InputError(
          fmt::format("projections: {} {}; give an array of shape (views, rows, columns)", n, what));
  // Both factors are below 2^31, so neither product overflows unless the array is smaller than it.
  const auto plane = static_cast<std::uint64_t>(d.rows) * static_cast<std::uint64_t>(d.columns);
  if (plane > data.size() || data.size() % plane != 0 ||
      data.size() / plane != static_cast<std::uint64_t>(views))
    throw InputError(fmt::format("projections: {} samples for {} views of {} rows and {} columns",
                                 data.size(), views, d.rows, d.columns));
}

ParallelGeometry geometry_of(const ArrayScan& d) {
  ParallelGeometry g;
  g.rows = d.rows;
  g.columns = d.columns;
  g.unit = d.unit;
  g.pitch_u = d.pitch_u;
  g.pitch_v = d.pitch_v;
  for (const double pitch : {g.pitch_u, g.pitch_v})
    if (!(pitch > 0) || !std::isfinite(pitch))
      throw InputError(fmt::format("pitch: {}; it must be positive", pitch));
  for (std::size_t k = 0; k < d.angles_deg.size(); ++k) {
    if (!std::isfinite(d.angles_deg[k]))
      throw InputError(fmt::format("angles: angle {} is {}", k, d.angles_deg[k]));
    g.theta_rad.push_back(d.angles_deg[k] * (std::numbers::pi / 180));
  }
  for (std::size_t k = 0; k < d.shifts.size(); ++k) {
    if (d.shifts.size() != d.angles_deg.size() || !std::isfinite(d.shifts[k][0]) ||
        !std::isfinite(d.shifts[k][1]))
      throw InputError(
          fmt::format("shifts: {} for {} views, view {} by {}, {}; one finite pair is needed for each",
                      d.shifts.size(), d.angles_deg.size(), k, d.shifts[k][0], d.shifts[k][1]));
    g.column_shift.push_back(d.shifts[k][0] / d.pitch_u);
    g.row_shift.push_back(d.shifts[k][1] / d.pitch_v);
  }
  for (std::vector<double>* shift : {&g.column_shift, &g.row_shift})
    if (std::all_of(shift->begin(), shift->end(), [](double s) { return s == 0; })) shift->clear();
  require_axis_roll(d.axis_roll_deg, "axis_roll");
  g.axis_roll_deg = d.axis_roll_deg;
  return g;
}

void check_finite(const SampleArray& data, const ParallelGeometry& g) {
  for (std::size_t i = 0; i < data.size(); ++i)
    if (!std::isfinite(data[i])) {
      const auto at = static_cast<std::int64_t>(i), plane = g.rows * g.columns;
      throw InputError(fmt::format("projections: the sample at view {}, row {}, column {} is {}", at / plane,
                                   at / g.columns % g.rows, at % g.columns, data[i]));
    }
}

std::string hash_of(const SampleArray& data, const ArrayScan& d) {
  std::string text =
      fmt::format("{} {} {} {} {} {}", d.angles_deg.size(), d.rows, d.columns, d.pitch_u, d.pitch_v, d.unit);
  for (const double angle : d.angles_deg) text += fmt::format(" {}", angle);
  for (const auto& shift : d.shifts) text += fmt::format(" {} {}", shift[0], shift[1]);
  if (d.axis_roll_deg != 0) text += fmt::format(" roll {}", d.axis_roll_deg);
  text += '\n';
  Sha256 hash;
  hash.update(text.data(), text.size());
  hash.update(data.data(), data.size() * sizeof(float));
  return hash.hex();
}

void set_center(ProjectionSet& scan, const std::optional<double>& given) {
  ParallelGeometry& g = scan.geometry;
  if (given) {
    g.center = *given - static_cast<double>(g.extension.cut);
    scan.report.center_source = "option";
  } else if (const auto found = find_center(scan)) {
    g.center = found->center;
    scan.report.center_source = "found";
    scan.report.notes.push_back(fmt::format(
        "centre of rotation found from {}: column {:.2f}{}{}", found->method,
        found->center + static_cast<double>(g.extension.cut), found->sure ? "" : ", UNSURE: ", found->doubt));
  } else {
    g.center = 0.5 * static_cast<double>(g.columns - 1);
    scan.report.center_source = "default";
    scan.report.notes.push_back(
        fmt::format("centre of rotation assumed in the detector's middle, column {}: the views do not tell",
                    g.center + static_cast<double>(g.extension.cut)));
  }
  if (!(g.center >= -0.5 && g.center <= static_cast<double>(g.columns) - 0.5))
    throw InputError(
        fmt::format("center: column {} is not on the detector of {} columns", g.center, g.columns));
}

}  // namespace

ProjectionSet scan_of_array(SampleArray data, const ArrayScan& described) {
  check_sizes(data, described);
  ProjectionSet scan;
  scan.geometry = geometry_of(described);
  check_finite(data, scan.geometry);
  scan.data = std::move(data);
  scan.report.name = described.name;
  scan.report.format = "array";
  scan.report.sha256 = hash_of(scan.data, described);
  Preparation wanted;
  wanted.half_acquisition = described.half_acquisition;
  wanted.heights = described.heights;
  bring_to_heights(scan, wanted, 0, {});
  set_center(scan, described.center);
  wanted.padding = described.padding;
  if (std::string recognised = extend_rows(scan, wanted); !recognised.empty())
    scan.report.notes.push_back(std::move(recognised));
  for (auto& note : check_scan(scan)) scan.report.notes.push_back(std::move(note));
  return scan;
}

std::vector<double> degrees_of(std::span<const double> radians) {
  std::vector<double> degrees;
  for (const double theta : radians) degrees.push_back(theta * (180 / std::numbers::pi));
  return degrees;
}

Grid slices_of_rows(const ParallelGeometry& geometry) {
  const auto half = [](std::int64_t samples) { return 0.5 * static_cast<double>(samples - 1); };
  GridOptions options;
  const std::int64_t columns = own_detector(geometry).columns, cells = std::max<std::int64_t>(1, columns - 1);
  options.size = {cells, cells, std::max<std::int64_t>(1, geometry.rows - 1)};
  options.spacing = geometry.pitch_u;
  options.spacing_z = geometry.pitch_v;
  const double edge = -half(columns) * geometry.pitch_u;
  options.origin = {edge, edge, -half(geometry.rows) * geometry.pitch_v};
  return make_grid(geometry, options);
}

}  // namespace vdvr
