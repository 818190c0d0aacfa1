#include "host/scan/raw/raw_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "vdvr/error.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::io {

Frames level_frame(double level, std::int64_t samples, const std::string& name) {
  Frames frames;
  frames.count = 1;
  frames.name = [name](std::int64_t) { return name; };
  frames.read = [level, samples](std::int64_t, std::int64_t n, double* out) {
    std::fill_n(out, n * samples, level);
  };
  return frames;
}

std::vector<double> in_degrees(std::vector<double> angles, AngleUnit unit) {
  if (unit == AngleUnit::radians)
    for (double& angle : angles) angle *= 180 / std::numbers::pi;
  return angles;
}

void place_flats(RawScan& scan, const std::vector<double>& projections_before, const std::string& name) {
  const auto last = static_cast<double>(scan.projections.count);
  BeamInTime& beam = scan.beam_in_time;
  beam.flats_at.clear();
  beam.projections_at.clear();
  for (const double before : projections_before) {
    if (!(before >= 0 && before <= last) || before != std::floor(before))
      throw FileError(fmt::format(
          "{}: a flat after {} projections; it must be a whole number from 0 to the {} that there "
          "are",
          name, before, scan.projections.count));
    beam.flats_at.push_back(before - 0.5);
  }
  for (std::int64_t k = 0; k < scan.projections.count; ++k)
    beam.projections_at.push_back(static_cast<double>(k));
}

void state_shifts(RawScan& scan, const std::vector<double>& numbers, const std::string& source) {
  const auto views = scan.projections.count, count = std::ssize(numbers);
  if (scan.cone)
    throw FileError(source + ": shifts are of parallel beam; a matrix a view says them of cone beam");
  if (count != views && count != 2 * views)
    throw FileError(
        fmt::format("{}: {} numbers for {} projections; one for each is needed (columns), or two "
                    "(columns, rows)",
                    source, count, views));
  for (std::int64_t i = 0; i < count; ++i)
    if (!std::isfinite(numbers[static_cast<std::size_t>(i)]))
      throw FileError(fmt::format("{}: the shift of projection {} is {}; it must be finite", source,
                                  i * views / count, numbers[static_cast<std::size_t>(i)]));
  const auto width = static_cast<std::size_t>(count / views);
  scan.shift_u.clear();
  scan.shift_v.clear();
  for (std::size_t i = 0; i < numbers.size(); i += width) {
    scan.shift_u.push_back(numbers[i]);
    if (width == 2) scan.shift_v.push_back(numbers[i + 1]);
  }
  scan.shifts_source = source;
}

void state_axis_roll(RawScan& scan, double degrees, const std::string& source) {
  if (scan.cone)
    throw FileError(source +
                    ": an axis' roll is of parallel beam; geometries of cone beam have tilts of their own "
                    "('tilt' of 'geometry', 'matrices')");
  require_axis_roll(degrees, source);
  scan.axis_roll_deg = degrees;
  scan.axis_roll_source = source;
}

void select_views(RawScan& scan, const ViewRanges& wanted) {
  const Frames all = scan.projections;
  const ViewRanges ranges = checked_ranges(wanted, all.count);
  std::vector<std::int64_t> list;
  for (const auto& [first, end] : ranges)
    for (std::int64_t k = first; k < end; ++k) list.push_back(k);
  if (static_cast<std::int64_t>(list.size()) == all.count) return;
  const auto kept = std::make_shared<const std::vector<std::int64_t>>(list);
  const std::int64_t size = scan.rows * scan.columns;
  scan.projections.count = static_cast<std::int64_t>(list.size());
  // Neighbours are read together.
  scan.projections.read = [all, kept, size](std::int64_t first, std::int64_t n, double* out) {
    for (std::int64_t k = 0; k < n;) {
      const std::int64_t start = (*kept)[static_cast<std::size_t>(first + k)];
      std::int64_t run = 1;
      while (k + run < n && (*kept)[static_cast<std::size_t>(first + k + run)] == start + run) ++run;
      all.read(start, run, out + k * size);
      k += run;
    }
  };
  scan.projections.name = [all, kept](std::int64_t k) {
    return all.name((*kept)[static_cast<std::size_t>(k)]);
  };
  const auto keep = [&](auto& values) {
    if (values.empty()) return;
    for (std::size_t k = 0; k < list.size(); ++k) values[k] = values[static_cast<std::size_t>(list[k])];
    values.resize(list.size());
  };
  if (scan.cone) keep(scan.cone->geometry.views);
  keep(scan.theta_deg);
  keep(scan.shift_u);
  keep(scan.shift_v);
  keep(scan.beam_in_time.projections_at);
  keep(scan.beam_in_time.projection_currents);
  keep(scan.view_files);
  for (SamplePositions& axis : scan.positions) keep(axis.at);
  scan.numbers = std::move(list);
}

}  // namespace vdvr::io
