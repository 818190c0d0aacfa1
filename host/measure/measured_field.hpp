// V as what is measured sees it: bricks with their bound, decoded, cell by cell, within a region.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "host/base/system/parallel.hpp"
#include "host/measure/measured_region.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::measured {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// A brick's samples as float, and where its cells lie.
struct BrickCells {
  Index3 brick{}, count{};                  ///< cells of its own level along x, y, z
  std::array<std::vector<double>, 3> face;  ///< world places of its cells' faces: count + 1 an axis
  std::vector<float> value;                 ///< [z][y][x], count + 1 an axis
  double bound = 0;                         ///< e: |V - F| is at most that at covered points
  Place place = Place::outside;
  float least = 0, largest = 0;

  [[nodiscard]] Vec3 low() const { return {face[0].front(), face[1].front(), face[2].front()}; }
  [[nodiscard]] Vec3 high() const { return {face[0].back(), face[1].back(), face[2].back()}; }
  [[nodiscard]] std::size_t first_corner(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z * (count[1] + 1) + y) * (count[0] + 1) + x);
  }
  [[nodiscard]] Part cell(std::int64_t x, std::int64_t y, std::int64_t z) const {
    Part part;
    const Index3 i{x, y, z};
    for (std::size_t a = 0; a < 3; ++a) {
      part.low[a] = face[a][static_cast<std::size_t>(i[a])];
      part.high[a] = face[a][static_cast<std::size_t>(i[a] + 1)];
    }
    const std::size_t row = static_cast<std::size_t>(count[0] + 1),
                      plane = row * static_cast<std::size_t>(count[1] + 1), first = first_corner(x, y, z);
    for (std::size_t c = 0; c < 8; ++c)
      part.value[c] = static_cast<double>(value[first + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * plane]);
    return part;
  }
};

class Field {
 public:
  Field(const MixedVolume& volume, const Certificate& certificate, const MeasureRegion& region);

  [[nodiscard]] const MeasuredRegion& region() const { return region_; }
  [[nodiscard]] const MixedVolume& volume() const { return volume_; }
  [[nodiscard]] const Certificate& certificate() const { return certificate_; }
  [[nodiscard]] const std::vector<float>& bounds() const { return bounds_; }
  [[nodiscard]] const Bricks& bricks() const { return bricks_; }

  /// Fills `out`. False, and nothing of it but `place` is of use, where the brick lies outside. Throws
  /// FileError where it lies inside, and nothing bounds |V - F|.
  [[nodiscard]] bool read(const Index3& brick, BrickCells& out) const;

  /// visit(cells, sum) for every brick that may meet the region, on all cores; sums of so many groups of
  /// bricks are added by `sum += other` in the order of the groups, so that results do not depend on threads.
  template <class Sum, class Visit>
  Sum sum_over_bricks(const Sum& zero, const Progress& progress, const char* stage,
                      const Visit& visit) const {
    const std::int64_t rows = bricks_.along()[1] * bricks_.along()[2],
                       groups = std::min<std::int64_t>(rows, most_groups);
    std::vector<Sum> sums(static_cast<std::size_t>(groups), zero);
    parallel_for(groups, progress, stage, [&](std::int64_t group) {
      BrickCells cells;
      for (std::int64_t row = group * rows / groups; row < (group + 1) * rows / groups; ++row)
        for (std::int64_t x = 0; x < bricks_.along()[0]; ++x)
          if (read({x, row % bricks_.along()[1], row / bricks_.along()[1]}, cells))
            visit(cells, sums[static_cast<std::size_t>(group)]);
    });
    Sum all = zero;
    for (const Sum& sum : sums) all += sum;
    return all;
  }

 private:
  static constexpr std::int64_t most_groups = 256;

  const MixedVolume& volume_;
  const Certificate& certificate_;
  std::vector<float> bounds_;
  Bricks bricks_;
  MeasuredRegion region_;
};

/// Calls visit(part) with each cell, clipped to the region's box and cut along the planes of its mask, that
/// is not surely outside; visit(part, whole): whether the part lies inside altogether.
template <class Visit>
void for_parts(const MeasuredRegion& region, const BrickCells& cells, const Visit& visit) {
  const auto divide = [&](const auto& self, const Part& part) -> void {
    const Place place = region.place(part.low, part.high);
    if (place == Place::outside) return;
    if (place == Place::cut)
      if (const auto plane = region.mask_plane(part.low, part.high)) {
        for (const Part& half : split(part, plane->axis, plane->at)) self(self, half);
        return;
      }
    visit(part, place == Place::inside);
  };
  for (std::int64_t z = 0; z < cells.count[2]; ++z)
    for (std::int64_t y = 0; y < cells.count[1]; ++y)
      for (std::int64_t x = 0; x < cells.count[0]; ++x) {
        const Part cell = cells.cell(x, y, z);
        if (cells.place == Place::inside) {
          visit(cell, true);
          continue;
        }
        const Part part = clipped_to(cell, region.low(), region.high());
        if (part.volume() > 0) divide(divide, part);
      }
}

/// Sums of numbers that are not negative, of up to 2^40 terms in groups, err by less than that part of
/// themselves.
inline constexpr double sum_error = 0x1p-32;
inline Interval outward(const Interval& sum) { return {sum.lo * (1 - sum_error), sum.hi * (1 + sum_error)}; }

}  // namespace vdvr::measured
