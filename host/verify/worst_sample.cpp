// The worst corner of a cell, and the sample beside it.
#include "host/verify/worst_sample.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {

SamplePlace worst_sample(const MixedVolume& v, const ExactField& field, std::int64_t brick,
                         const Index3& cell, int rate) {
  const Index3 b = Bricks(v.grid, v.granularity).position(brick);
  const BrickSamples stored(v, b);
  SamplePlace p;
  p.brick = brick;
  p.brick_at = b;
  p.level = v.level[at(brick)];
  const bool base = p.level == LevelTriple{0, 0, 0};
  const std::array<int, 3> levels = stored.level();
  const Index3 in_base = first_base_sample(v, b);
  std::vector<Vec3> points;
  std::vector<double> values;
  std::vector<Index3> nodes;
  for (std::int64_t corner = 0; corner < 8; ++corner) {
    std::array<float, 3> at_cell{};
    Vec3 world{};
    Index3 node{};
    for (std::size_t a = 0; a < 3; ++a) {
      node[a] = cell[a] + (corner >> a & 1);
      const double c = static_cast<double>(b[a] * v.granularity) + static_cast<double>(node[a]) / rate;
      at_cell[a] = static_cast<float>(c);
      world[a] = v.grid.origin[a] + c * v.grid.spacing[a];
    }
    nodes.push_back(node);
    points.push_back(world);
    values.push_back(static_cast<double>(stored.at(at_cell[0], at_cell[1], at_cell[2])));
  }
  const std::vector<double> F = field.at(points);
  std::size_t worst = 0;
  for (std::size_t i = 1; i < 8; ++i)
    if (std::abs(values[i] - F[i]) > std::abs(values[worst] - F[worst])) worst = i;
  p.world = points[worst];
  p.value = values[worst];
  p.field = F[worst];
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t per_sample = std::int64_t{rate} << v.coarsening[2 - a] >> levels[a];
    p.sample[a] = (nodes[worst][a] + per_sample / 2) / per_sample + (base ? in_base[a] : 0);
  }
  p.dataset = "/base";
  if (!base) {
    const StoredTile tile = stored_tile(v, at(brick));
    p.dataset = fmt::format("/tiles/{}{}{}", p.level[0], p.level[1], p.level[2]);
    if (tile.kind.part > 0) p.dataset += fmt::format("_{}", tile.kind.part);
    p.tile = static_cast<std::uint32_t>(tile.number);
  }
  return p;
}

}  // namespace vdvr
