// Volumes made from functions, for tests of samplers and pictures.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::fields {

using Field = std::function<double(double, double, double)>;      ///< of world x, y, z
using LevelOf = std::function<LevelTriple(const Index3& brick)>;  ///< brick x, y, z

inline Grid centred_grid(const Index3& cells, const Vec3& spacing = {1, 1, 1}) {
  Grid g;
  g.cells = cells;
  g.spacing = spacing;
  for (std::size_t a = 0; a < 3; ++a) g.origin[a] = -0.5 * static_cast<double>(cells[a]) * spacing[a];
  return g;
}

inline Volume uniform(const Grid& grid, const Field& f) {
  Volume v{grid, {}};
  const Index3 n = grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Vec3 p = grid.position({x, y, z});
        v.samples.push_back(static_cast<float>(f(p[0], p[1], p[2])));
      }
  return v;
}

/// One tile of f; beyond the grid the last plane repeats.
inline std::vector<float> tile_of(const MixedVolume& v, const Index3& brick, const LevelTriple& level,
                                  const Field& f) {
  std::vector<float> tile;
  const Grid& grid = v.grid;
  const auto at = [&](std::size_t a, std::int64_t i) {
    const double cell = static_cast<double>(brick[a] * v.granularity) +
                        std::ldexp(static_cast<double>(i), v.coarsening[2 - a] - level[2 - a]);
    return grid.origin[a] + std::min(cell, static_cast<double>(grid.cells[a])) * grid.spacing[a];
  };
  const auto side = v.tile_shape(level);
  for (std::int64_t z = 0; z < side[0]; ++z)
    for (std::int64_t y = 0; y < side[1]; ++y)
      for (std::int64_t x = 0; x < side[2]; ++x)
        tile.push_back(static_cast<float>(f(at(0, x), at(1, y), at(2, z))));
  return tile;
}

/// f sampled at each brick's level. Not closed: continuous across levels only where f is trilinear on the
/// coarser cells.
inline MixedVolume mixed(const Grid& grid, int granularity, const LevelOf& level_of, const Field& f,
                         const LevelTriple& coarsening = {}) {
  Grid base = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    base.cells[a] >>= coarsening[2 - a];
    base.spacing[a] *= 1 << coarsening[2 - a];
  }
  MixedVolume m = as_mixed(Volume{grid, uniform(base, f).samples}, granularity);
  m.coarsening = coarsening;
  const Index3 b = m.bricks();
  std::size_t i = 0;
  for (std::int64_t z = 0; z < b[2]; ++z)
    for (std::int64_t y = 0; y < b[1]; ++y)
      for (std::int64_t x = 0; x < b[0]; ++x, ++i) {
        const LevelTriple level = level_of({x, y, z});
        m.level[i] = level;
        if (level == LevelTriple{0, 0, 0}) continue;
        auto& tiles = m.tiles[level].f32;
        m.tile[i] = static_cast<std::uint32_t>(static_cast<std::int64_t>(tiles.size()) / m.tile_size(level));
        const auto tile = tile_of(m, {x, y, z}, level, f);
        for (const float sample : tile) tiles.push_back(sample);
        for (std::size_t a = 0; a < 3; ++a)
          if (level[a] > coarsening[a]) m.rate = std::max(m.rate, 1 << (level[a] - coarsening[a]));
      }
  return m;
}

}  // namespace vdvr::fields
