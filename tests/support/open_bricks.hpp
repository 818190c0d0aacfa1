// Open bricks with random levels, as closing is given them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "host/certify/closing/open_bricks.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::support {

struct Case {
  Index3 cells;
  int granularity;
  int rate;
  std::vector<LevelTriple> triples;
  double involved = 1;  ///< share of the bricks
  unsigned seed = 1;
  double offset_of_levels = 0;  ///< samples of level l lie this much times l beside gold, as fitted ones do
  LevelTriple coarsening{};
  bool tolerances = false;  ///< bricks have tolerances of their own
};

inline const std::vector<LevelTriple> isotropic{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
inline const std::vector<LevelTriple> anisotropic{{0, 0, 0}, {1, 1, 1}, {0, 2, 1}, {2, 0, 0},
                                                  {0, 1, 0}, {1, 0, 2}, {2, 2, 2}};

inline std::int64_t id_of(const Index3& bricks, const Index3& p) {
  return (p[2] * bricks[1] + p[1]) * bricks[0] + p[0];
}

// Smooth, with noise on every gold node: a function of the node alone.
inline float gold_at(const Index3& node, int rate) {
  const auto hash =
      static_cast<std::uint32_t>(node[0] * 73856093 ^ node[1] * 19349663 ^ node[2] * 83492791) * 2654435761u;
  const double x = static_cast<double>(node[0]) / rate, y = static_cast<double>(node[1]) / rate,
               z = static_cast<double>(node[2]) / rate;
  return static_cast<float>(std::sin(0.7 * x + 0.3 * y) + std::cos(0.5 * z - 0.2 * x) +
                            static_cast<double>(hash) * 0x1p-34);
}

// Random levels; every brick's gold differs by a tiny amount of its own, as gold computed in different blocks
// does.
inline OpenBricks random_bricks(const Case& c) {
  OpenBricks b;
  b.grid.cells = c.cells;
  b.granularity = c.granularity;
  b.rate = c.rate;
  b.coarsening = c.coarsening;
  const MixedVolume shape = b.shape();
  const Index3 n = shape.base_samples();
  const Index3 apart{c.rate << c.coarsening[2], c.rate << c.coarsening[1], c.rate << c.coarsening[0]};
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x)
        b.base.push_back(gold_at({x * apart[0], y * apart[1], z * apart[2]}, c.rate));
  const Index3 bricks = shape.bricks();
  std::mt19937 random(c.seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::uniform_int_distribution<std::size_t> pick(0, c.triples.size() - 1);
  for (std::int64_t i = 0; i < shape.brick_count(); ++i) {
    const bool involved = unit(random) < c.involved;
    const LevelTriple l = involved ? c.triples[pick(random)] : LevelTriple{0, 0, 0};
    b.involved.push_back(involved ? 1 : 0);
    b.level.push_back(l);
    b.samples.resize(b.level.size());
    if (l == LevelTriple{0, 0, 0}) continue;
    const Index3 p{i % bricks[0], i / bricks[0] % bricks[1], i / bricks[0] / bricks[1]};
    const auto side = shape.tile_shape(l);
    const float own = 1 + 0x1p-20f * static_cast<float>(unit(random));
    const auto beside = static_cast<float>(c.offset_of_levels * (l[0] + l[1] + l[2]));
    const auto node = [&](std::size_t a, std::int64_t s) {
      return std::min(p[a] * c.granularity * c.rate + s * (apart[a] >> l[2 - a]), c.cells[a] * c.rate);
    };
    std::vector<float> tile;
    for (std::int64_t z = 0; z < side[0]; ++z)
      for (std::int64_t y = 0; y < side[1]; ++y)
        for (std::int64_t x = 0; x < side[2]; ++x)
          tile.push_back(own * gold_at({node(0, x), node(1, y), node(2, z)}, c.rate) + beside);
    b.samples.put(b.level.size() - 1, tile);
  }
  for (std::size_t i = 0; c.tolerances && i < b.level.size(); ++i)
    b.tolerance.push_back(std::exp2(-6 * static_cast<float>(unit(random))));
  return b;
}

inline double largest_sample(const MixedVolume& v) {
  float largest = 0;
  for (const float s : decoded(v.base, v.step)) largest = std::max(largest, std::abs(s));
  for (const auto& [triple, block] : v.tiles)
    for (const float s : decoded(block, v.step)) largest = std::max(largest, std::abs(s));
  return static_cast<double>(largest);
}

inline void store_as(OpenBricks& b, StorageChoice storage) {
  b.lattice = choose_lattice(b.base, storage, 0.01);
  round_base(b.base, b.lattice);
}

}  // namespace vdvr::support
