#include "host/scan/raw/raw_scan.hpp"

#include <algorithm>
#include <memory>
#include <numbers>

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
  keep(scan.view_files);
  for (SamplePositions& axis : scan.positions) keep(axis.at);
  scan.numbers = std::move(list);
}

}  // namespace vdvr::io
