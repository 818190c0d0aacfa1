// Finds the worst node of one brick.
#include "host/worst_node.hpp"

namespace vdvr {

Vec3 worst_node(const GoldStream::Batch& batch, const MixedVolume& volume, std::int64_t brick) {
  const Index3 bricks = volume.bricks();
  const Index3 p{brick % bricks[0], brick / bricks[0] % bricks[1], brick / bricks[0] / bricks[1]};
  const std::int64_t g = volume.granularity;
  const double rate = volume.rate;
  Vec3 where{};
  float largest = -1;
  const VdvrGrid grid = sampler_grid(volume);
  const LevelTriple level = volume.level[static_cast<std::size_t>(brick)];
  const VdvrBrick r = brick_record(volume, {{level, 0}}, p[0], p[1], p[2]);
  const float* first =
      (level == LevelTriple{0, 0, 0} ? volume.base.data() : volume.tiles.at(level).data()) + r.offset;
  batch.for_each_node(brick, [&](const Index3& i, float gold, float slack) {
    if (slack < 0) return;
    std::array<float, 3> c{};
    for (std::size_t a = 0; a < 3; ++a)
      c[a] = static_cast<float>(static_cast<double>(p[a] * g) + static_cast<double>(i[a]) / rate);
    const float v = vdvr_sample_in_brick(
        first, r.stride_y, r.stride_z,
        vdvr_local(c[0], static_cast<vdvr_i32>(p[0]), r.level_x, grid.granularity, grid.cells_x),
        vdvr_local(c[1], static_cast<vdvr_i32>(p[1]), r.level_y, grid.granularity, grid.cells_y),
        vdvr_local(c[2], static_cast<vdvr_i32>(p[2]), r.level_z, grid.granularity, grid.cells_z));
    const float total = std::abs(v - gold) + slack;
    if (total <= largest) return;
    largest = total;
    for (std::size_t a = 0; a < 3; ++a)
      where[a] = volume.grid.origin[a] +
                 (static_cast<double>(p[a] * g) + static_cast<double>(i[a]) / rate) * volume.grid.spacing[a];
  });
  return where;
}

}  // namespace vdvr
