// The certified volume on the host: brick records, sampling by the shared header, storage figures.
#include "vdvr/mixed_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "host/system/parallel.hpp"
#include "host/volume/brick_layout.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrGrid) == 48 && offsetof(VdvrGrid, step) == 28 && offsetof(VdvrGrid, coarse_x) == 32);
static_assert(static_cast<int>(SampleType::f32) == VDVR_F32 &&
              static_cast<int>(SampleType::u16) == VDVR_U16 && static_cast<int>(SampleType::u8) == VDVR_U8);

namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }
constexpr LevelTriple in_base{0, 0, 0};

std::uint64_t aligned(std::uint64_t bytes) { return (bytes + 3) / 4 * 4; }

template <class T>
void decode(const std::vector<T>& stored, const SampleBlock& b, double step, std::vector<float>& out) {
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
  if (b.type == SampleType::f32) return b.f32;
  std::vector<float> out;
  out.reserve(b.size());
  if (b.type == SampleType::u16) decode(b.u16, b, step, out);
  else decode(b.u8, b, step, out);
  return out;
}

int sample_types(const MixedVolume& v) {
  int types = 1 << static_cast<int>(v.base.type);
  for (const auto& [triple, block] : v.tiles) types |= 1 << static_cast<int>(block.type);
  return types;
}

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
          static_cast<float>(v.step),
          v.coarsening[2],
          v.coarsening[1],
          v.coarsening[0],
          0};
}

Index3 first_base_sample(const MixedVolume& v, const Index3& brick) {
  Index3 first{};
  for (std::size_t a = 0; a < 3; ++a) first[a] = brick[a] * v.granularity >> v.coarsening[2 - a];
  return first;
}

StoredTile stored_tile(const MixedVolume& v, std::size_t brick) {
  StoredTile t{{v.level[brick]}, nullptr, v.tile[brick]};
  for (;; ++t.kind.part) {
    t.block = &v.tiles.at(t.kind);
    const std::size_t count = t.block->size() / at(v.tile_size(t.kind));
    // The last part takes what is left: whoever reads beyond it finds nothing there.
    if (t.number < count || !v.tiles.contains({t.kind.level, static_cast<std::uint8_t>(t.kind.part + 1)}))
      return t;
    t.number -= count;
  }
}

std::map<TileKind, std::uint64_t> tile_offsets(const MixedVolume& v) {
  std::map<TileKind, std::uint64_t> offsets;
  std::uint64_t next = aligned(v.base.bytes());
  for (const auto& [triple, block] : v.tiles) {
    offsets[triple] = next;
    next += aligned(block.bytes());
  }
  return offsets;
}

std::uint64_t sample_buffer_bytes(const MixedVolume& v) {
  std::uint64_t n = aligned(v.base.bytes());
  for (const auto& [triple, block] : v.tiles) n += aligned(block.bytes());
  return n;
}

namespace {

// What a record says in its bits and its lattice offset, without its place.
struct RecordBits {
  std::uint32_t bits = 0;
  std::int32_t offset = 0;
};
RecordBits record_bits(const MixedVolume& v, std::size_t brick) {
  const LevelTriple level = v.level[brick];
  const StoredTile stored = level == in_base ? StoredTile{{}, &v.base, 0} : stored_tile(v, brick);
  const SampleBlock& block = *stored.block;
  RecordBits r;
  r.bits = level[2] | static_cast<std::uint32_t>(level[1]) << 3 | static_cast<std::uint32_t>(level[0]) << 6 |
           static_cast<std::uint32_t>(block.type) << 10;
  if (block.type == SampleType::f32) return r;
  r.bits |= static_cast<std::uint32_t>(block.shift.at(stored.number)) << 12;
  r.offset = block.offset.at(stored.number);
  return r;
}

std::uint64_t place_of(const MixedVolume& v, const std::map<TileKind, std::uint64_t>& offsets,
                       std::int64_t bx, std::int64_t by, std::int64_t bz) {
  const Index3 bricks = v.bricks(), samples = v.base_samples();
  const std::size_t brick = at((bz * bricks[1] + by) * bricks[0] + bx);
  const LevelTriple level = v.level[brick];
  if (level == in_base) {
    const Index3 first = first_base_sample(v, {bx, by, bz});
    return static_cast<std::uint64_t>((first[2] * samples[1] + first[1]) * samples[0] + first[0]);
  }
  const StoredTile tile = stored_tile(v, brick);
  return offsets.at(tile.kind) / tile.block->sample_bytes() +
         std::uint64_t{tile.number} * static_cast<std::uint64_t>(v.tile_size(level));
}

// An offset is a multiple of 2^shift.
bool fits_compact(std::int32_t offset, int shift) {
  const std::int32_t n = offset >> shift;
  return -(1 << 14) <= n && n < 1 << 14;
}

}  // namespace

