// The certified volume on the host: brick records, sampling by the shared header, storage figures.
#include "vdvr/mixed_volume.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "host/brick_layout.hpp"

namespace vdvr {

static_assert(sizeof(VdvrBrick) == 48 && offsetof(VdvrBrick, level_x) == 16 &&
              offsetof(VdvrBrick, texel_x) == 32);
static_assert(sizeof(VdvrGrid) == 32);

VdvrGrid sampler_grid(const MixedVolume& v) {
  const Index3 b = v.bricks();
  const auto i32 = [](std::int64_t n) { return static_cast<std::int32_t>(n); };
  return {i32(v.grid.cells[0]),
          i32(v.grid.cells[1]),
          i32(v.grid.cells[2]),
          v.granularity,
          i32(b[0]),
          i32(b[1]),
          i32(b[2]),
          0};
}

std::map<LevelTriple, std::uint64_t> tile_offsets(const MixedVolume& v) {
  std::map<LevelTriple, std::uint64_t> offsets;
  std::uint64_t next = static_cast<std::uint64_t>(v.grid.sample_count());
  for (const auto& [triple, samples] : v.tiles) {
    offsets[triple] = next;
    next += samples.size();
  }
  return offsets;
}

std::uint64_t sample_buffer_size(const MixedVolume& v) {
  std::uint64_t n = static_cast<std::uint64_t>(v.grid.sample_count());
  for (const auto& [triple, samples] : v.tiles) n += samples.size();
  return n;
}

VdvrBrick brick_record(const MixedVolume& v, const std::map<LevelTriple, std::uint64_t>& offsets,
                       std::int64_t bx, std::int64_t by, std::int64_t bz) {
  const Index3 bricks = v.bricks(), samples = v.grid.samples();
  const auto index = static_cast<std::size_t>((bz * bricks[1] + by) * bricks[0] + bx);
  const LevelTriple level = v.level[index];
  VdvrBrick r{};
  r.level_z = level[0];
  r.level_y = level[1];
  r.level_x = level[2];
  if (level == LevelTriple{0, 0, 0}) {
    const std::int64_t g = v.granularity;
    r.offset = static_cast<std::uint64_t>((bz * g * samples[1] + by * g) * samples[0] + bx * g);
    r.stride_y = static_cast<std::uint32_t>(samples[0]);
    r.stride_z = static_cast<std::uint32_t>(samples[0] * samples[1]);
  } else {
    const auto shape = v.tile_shape(level);
    r.offset = offsets.at(level) +
               static_cast<std::uint64_t>(v.tile[index]) * static_cast<std::uint64_t>(v.tile_size(level));
    r.stride_y = static_cast<std::uint32_t>(shape[2]);
    r.stride_z = static_cast<std::uint32_t>(shape[2] * shape[1]);
  }
  return r;
}

std::vector<VdvrBrick> brick_records(const MixedVolume& v) {
  const auto offsets = tile_offsets(v);
  const Index3 b = v.bricks();
  std::vector<VdvrBrick> records;
  records.reserve(static_cast<std::size_t>(v.brick_count()));
  for (std::int64_t z = 0; z < b[2]; ++z)
    for (std::int64_t y = 0; y < b[1]; ++y)
      for (std::int64_t x = 0; x < b[0]; ++x) records.push_back(brick_record(v, offsets, x, y, z));
  return records;
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
  const std::int32_t bx = vdvr_brick_of(c[0], grid.granularity, grid.bricks_x);
  const std::int32_t by = vdvr_brick_of(c[1], grid.granularity, grid.bricks_y);
  const std::int32_t bz = vdvr_brick_of(c[2], grid.granularity, grid.bricks_z);
  const auto index = (static_cast<std::size_t>(bz) * static_cast<std::size_t>(grid.bricks_y) +
                      static_cast<std::size_t>(by)) *
                         static_cast<std::size_t>(grid.bricks_x) +
                     static_cast<std::size_t>(bx);
  const LevelTriple level = v.level[index];
  const bool in_base = level == LevelTriple{0, 0, 0};
  // Offsets relative to this brick's own array, so that nothing has to be packed for one sample.
  const VdvrBrick r = brick_record(v, {{level, 0}}, bx, by, bz);
  const float* first = (in_base ? v.base.data() : v.tiles.at(level).data()) + r.offset;
  return vdvr_sample_in_brick(first, r.stride_y, r.stride_z,
                              vdvr_local(c[0], bx, r.level_x, grid.granularity, grid.cells_x),
                              vdvr_local(c[1], by, r.level_y, grid.granularity, grid.cells_y),
                              vdvr_local(c[2], bz, r.level_z, grid.granularity, grid.cells_z));
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
  double base = 0, index = 0, tiles = 0;
  for (std::int64_t z = 0; z < b[2]; ++z)
    for (std::int64_t y = 0; y < b[1]; ++y)
      for (std::int64_t x = 0; x < b[0]; ++x) {
        if (interior && !is_interior(v, {x, y, z})) continue;
        const LevelTriple level = v.level[static_cast<std::size_t>((z * b[1] + y) * b[0] + x)];
        index += 1;
        if (level != LevelTriple{0, 0, 0}) tiles += static_cast<double>(v.tile_size(level));
        double cells = 1;
        for (std::size_t a = 0; a < 3; ++a) {
          const std::int64_t first = (a == 0 ? x : a == 1 ? y : z) * v.granularity;
          cells *= static_cast<double>(std::min<std::int64_t>(v.granularity, v.grid.cells[a] - first));
        }
        base += cells;
      }
  Storage s;
  if (!interior) base = static_cast<double>(v.grid.sample_count());
  if (base == 0) return s;
  s.samples_ratio = (base + index + tiles) / base;
  // Resident: float32 samples, and per brick a 4-byte tile number and 3 bytes of levels.
  const double bytes = 4 * (base + tiles) + 7 * index;
  s.bytes_ratio = bytes / (4 * base);
  s.device_bytes = static_cast<std::uint64_t>(bytes);
  return s;
}

}  // namespace vdvr
