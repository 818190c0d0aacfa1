// The mixed-resolution field in double precision, from the text of docs/file-format.md alone: find the brick
// of a cell coordinate, find its samples, interpolate trilinearly. Does not use
// kernels/shared/mixed_sampler.h.
#pragma once

#include <cmath>
#include <cstdint>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::reference {

/// Sample i of a block, from the text of docs/file-format.md: step * (offset + stored * 2^shift).
inline double sample_of(const MixedVolume& v, const SampleBlock& b, std::size_t i) {
  if (b.type == SampleType::f32) return static_cast<double>(b.f32.at(i));
  const std::size_t tile = i / (b.size() / b.offset.size());
  const double stored = b.type == SampleType::u16 ? b.u16.at(i) : b.u8.at(i);
  return v.step * (b.offset.at(tile) + stored * std::ldexp(1.0, b.shift.at(tile)));
}

/// The stored sample number `sample` (x, y, z) of a brick at the brick's own level.
inline double stored_sample(const MixedVolume& v, const Index3& brick, const Index3& sample) {
  const Index3 bricks = v.bricks();
  // Cells per base sample, x, y, z.
  const Index3 c{1 << v.coarsening[2], 1 << v.coarsening[1], 1 << v.coarsening[0]};
  const Index3 n{v.grid.cells[0] / c[0] + 1, v.grid.cells[1] / c[1] + 1, v.grid.cells[2] / c[2] + 1};
  const auto b = static_cast<std::size_t>(brick[0] + bricks[0] * (brick[1] + bricks[1] * brick[2]));
  const LevelTriple l = v.level.at(b);
  if (l == LevelTriple{0, 0, 0}) {
    const std::int64_t g = v.granularity;
    const std::int64_t x = brick[0] * g / c[0] + sample[0], y = brick[1] * g / c[1] + sample[1],
                       z = brick[2] * g / c[2] + sample[2];
    return sample_of(v, v.base, static_cast<std::size_t>(x + n[0] * (y + n[1] * z)));
  }
  const std::int64_t sx = (v.granularity << l[2]) / c[0] + 1, sy = (v.granularity << l[1]) / c[1] + 1,
                     sz = (v.granularity << l[0]) / c[2] + 1;
  auto i = static_cast<std::size_t>(static_cast<std::int64_t>(v.tile.at(b)) * sz * sy * sx + sample[0] +
                                    sx * (sample[1] + sy * sample[2]));
  // Tile numbers run on from one type's dataset to the next.
  for (std::uint8_t part = 0;; ++part) {
    const SampleBlock& block = v.tiles.at({l, part});
    if (i < block.size()) return sample_of(v, block, i);
    i -= block.size();
  }
}

/// The brick a cell coordinate belongs to along one axis: half-open, the last brick closed.
inline std::int64_t brick_of(const MixedVolume& v, std::size_t axis, double cell) {
  const auto brick = static_cast<std::int64_t>(std::floor(cell / v.granularity));
  return std::min(std::max<std::int64_t>(brick, 0), v.bricks()[axis] - 1);
}

/// The field as one brick's samples give it at cell coordinates x, y, z within the brick's closed box.
inline double field_of_brick(const MixedVolume& v, const Index3& brick, const Vec3& cell) {
  const Index3 bricks = v.bricks();
  const LevelTriple l =
      v.level.at(static_cast<std::size_t>(brick[0] + bricks[0] * (brick[1] + bricks[1] * brick[2])));
  Index3 low{};
  Vec3 t{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double scale = std::ldexp(1.0, l[2 - a] - v.coarsening[2 - a]);
    const double local = (cell[a] - static_cast<double>(brick[a] * v.granularity)) * scale;
    const std::int64_t width =
        std::min<std::int64_t>(v.granularity, v.grid.cells[a] - brick[a] * v.granularity);
    const auto last = static_cast<std::int64_t>(static_cast<double>(width) * scale) - 1;
    low[a] = std::min(static_cast<std::int64_t>(std::floor(local)), last);
    t[a] = local - static_cast<double>(low[a]);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Index3 sample = low;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool high = ((corner >> a) & 1) != 0;
      sample[a] += high ? 1 : 0;
      weight *= high ? t[a] : 1 - t[a];
    }
    sum += weight * stored_sample(v, brick, sample);
  }
  return sum;
}

/// The field at cell coordinates x, y, z.
inline double mixed_field(const MixedVolume& v, const Vec3& cell) {
  return field_of_brick(v, {brick_of(v, 0, cell[0]), brick_of(v, 1, cell[1]), brick_of(v, 2, cell[2])}, cell);
}

}  // namespace vdvr::reference
