// Offsets in the sample buffer, brick records, and one brick's samples on the host.
#include "host/volume/brick_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "host/base/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrGrid) == 48 && offsetof(VdvrGrid, step) == 28 && offsetof(VdvrGrid, coarse_x) == 32);
static_assert(static_cast<int>(SampleType::f32) == VDVR_F32 &&
              static_cast<int>(SampleType::u16) == VDVR_U16 && static_cast<int>(SampleType::u8) == VDVR_U8);

namespace {

std::uint64_t aligned(std::uint64_t bytes) { return (bytes + 3) / 4 * 4; }

}  // namespace

int sample_types(const MixedVolume& v) {
  int types = 0;
  for_each_block(v, [&](const SampleBlock& block) { types |= 1 << static_cast<int>(block.type); });
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
  std::uint64_t n = 0;
  for_each_block(v, [&](const SampleBlock& block) { n += aligned(block.bytes()); });
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
  const StoredTile stored = level == level_of_base ? StoredTile{{}, &v.base, 0} : stored_tile(v, brick);
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
  if (level == level_of_base) {
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
  for_each_block(v, [&](const SampleBlock& b) {
    for (std::size_t i = 0; compact && i < b.offset.size(); ++i)
      compact = fits_compact(b.offset[i], b.shift[i]);
  });
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
  const StoredTile stored = level == level_of_base ? StoredTile{{}, &v.base, 0} : stored_tile(v, id);
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

}  // namespace vdvr
