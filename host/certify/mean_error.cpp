// What interpolation errs by on average, in units of the scan's own noise: V against F reconstructed at
// points between samples. An estimate from some ten thousand points, beside the largest error, which is
// proved. Declared in vdvr/expert/noise_forecast.hpp.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/field/fdk/cone_points.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/noise_forecast.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/region_of_interest.hpp"

namespace vdvr {
namespace {

// Along x and y, and along z: of axes with fewer cells more than two points a cell.
constexpr double most_across = 48, most_planes = 12;
// Of fewer a mean says nothing.
constexpr std::int64_t least_points = 100;

// What of an axis is looked at, [low, high], and points on it: no whole number of samples apart, so that all
// places between samples occur alike, by the golden section.
struct PointsAlong {
  double first = 0, step = 0;
  std::int64_t count = 0;
};
PointsAlong points_along(double low, double high, double spacing, double most) {
  const double apart = std::floor((high - low) / (most * spacing));
  PointsAlong p;
  p.step = spacing * (apart + 2 - std::numbers::phi);
  p.first = low + p.step / 3;
  p.count = std::max<std::int64_t>(2, static_cast<std::int64_t>((high - p.first) / p.step) + 1);
  return p;
}

bool in_box(const Grid& grid, const Vec3& point) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double along = point[a] - grid.origin[a];
    if (!(along >= 0 && along <= static_cast<double>(grid.cells[a]) * grid.spacing[a])) return false;
  }
  return true;
}

Vec3 point_of(const Grid& grid, std::int64_t i) {
  const Index3 n = grid.samples();
  return grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]});
}

Grid points_in(const Grid& grid, const Certificate& c) {
  Grid points;
  points.unit = grid.unit;
  for (std::size_t a = 0; a < 3; ++a) {
    double low = grid.origin[a], high = low + static_cast<double>(grid.cells[a]) * grid.spacing[a];
    if (c.roi) {
      low = std::max(low, (*c.roi)[a]);
      high = std::min(high, (*c.roi)[a + 3]);
    }
    if (c.covered) {
      low = std::max(low, a == 2 ? c.covered->z.first : -c.covered->radius);
      high = std::min(high, a == 2 ? c.covered->z.second : c.covered->radius);
    }
    const PointsAlong p =
        points_along(low, std::max(low, high), grid.spacing[a], a == 2 ? most_planes : most_across);
    points.origin[a] = p.first;
    points.spacing[a] = p.step;
    points.cells[a] = p.count - 1;
  }
  return points;
}

// F at samples of a grid, by their numbers.
std::vector<float> field_at(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                            const Grid& grid, const std::vector<std::int64_t>& samples,
                            const Progress& progress) {
  std::vector<float> values;
  if (scan.cone) {
    const ScanInUnits from(scan);
    std::vector<Vec3> points;
    for (const std::int64_t i : samples) points.push_back(from_world(point_of(grid, i), from.units));
    values = cone_at_points(device.state(), from, field, points, progress);
    densities_to_world(values, from.units);
    return values;
  }
  const Volume all = reconstruct(device, scan, grid, {field, 16, Interpolation::cubic}, progress);
  for (const std::int64_t i : samples) values.push_back(all.samples[at(i)]);
  return values;
}

}  // namespace

std::optional<MeanError> mean_error(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                                    const Certificate& c, const Progress& progress) {
  const Grid grid = points_in(volume.grid, c);
  const CertifiedRegion region(scan, c.field);
  std::vector<std::int64_t> samples;
  for (std::int64_t i = 0; i < grid.sample_count(); ++i) {
    const Vec3 point = point_of(grid, i);
    if (in_box(volume.grid, point) && region.contains(point) && is_inside(c.roi, point)) samples.push_back(i);
  }
  if (std::ssize(samples) < least_points) return std::nullopt;
  const std::vector<float> field = field_at(device, scan, c.field, grid, samples, progress);
  const Index3 bricks = volume.bricks();
  MeanError mean;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vec3 point = point_of(grid, samples[i]);
    const auto truth = static_cast<double>(field[i]);
    if (c.window && !(truth >= c.window->first && truth <= c.window->second)) continue;
    const Index3 brick = brick_at(volume, point);
    const auto sigma =
        static_cast<double>(c.brick_sigma[at((brick[2] * bricks[1] + brick[1]) * bricks[0] + brick[0])]);
    const double error = static_cast<double>(sample_at(volume, point)) - truth;
    mean.in_sigma += error * error / (sigma * sigma);
    ++mean.points;
  }
  if (mean.points < least_points) return std::nullopt;
  mean.in_sigma = std::sqrt(mean.in_sigma / static_cast<double>(mean.points));
  return mean;
}

}  // namespace vdvr
