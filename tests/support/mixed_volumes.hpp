// Mixed volumes for tests: random levels, shuffled tile numbers, samples from a function or at random.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::support {

/// Every brick takes one of `triples` at random, tiles in shuffled order; all samples 0.
inline MixedVolume empty_mixed(const Grid& grid, int granularity, int rate,
                               const std::vector<LevelTriple>& triples, unsigned seed,
                               const LevelTriple& coarsening = {}) {
  MixedVolume v;
  v.grid = grid;
  v.granularity = granularity;
  v.rate = rate;
  v.coarsening = coarsening;
  const Index3 base = v.base_samples();
  v.base.f32.assign(static_cast<std::size_t>(base[0] * base[1] * base[2]), 0.0f);
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
    v.tiles[triple].f32.assign(bricks.size() * static_cast<std::size_t>(v.tile_size(triple)), 0.0f);
  }
  return v;
}

/// Samples uniform in [-1, 1]: bricks disagree on shared faces, so that a test sees which brick answered.
inline MixedVolume random_mixed(const Grid& grid, int granularity, int rate,
                                const std::vector<LevelTriple>& triples, unsigned seed,
                                const LevelTriple& coarsening = {}) {
  MixedVolume v = empty_mixed(grid, granularity, rate, triples, seed, coarsening);
  std::mt19937 random(seed + 1);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (float& s : v.base.f32) s = value(random);
  for (auto& [triple, samples] : v.tiles)
    for (float& s : samples.f32) s = value(random);
  return v;
}

/// Samples of `f` at cell coordinates x, y, z; beyond the grid a tile repeats its last plane.
inline MixedVolume sampled_mixed(const Grid& grid, int granularity, int rate,
                                 const std::vector<LevelTriple>& triples, unsigned seed,
                                 const std::function<double(double, double, double)>& f,
                                 const LevelTriple& coarsening = {}) {
  MixedVolume v = empty_mixed(grid, granularity, rate, triples, seed, coarsening);
  const Index3 n = v.base_samples(), bricks = v.bricks();
  const auto cell_of = [&](std::size_t axis, std::int64_t sample) {
    return static_cast<double>(sample << coarsening[2 - axis]);
  };
  for (std::int64_t z = 0, i = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x, ++i)
        v.base.f32[static_cast<std::size_t>(i)] =
            static_cast<float>(f(cell_of(0, x), cell_of(1, y), cell_of(2, z)));
  for (std::size_t b = 0; b < v.level.size(); ++b) {
    const LevelTriple l = v.level[b];
    if (l == LevelTriple{0, 0, 0}) continue;
    const auto side = v.tile_shape(l);
    const auto id = static_cast<std::int64_t>(b);
    const Index3 brick{id % bricks[0], id / bricks[0] % bricks[1], id / (bricks[0] * bricks[1])};
    const auto at = [&](std::size_t axis, std::int64_t sample) {
      const double cell = static_cast<double>(brick[axis] * granularity) +
                          std::ldexp(static_cast<double>(sample), coarsening[2 - axis] - l[2 - axis]);
      return std::min(cell, static_cast<double>(grid.cells[axis]));
    };
    float* sample = v.tiles[l].f32.data() +
                    static_cast<std::size_t>(v.tile[b]) * static_cast<std::size_t>(v.tile_size(l));
    for (std::int64_t z = 0; z < side[0]; ++z)
      for (std::int64_t y = 0; y < side[1]; ++y)
        for (std::int64_t x = 0; x < side[2]; ++x)
          *sample++ = static_cast<float>(f(at(0, x), at(1, y), at(2, z)));
  }
  return v;
}

/// The same with base and tiles in these types, taken in turn; samples rounded to what each tile can hold.
inline MixedVolume in_types(MixedVolume v, const std::vector<SampleType>& types) {
  const double step = 0x1p-20;
  v.step = step;
  std::size_t turn = 0;
  const auto convert = [&](SampleBlock& block, std::size_t tile_size) {
    const SampleType type = types[turn++ % types.size()];
    if (type == SampleType::f32) return;
    SampleBlock out;
    out.type = type;
    const int bits = type == SampleType::u8 ? 8 : 16;
    for (std::size_t first = 0; first < block.f32.size(); first += tile_size) {
      const auto begin = block.f32.begin() + static_cast<std::ptrdiff_t>(first);
      const auto [lo, hi] = std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(tile_size));
      int shift = 0;
      while ((static_cast<double>(*hi) - static_cast<double>(*lo)) / std::ldexp(step, shift) >
             std::ldexp(1.0, bits) - 2)
        ++shift;
      const double unit = std::ldexp(step, shift), first_code = std::floor(static_cast<double>(*lo) / unit);
      out.offset.push_back(static_cast<std::int32_t>(std::ldexp(first_code, shift)));
      out.shift.push_back(static_cast<std::uint8_t>(shift));
      for (std::size_t i = 0; i < tile_size; ++i) {
        const double code = std::nearbyint(static_cast<double>(block.f32[first + i]) / unit) - first_code;
        if (type == SampleType::u8) out.u8.push_back(static_cast<std::uint8_t>(code));
        else out.u16.push_back(static_cast<std::uint16_t>(code));
      }
    }
    block = out;
  };
  convert(v.base, v.base.f32.size());
  for (auto& [triple, block] : v.tiles) convert(block, static_cast<std::size_t>(v.tile_size(triple)));
  return v;
}

/// The same with the tiles of every triple in these types, tile by tile in turn: parts in the order of
/// `types`.
inline MixedVolume in_types_by_tile(const MixedVolume& v, const std::vector<SampleType>& types) {
  MixedVolume out = v;
  out.tiles.clear();
  for (const auto& [kind, block] : v.tiles) {
    const auto size = static_cast<std::size_t>(v.tile_size(kind));
    const std::size_t count = block.f32.size() / size;
    std::vector<std::uint32_t> number(count);
    std::uint32_t next = 0;
    std::uint8_t part = 0;
    for (std::size_t t = 0; t < types.size(); ++t) {
      MixedVolume one;
      one.base.f32 = {0, 1};
      for (std::size_t tile = t; tile < count; tile += types.size()) {
        const auto from = block.f32.begin() + static_cast<std::ptrdiff_t>(tile * size);
        auto& to = one.tiles[kind].f32;
        for (std::size_t i = 0; i < size; ++i) to.push_back(from[i]);
        number[tile] = next++;
      }
      if (one.tiles.empty()) continue;
      one.granularity = v.granularity;
      one.coarsening = v.coarsening;
      out.tiles[{kind.level, part++}] = in_types(one, {types[0], types[t]}).tiles.at(kind);
    }
    for (std::size_t i = 0; i < v.level.size(); ++i)
      if (v.level[i] == kind.level) out.tile[i] = number[v.tile[i]];
  }
  MixedVolume base = v;
  base.tiles.clear();
  out.base = in_types(base, types).base;
  out.step = 0x1p-20;
  return out;
}

}  // namespace vdvr::support
