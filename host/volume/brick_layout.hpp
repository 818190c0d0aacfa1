// Where each brick's samples lie: on the host in its own arrays, on the device in one sample buffer. That has
// the base first, then the tiles of each triple and type in map order, each block at a multiple of 4 bytes.
#pragma once

#include <map>
#include <vector>

#include "vdvr/expert/mixed_volume.hpp"

#define VDVR_DIALECT_HOST
#define VDVR_SAMPLE_TYPES 7
#define VDVR_RECORDS 2
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"  // the shared headers are C99
#include "shared/mixed_sampler.h"
#pragma GCC diagnostic pop

namespace vdvr {

/// 1 << type over the types that base and tiles have: what kernels are compiled for.
int sample_types(const MixedVolume& volume);

VdvrGrid sampler_grid(const MixedVolume& volume);

/// Index x, y, z of a brick's first sample in the base.
Index3 first_base_sample(const MixedVolume& volume, const Index3& brick);

/// Where a brick of a level above 0 has its samples.
struct StoredTile {
  TileKind kind;
  const SampleBlock* block = nullptr;
  std::size_t number = 0;  ///< in the block
};
StoredTile stored_tile(const MixedVolume& volume, std::size_t brick);

/// Offset of the first tile of each triple and type in the sample buffer, in bytes; base lies at 0.
std::map<TileKind, std::uint64_t> tile_offsets(const MixedVolume& volume);
/// Bytes of the sample buffer.
std::uint64_t sample_buffer_bytes(const MixedVolume& volume);

/// The record of brick (bx, by, bz), unpacked; `base_around` is left 0.
VdvrBrick brick_record(const MixedVolume& volume, const std::map<TileKind, std::uint64_t>& offsets,
                       std::int64_t bx, std::int64_t by, std::int64_t bz);

/// What mixed_sampler.h has for records.
enum class RecordKind { f32 = VDVR_RECORDS_F32, compact = VDVR_RECORDS_COMPACT, wide = VDVR_RECORDS_WIDE };
/// The smallest that all of the volume's records fit; with texels for places, where integers occur, `wide`.
RecordKind record_kind(const MixedVolume& volume, bool texels = false);
constexpr std::size_t words_of(RecordKind kind) { return kind == RecordKind::wide ? 3 : 2; }

/// [bz][by][bx][words].
class PackedRecords {
 public:
  PackedRecords(const MixedVolume& volume, const std::map<TileKind, std::uint64_t>& offsets, RecordKind kind);
  void set_base_around(std::size_t brick) { words_[brick * count_ + 1] |= 1u << 9; }
  /// Puts something else in the place of the first sample: a texel. Below 2^47, in compact records 2^32.
  void set_place(std::size_t brick, std::uint64_t place);
  [[nodiscard]] const std::vector<std::uint32_t>& words() const { return words_; }
  [[nodiscard]] RecordKind kind() const { return kind_; }

 private:
  RecordKind kind_;
  std::size_t count_;  // words per brick
  std::vector<std::uint32_t> words_;
};

/// One brick's stored samples on the host.
class BrickSamples {
 public:
  BrickSamples(const MixedVolume& volume, const Index3& brick);

  /// The stored sample number x, y, z, decoded.
  [[nodiscard]] float operator()(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const auto i = static_cast<std::size_t>(static_cast<std::int64_t>(record_.place) + z * record_.stride_z +
                                            y * record_.stride_y + x);
    if (record_.type == VDVR_F32) return static_cast<const float*>(data_)[i];
    const std::uint32_t stored = record_.type == VDVR_U16 ? static_cast<const std::uint16_t*>(data_)[i]
                                                          : static_cast<const std::uint8_t*>(data_)[i];
    return static_cast<float>(stored) * record_.scale + record_.bias;
  }
  /// The field at a cell coordinate of this brick, by the shared sampler; c may lie on its far faces.
  [[nodiscard]] float at(float cx, float cy, float cz) const;
  /// The same where the places along x, y, z are known already.
  [[nodiscard]] float at(const VdvrLocal& x, const VdvrLocal& y, const VdvrLocal& z) const {
    return vdvr_sample_in_brick(data_, record_, x, y, z);
  }
  /// Levels along x, y, z.
  [[nodiscard]] std::array<int, 3> level() const {
    return {static_cast<int>(record_.level_x), static_cast<int>(record_.level_y),
            static_cast<int>(record_.level_z)};
  }
  /// log2 of samples per cell of the grid along x, y, z: negative where it has several cells to a sample.
  [[nodiscard]] std::array<int, 3> per_cell() const {
    return {static_cast<int>(record_.level_x) - grid_.coarse_x,
            static_cast<int>(record_.level_y) - grid_.coarse_y,
            static_cast<int>(record_.level_z) - grid_.coarse_z};
  }
  /// Number of the last sample along x, y, z that lies in the grid.
  [[nodiscard]] const Index3& end() const { return end_; }
  [[nodiscard]] const VdvrBrick& record() const { return record_; }

 private:
  VdvrGrid grid_;
  Index3 brick_, end_{};
  VdvrBrick record_;  // its place is relative to data_
  const void* data_;
};

}  // namespace vdvr
