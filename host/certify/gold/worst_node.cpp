// Finds the worst node of one brick.
#include "host/certify/gold/worst_node.hpp"

#include "host/volume/bricks.hpp"

namespace vdvr {

std::optional<Vec3> worst_node(GoldStream::Batch& batch, const MixedVolume& volume, std::int64_t brick,
                               int gold_rate) {
  const Index3 p = Bricks(volume.grid, volume.granularity).position(brick);
  const std::int64_t g = volume.granularity;
  const double rate = gold_rate;
  std::optional<Vec3> where;
  float largest = -1;
  const BrickSamples stored(volume, p);
  batch.for_each_node(brick, [&](const Index3& i, float gold, const Slack& slack) {
    if (!slack.tested()) return;
    std::array<float, 3> c{};
    for (std::size_t a = 0; a < 3; ++a)
      c[a] = static_cast<float>(static_cast<double>(p[a] * g) + static_cast<double>(i[a]) / rate);
    const float v = stored.at(c[0], c[1], c[2]);
    const float total = slack.total(v - gold);
    if (total <= largest) return;
    largest = total;
    where.emplace();
    for (std::size_t a = 0; a < 3; ++a)
      (*where)[a] =
          volume.grid.origin[a] +
          (static_cast<double>(p[a] * g) + static_cast<double>(i[a]) / rate) * volume.grid.spacing[a];
  });
  return where;
}

}  // namespace vdvr
