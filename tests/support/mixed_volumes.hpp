// Mixed volumes for tests: random levels, shuffled tile numbers, samples from a function or at random.
#pragma once

#include <algorithm>
#include <functional>
#include <numeric>
#include <random>

#include "vdvr/mixed_volume.hpp"

namespace vdvr::support {

/// Every brick takes one of `triples` at random, tiles in shuffled order; all samples 0.
inline MixedVolume empty_mixed(const Grid& grid, int granularity, int rate,
                               const std::vector<LevelTriple>& triples, unsigned seed) {
  MixedVolume v;
  v.grid = grid;
  v.granularity = granularity;
  v.rate = rate;
  v.base.assign(static_cast<std::size_t>(grid.sample_count()), 0.0f);
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, triples.size() - 1);
  std::map<LevelTriple, std::vector<std::size_t>> bricks_of;
  for (std::int64_t i = 0; i < v.brick_count(); ++i) {
    v.level.push_back(triples[pick(random)]);
    bricks_of[v.level.back()].push_back(v.level.size() - 1);
  }
  v.tile.assign(v.level.size(), 0);
  for (auto& [triple, bricks] : bricks_of) {
    if (triple == LevelTriple{0, 0, 0}) continue;
    std::shuffle(bricks.begin(), bricks.end(), random);
    for (std::size_t t = 0; t < bricks.size(); ++t) v.tile[bricks[t]] = static_cast<std::uint32_t>(t);
    v.tiles[triple].assign(bricks.size() * static_cast<std::size_t>(v.tile_size(triple)), 0.0f);
  }
  return v;
}

/// Samples uniform in [-1, 1]: bricks disagree on shared faces, so that a test sees which brick answered.
inline MixedVolume random_mixed(const Grid& grid, int granularity, int rate,
                                const std::vector<LevelTriple>& triples, unsigned seed) {
  MixedVolume v = empty_mixed(grid, granularity, rate, triples, seed);
  std::mt19937 random(seed + 1);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (float& s : v.base) s = value(random);
  for (auto& [triple, samples] : v.tiles)
    for (float& s : samples) s = value(random);
  return v;
}

/// Samples of `f` at cell coordinates x, y, z; beyond the grid a tile repeats its last plane.
inline MixedVolume sampled_mixed(const Grid& grid, int granularity, int rate,
                                 const std::vector<LevelTriple>& triples, unsigned seed,
                                 const std::function<double(double, double, double)>& f) {
  MixedVolume v = empty_mixed(grid, granularity, rate, triples, seed);
  const Index3 n = grid.samples(), bricks = v.bricks();
  for (std::int64_t z = 0, i = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x, ++i)
        v.base[static_cast<std::size_t>(i)] =
            static_cast<float>(f(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)));
  for (std::size_t b = 0; b < v.level.size(); ++b) {
    const LevelTriple l = v.level[b];
    if (l == LevelTriple{0, 0, 0}) continue;
    const auto side = v.tile_shape(l);
    const auto id = static_cast<std::int64_t>(b);
    const Index3 brick{id % bricks[0], id / bricks[0] % bricks[1], id / (bricks[0] * bricks[1])};
    const auto at = [&](std::size_t axis, std::int64_t sample) {
      const double cell = static_cast<double>(brick[axis] * granularity) +
                          static_cast<double>(sample) / static_cast<double>(1 << l[2 - axis]);
      return std::min(cell, static_cast<double>(grid.cells[axis]));
    };
    float* sample =
        v.tiles[l].data() + static_cast<std::size_t>(v.tile[b]) * static_cast<std::size_t>(v.tile_size(l));
    for (std::int64_t z = 0; z < side[0]; ++z)
      for (std::int64_t y = 0; y < side[1]; ++y)
        for (std::int64_t x = 0; x < side[2]; ++x)
          *sample++ = static_cast<float>(f(at(0, x), at(1, y), at(2, z)));
  }
  return v;
}

}  // namespace vdvr::support
