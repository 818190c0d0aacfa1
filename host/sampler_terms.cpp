// Sampler error from the stored samples' slopes.
#include "host/sampler_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "host/brick_layout.hpp"
#include "host/parallel.hpp"

namespace vdvr {

FieldSlopes field_slopes(const MixedVolume& v) {
  const Index3 bricks = v.bricks();
  const auto offsets = tile_offsets(v);
  FieldSlopes out;
  out.bricks.resize(v.level.size());
  std::mutex lock;
  parallel_for(bricks[2] * bricks[1], {}, "slopes", [&](std::int64_t row) {
    std::array<double, 3> per_cell{0, 0, 0};
    const std::int64_t bz = row / bricks[1], by = row % bricks[1];
    for (std::int64_t bx = 0; bx < bricks[0]; ++bx) {
      const VdvrBrick r = brick_record(v, offsets, bx, by, bz);
      const LevelTriple level = v.level[static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx)];
      const bool base = level == LevelTriple{0, 0, 0};
      const float* s =
          base ? v.base.data() + r.offset : v.tiles.at(level).data() + (r.offset - offsets.at(level));
      const std::array<std::uint32_t, 3> levels{r.level_x, r.level_y, r.level_z};
      const std::array<std::int64_t, 3> stride{1, r.stride_y, r.stride_z}, brick{bx, by, bz};
      std::array<std::int64_t, 3> end{};
      for (std::size_t a = 0; a < 3; ++a)
        end[a] = std::min<std::int64_t>(v.granularity, v.grid.cells[a] - brick[a] * v.granularity)
                 << levels[a];
      std::array<float, 3> largest{0, 0, 0};
      float magnitude = 0;
      for (std::int64_t z = 0; z <= end[2]; ++z)
        for (std::int64_t y = 0; y <= end[1]; ++y) {
          const float* p = s + z * stride[2] + y * stride[1];
          for (std::int64_t x = 0; x <= end[0]; ++x) {
            magnitude = std::max(magnitude, std::abs(p[x]));
            if (x < end[0]) largest[0] = std::max(largest[0], std::abs(p[x + 1] - p[x]));
            if (y < end[1]) largest[1] = std::max(largest[1], std::abs(p[x + stride[1]] - p[x]));
            if (z < end[2]) largest[2] = std::max(largest[2], std::abs(p[x + stride[2]] - p[x]));
          }
        }
      FieldSlopes::Brick& own = out.bricks[static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx)];
      own.magnitude = static_cast<double>(magnitude);
      for (std::size_t a = 0; a < 3; ++a) {
        own.per_sample[a] = static_cast<double>(largest[a]);
        per_cell[a] = std::max(per_cell[a], own.per_sample[a] * std::exp2(levels[a]));
      }
    }
    const std::lock_guard guard(lock);
    for (std::size_t a = 0; a < 3; ++a) out.per_cell[a] = std::max(out.per_cell[a], per_cell[a]);
  });
  return out;
}

SamplerTerms sampler_terms(const FieldSlopes& slopes, const Grid& grid, const SamplerProbe& probe,
                           std::int64_t atlas_length) {
  constexpr double u = 0x1p-24;
  SamplerTerms terms;
  // Seven lerps of two rounded products and one rounded sum each, on three levels: 14 u of the largest sample
  // covers them. A cell coordinate rounds by at most 2 u of its size, and a wrong position costs its share of
  // the slope per cell, in whichever brick it ends.
  double coordinates = 0;
  for (std::size_t a = 0; a < 3; ++a)
    coordinates += 2 * u * static_cast<double>(grid.cells[a]) * slopes.per_cell[a];
  double magnitude = 0, image = 0;
  for (const FieldSlopes::Brick& b : slopes.bricks) {
    magnitude = std::max(magnitude, b.magnitude);
    double own = (probe.constant_error + 14 * u) * b.magnitude;
    for (const double difference : b.per_sample)
      own += (probe.delta + 2 * u * static_cast<double>(atlas_length)) * difference;
    image = std::max(image, own);
  }
  const double buffer = 14 * u * magnitude + coordinates;
  terms.buffer = {buffer, "rounding: 14 u of the largest sample, 2 n u of the largest slope per cell"};
  if (probe.image3d)
    terms.image3d = ErrorTerm{
        image + coordinates,
        fmt::format("device probe, largest brick: weights err by {:.3g}, products by {:.3g} of the sample",
                    probe.delta, probe.constant_error)};
  return terms;
}

std::int64_t longest_atlas(const DeviceInfo& device) {
  return static_cast<std::int64_t>(
      std::max({device.image3d_max[0], device.image3d_max[1], device.image3d_max[2]}));
}

}  // namespace vdvr