VdvrBrick brick_record(const MixedVolume& v, const std::map<TileKind, std::uint64_t>& offsets,
                       std::int64_t bx, std::int64_t by, std::int64_t bz) {
  const Index3 b = v.bricks();
  const RecordBits r = record_bits(v, at((bz * b[1] + by) * b[0] + bx));
  const std::uint64_t place = place_of(v, offsets, bx, by, bz);
  return vdvr_unpack(place, r.bits, r.offset, sampler_grid(v));
}

RecordKind record_kind(const MixedVolume& v, bool texels) {
  if (sample_types(v) == 1 << VDVR_F32) return RecordKind::f32;
  bool compact = !texels && sample_buffer_bytes(v) >> 32 == 0;
  const auto look = [&](const SampleBlock& b) {
    for (std::size_t i = 0; compact && i < b.offset.size(); ++i)
      compact = fits_compact(b.offset[i], b.shift[i]);
  };
  look(v.base);
  for (const auto& [kind, block] : v.tiles) look(block);
  return compact ? RecordKind::compact : RecordKind::wide;
}

PackedRecords::PackedRecords(const MixedVolume& v, const std::map<TileKind, std::uint64_t>& offsets,
                             RecordKind kind)
    : kind_(kind), count_(words_of(kind)), words_(v.level.size() * count_) {
  const Index3 b = v.bricks();
  std::size_t brick = 0;
  for (std::int64_t z = 0; z < b[2]; ++z)
    for (std::int64_t y = 0; y < b[1]; ++y)
      for (std::int64_t x = 0; x < b[0]; ++x, ++brick) {
        const RecordBits r = record_bits(v, brick);
        words_[brick * count_ + 1] = r.bits;
        if (kind == RecordKind::compact)
          words_[brick * count_ + 1] |= static_cast<std::uint32_t>(r.offset >> (r.bits >> 12 & 31)) << 17;
        if (kind == RecordKind::wide) words_[brick * count_ + 2] = static_cast<std::uint32_t>(r.offset);
        set_place(brick, place_of(v, offsets, x, y, z));
      }
}

void PackedRecords::set_place(std::size_t brick, std::uint64_t place) {
  const int most = kind_ == RecordKind::compact ? 32 : 47;
  if (place >> most != 0)
    throw InputError(
        fmt::format("a brick's samples lie at place {}, beyond 2^{}: the volume is too large", place, most));
  std::uint32_t& bits = words_[brick * count_ + 1];
  words_[brick * count_] = static_cast<std::uint32_t>(place);
  if (kind_ == RecordKind::compact) return;
  bits = (bits & 0x1ffffu) | static_cast<std::uint32_t>(place >> 32) << 17;
}

BrickSamples::BrickSamples(const MixedVolume& v, const Index3& brick)
    : grid_(sampler_grid(v)), brick_(brick) {
  const Index3 b = v.bricks();
  const std::size_t id = vdvr::at((brick[2] * b[1] + brick[1]) * b[0] + brick[0]);
  const LevelTriple level = v.level[id];
  const StoredTile stored = level == in_base ? StoredTile{{}, &v.base, 0} : stored_tile(v, id);
  record_ = brick_record(v, {{stored.kind, 0}}, brick[0], brick[1], brick[2]);
  data_ = stored.block->data();
  for (std::size_t a = 0; a < 3; ++a)
    end_[a] = std::min<std::int64_t>(v.granularity, v.grid.cells[a] - brick[a] * v.granularity)
                  << level[2 - a] >>
              v.coarsening[2 - a];
}

float BrickSamples::at(float cx, float cy, float cz) const {
  const auto local = [&](float c, std::size_t a, std::uint32_t level, std::int32_t cells,
                         std::int32_t coarse) {
    return vdvr_local(c, static_cast<std::int32_t>(brick_[a]), level, grid_.granularity, cells, coarse);
  };
  return vdvr_sample_in_brick(data_, record_, local(cx, 0, record_.level_x, grid_.cells_x, grid_.coarse_x),
                              local(cy, 1, record_.level_y, grid_.cells_y, grid_.coarse_y),
                              local(cz, 2, record_.level_z, grid_.cells_z, grid_.coarse_z));
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
        if (level != in_base) {
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
