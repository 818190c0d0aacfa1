// Covered samples of a grid.
#include "host/volume/covered_range.hpp"

#include <vector>

#include "host/base/system/casts.hpp"

namespace vdvr {

std::vector<std::uint8_t> covered_in_plane(const Grid& grid, const Coverage& coverage) {
  const Index3 n = grid.samples();
  std::vector<std::uint8_t> inside(at(n[0] * n[1]));
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const Vec3 p = grid.position({x, y, 0});
      inside[at(y * n[0] + x)] = coverage.margin(p[0], p[1]) >= 0;
    }
  return inside;
}

namespace {

template <class Visit>
void for_each_covered(const Grid& grid, const Coverage& coverage, Visit&& visit) {
  const Index3 n = grid.samples();
  const std::vector<std::uint8_t> inside = covered_in_plane(grid, coverage);
  for (std::int64_t z = 0; z < n[2]; ++z) {
    if (!(coverage.margin_z(grid.position({0, 0, z})[2]) >= 0)) continue;
    for (std::int64_t i = 0; i < n[0] * n[1]; ++i)
      if (inside[at(i)]) visit(z * n[0] * n[1] + i);
  }
}

}  // namespace

std::int64_t count_not_covered(const Grid& grid, const Coverage& coverage) {
  std::int64_t covered = 0;
  for_each_covered(grid, coverage, [&](std::int64_t) { ++covered; });
  return grid.sample_count() - covered;
}

CoveredRange covered_range(const Volume& volume, const Coverage& coverage) {
  const Index3 n = volume.grid.samples();
  std::int64_t low = -1, high = -1, covered = 0;
  const auto take = [&](std::int64_t i) {
    ++covered;
    const float v = volume.samples[at(i)];
    if (low < 0 || v < volume.samples[at(low)]) low = i;
    if (high < 0 || v > volume.samples[at(high)]) high = i;
  };
  for_each_covered(volume.grid, coverage, take);
  CoveredRange range;
  range.not_covered = volume.grid.sample_count() - covered;
  if (covered == 0)
    for (std::int64_t i = 0; i < volume.grid.sample_count(); ++i) take(i);
  const auto place = [&](std::int64_t i) { return Index3{i % n[0], i / n[0] % n[1], i / n[0] / n[1]}; };
  range.low_at = place(low);
  range.high_at = place(high);
  range.low = static_cast<double>(volume.samples[at(low)]);
  range.high = static_cast<double>(volume.samples[at(high)]);
  return range;
}

}  // namespace vdvr
