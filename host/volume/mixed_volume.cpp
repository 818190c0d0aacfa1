// The certified volume on the host: sampling by the shared header, and storage figures.
#include "vdvr/expert/mixed_volume.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {

namespace {

template <class T>
void decode(const Samples<T>& stored, const SampleBlock& b, double step, std::vector<float>& out) {
  const std::size_t per_tile = b.offset.empty() ? 1 : stored.size() / b.offset.size();
  for (std::size_t i = 0; i < stored.size(); ++i) {
    const std::size_t tile = i / per_tile;
    out.push_back(static_cast<float>(
        step * (static_cast<double>(b.offset.at(tile)) + std::ldexp(stored[i], b.shift.at(tile)))));
  }
}

}  // namespace

const char* text_of(SampleType type) {
  return type == SampleType::f32 ? "f32" : type == SampleType::u16 ? "u16" : "u8";
}

std::vector<float> decoded(const SampleBlock& b, double step) {
  if (b.type == SampleType::f32) return {b.f32.begin(), b.f32.end()};
  std::vector<float> out;
  out.reserve(b.size());
  if (b.type == SampleType::u16) decode(b.u16, b, step, out);
  else decode(b.u8, b, step, out);
  return out;
}

MixedVolume as_mixed(const Volume& volume, int granularity) {
  MixedVolume m;
  m.grid = volume.grid;
  m.granularity = granularity;
  m.base = volume.samples;
  m.level.assign(static_cast<std::size_t>(m.brick_count()), LevelTriple{0, 0, 0});
  m.tile.assign(static_cast<std::size_t>(m.brick_count()), 0);
  return m;
}

Volume on_grid(const MixedVolume& v) {
  if (v.coarsening == LevelTriple{}) return {v.grid, decoded(v.base, v.step)};
  const Index3 n = v.grid.samples(), bricks = v.bricks();
  Volume out{v.grid, std::vector<float>(at(n[0] * n[1] * n[2]))};
  // Samples that a brick owns: its low faces, and at the end of the grid the high ones too.
  const auto end = [&](std::int64_t brick, std::size_t a) {
    return brick + 1 == bricks[a] ? n[a] : (brick + 1) * v.granularity;
  };
  parallel_for(bricks[2] * bricks[1], {}, "grid", [&](std::int64_t row) {
    const std::int64_t bz = row / bricks[1], by = row % bricks[1];
    for (std::int64_t bx = 0; bx < bricks[0]; ++bx) {
      const BrickSamples stored(v, {bx, by, bz});
      for (std::int64_t z = bz * v.granularity; z < end(bz, 2); ++z)
        for (std::int64_t y = by * v.granularity; y < end(by, 1); ++y)
          for (std::int64_t x = bx * v.granularity; x < end(bx, 0); ++x)
            out.samples[at((z * n[1] + y) * n[0] + x)] =
                stored.at(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    }
  });
  return out;
}

namespace {

/// A world point in cells, clamped to the grid's box.
std::array<float, 3> in_cells(const MixedVolume& v, const Vec3& point) {
  std::array<float, 3> c{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double cell = (point[a] - v.grid.origin[a]) / v.grid.spacing[a];
    c[a] = static_cast<float>(std::clamp(cell, 0.0, static_cast<double>(v.grid.cells[a])));
  }
  return c;
}

}  // namespace

Index3 brick_at(const MixedVolume& v, const Vec3& point) {
  const VdvrGrid grid = sampler_grid(v);
  const std::array<float, 3> c = in_cells(v, point);
  return {vdvr_brick_of(c[0], grid.granularity, grid.bricks_x),
          vdvr_brick_of(c[1], grid.granularity, grid.bricks_y),
          vdvr_brick_of(c[2], grid.granularity, grid.bricks_z)};
}

float sample_at(const MixedVolume& v, const Vec3& point) {
  const VdvrGrid grid = sampler_grid(v);
  const std::array<float, 3> c = in_cells(v, point);
  const Index3 brick{vdvr_brick_of(c[0], grid.granularity, grid.bricks_x),
                     vdvr_brick_of(c[1], grid.granularity, grid.bricks_y),
                     vdvr_brick_of(c[2], grid.granularity, grid.bricks_z)};
  return BrickSamples(v, brick).at(c[0], c[1], c[2]);
}

namespace {

bool is_interior(const MixedVolume& v, const Index3& brick) {
  for (std::size_t a = 0; a < 2; ++a) {
    const double n = static_cast<double>(v.grid.cells[a]), edge = n / 16;
    const double lo = static_cast<double>(brick[a] * v.granularity);
    const double hi = static_cast<double>(std::min(v.grid.cells[a], (brick[a] + 1) * v.granularity));
    if (lo < edge || hi > n - edge) return false;
  }
  return true;
}

}  // namespace

Storage storage_of(const MixedVolume& v, bool interior) {
  const Index3 b = v.bricks();
  double base = 0, index = 0, tiles = 0, tile_bytes = 0;
  for (std::int64_t z = 0; z < b[2]; ++z)
    for (std::int64_t y = 0; y < b[1]; ++y)
      for (std::int64_t x = 0; x < b[0]; ++x) {
        if (interior && !is_interior(v, {x, y, z})) continue;
        const LevelTriple level = v.level[at((z * b[1] + y) * b[0] + x)];
        index += 1;
        if (level != level_of_base) {
          tiles += static_cast<double>(v.tile_size(level));
          tile_bytes +=
              static_cast<double>(v.tile_size(level)) *
              static_cast<double>(stored_tile(v, at((z * b[1] + y) * b[0] + x)).block->sample_bytes());
        }
        double cells = 1;
        for (std::size_t a = 0; a < 3; ++a) {
          const std::int64_t first = (a == 0 ? x : a == 1 ? y : z) * v.granularity;
          cells *= static_cast<double>(std::min<std::int64_t>(v.granularity, v.grid.cells[a] - first));
        }
        base += cells;
      }
  // What a brick has of the base are its cells there.
  double stored_base = std::ldexp(base, -(v.coarsening[0] + v.coarsening[1] + v.coarsening[2]));
  if (!interior) {
    base = static_cast<double>(v.grid.sample_count());
    stored_base = static_cast<double>(v.base.size());
  }
  Storage s;
  if (base == 0) return s;
  s.samples_ratio = (stored_base + index + tiles) / base;
  // Resident: samples, the bricks' records, and per brick a byte of distance by which rays leap.
  const double record = 4 * static_cast<double>(words_of(record_kind(v)));
  const double bytes =
      static_cast<double>(v.base.sample_bytes()) * stored_base + tile_bytes + (record + 1) * index;
  s.bytes_ratio = bytes / (4 * base);
  s.device_bytes = static_cast<std::uint64_t>(bytes);
  return s;
}

}  // namespace vdvr
