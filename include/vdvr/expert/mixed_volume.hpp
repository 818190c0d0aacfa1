// The certified volume: base samples, an index of bricks, and tiles per level triple (docs/file-format.md).
//
// A brick is granularity^3 cells of the grid. The base has a sample every 2^c cells, c = coarsening per axis;
// a brick's level triple (lz, ly, lx) sets the spacing spacing * 2^(c - l). A brick of level (0,0,0) reads
// `base`; any other reads tile number `tile` of its triple:
// tile[g*2^(lz-cz)+1][g*2^(ly-cy)+1][g*2^(lx-cx)+1], on the brick's closed box. Beyond the grid a tile
// repeats its last plane, which is never read. Base and tiles are float32, or integers on one lattice.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/sample_array.hpp"

namespace vdvr {

/// Levels per axis in file order: z, y, x.
using LevelTriple = std::array<std::uint8_t, 3>;
inline constexpr LevelTriple level_of_base{0, 0, 0};

enum class SampleType : std::uint8_t { f32, u16, u8 };  // the order of kernels/shared/mixed_sampler.h
/// "f32", "u16", "u8".
VDVR_API const char* text_of(SampleType type);
/// Which of them base and tiles take.
enum class StorageChoice { automatic, f32, u16, u8 };

/// Stored samples of equal tiles (the base volume is one tile) in the array that `type` names; the others are
/// empty. An integer stands for step * (offset + stored * 2^shift), offset and shift those of its tile:
/// |offset + stored * 2^shift| < 2^24 and step is a power of two, so that every sample is exact in fp32.
struct SampleBlock {
  SampleType type = SampleType::f32;
  Samples<float> f32;
  Samples<std::uint16_t> u16;
  Samples<std::uint8_t> u8;
  std::vector<std::int32_t> offset;  ///< per tile, a multiple of 2^shift; integers only
  std::vector<std::uint8_t> shift;   ///< per tile, at most 24; integers only

  SampleBlock() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): float samples are a block as they are
  SampleBlock(std::vector<float> samples) : f32(std::move(samples)) {}
  [[nodiscard]] std::uint64_t size() const {
    return type == SampleType::f32 ? f32.size() : type == SampleType::u16 ? u16.size() : u8.size();
  }
  [[nodiscard]] std::uint64_t sample_bytes() const {
    return type == SampleType::f32 ? sizeof(float) : type == SampleType::u16 ? 2 : 1;
  }
  [[nodiscard]] std::uint64_t bytes() const { return size() * sample_bytes(); }  ///< without offset and shift
  [[nodiscard]] const void* data() const {
    if (type == SampleType::f32) return f32.data();
    return type == SampleType::u16 ? static_cast<const void*>(u16.data()) : u8.data();
  }
};
/// All samples of a block as floats, exactly. `step` as in MixedVolume.
VDVR_API std::vector<float> decoded(const SampleBlock& block, double step);

/// Tiles of one level triple and one sample type. A triple whose tiles have several types has a part for
/// each, numbered from 0; tile numbers run on from part to part.
struct TileKind {
  LevelTriple level{};
  std::uint8_t part = 0;

  TileKind() = default;
  // NOLINTBEGIN(google-explicit-constructor): most triples have one type, and no need to speak of parts
  TileKind(const LevelTriple& triple, std::uint8_t number = 0) : level(triple), part(number) {}
  TileKind(std::uint8_t z, std::uint8_t y, std::uint8_t x) : level{z, y, x} {}
  operator const LevelTriple&() const { return level; }
  // NOLINTEND(google-explicit-constructor)
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the comparison with 0 for a pointer's
  auto operator<=>(const TileKind&) const = default;
};
/// Whether a brick has a level for each axis, or one for all three.
enum class Levels { isotropic, anisotropic };
/// "isotropic", "anisotropic".
constexpr const char* text_of(Levels levels) {
  return levels == Levels::isotropic ? "isotropic" : "anisotropic";
}

/// How samples are arranged; MixedVolume holds what of it readers of samples need.
struct VolumeLayout {
  int granularity = 4;       ///< cells per brick and axis
  LevelTriple coarsening{};  ///< log2 of cells per base cell, z, y, x
  Levels levels = Levels::anisotropic;
};

/// As many as there are sample types.
inline constexpr std::uint8_t most_parts = 3;

/// Samples per axis x, y, z of a grid's base: one every 2^coarsening cells.
inline Index3 base_samples(const Grid& grid, const LevelTriple& coarsening) {
  return {(grid.cells[0] >> coarsening[2]) + 1, (grid.cells[1] >> coarsening[1]) + 1,
          (grid.cells[2] >> coarsening[0]) + 1};
}
/// The level whose samples are gold, z, y, x. `rate` is a power of two.
inline LevelTriple finest_level(int rate, const LevelTriple& coarsening) {
  LevelTriple finest = coarsening;
  for (std::uint8_t& level : finest)
    level = static_cast<std::uint8_t>(level + std::countr_zero(static_cast<unsigned>(rate)));
  return finest;
}

struct MixedVolume {
  Grid grid;
  int granularity = 4;
  int rate = 1;                           ///< gold rate: no level is above log2(rate) + coarsening
  LevelTriple coarsening{};               ///< log2 of cells per base cell; divides cells and granularity
  SampleBlock base;                       ///< [nz/2^cz+1][ny/2^cy+1][nx/2^cx+1]
  std::vector<LevelTriple> level;         ///< [bz][by][bx]
  std::vector<std::uint32_t> tile;        ///< [bz][by][bx]: its number among its triple's
  std::map<TileKind, SampleBlock> tiles;  ///< per triple and type: [count][sz][sy][sx]
  double step = 0;                        ///< of the lattice of integer samples; 0 where there are none

  /// ceil(cells / granularity) per axis x, y, z.
  [[nodiscard]] Index3 bricks() const {
    Index3 b{};
    for (std::size_t a = 0; a < 3; ++a) b[a] = (grid.cells[a] + granularity - 1) / granularity;
    return b;
  }
  [[nodiscard]] std::int64_t brick_count() const {
    const Index3 b = bricks();
    return b[0] * b[1] * b[2];
  }
  /// Samples of the base per axis x, y, z.
  [[nodiscard]] Index3 base_samples() const { return vdvr::base_samples(grid, coarsening); }
  /// Samples of one tile per axis z, y, x.
  [[nodiscard]] std::array<std::int64_t, 3> tile_shape(const LevelTriple& l) const {
    const auto side = [&](std::size_t axis) {
      return (static_cast<std::int64_t>(granularity) << l[axis] >> coarsening[axis]) + 1;
    };
    return {side(0), side(1), side(2)};
  }
  [[nodiscard]] std::int64_t tile_size(const LevelTriple& l) const {
    const auto s = tile_shape(l);
    return s[0] * s[1] * s[2];
  }
};

/// Calls `work` with the base, then with the tiles' blocks in order of their kinds. `volume` may be const.
template <class Volume, class Work>
void for_each_block(Volume& volume, const Work& work) {
  work(volume.base);
  for (auto& [kind, block] : volume.tiles) work(block);
}
/// Calls `work` with each array of samples of each block, whatever its type; two of three are empty.
template <class Volume, class Work>
void for_each_array(Volume& volume, const Work& work) {
  for_each_block(volume, [&](auto& block) {
    work(block.f32);
    work(block.u16);
    work(block.u8);
  });
}

/// A volume with every brick at level 0: the uniform grid as a mixed one, so that one sampler serves both.
VDVR_API MixedVolume as_mixed(const Volume& volume, int granularity = 4);

/// A uniform volume on the grid: the base, decoded; where that is coarser than the grid, the field at the
/// grid's samples.
VDVR_API Volume on_grid(const MixedVolume& volume);

/// The brick (x, y, z) a world point belongs to, by the same header; the point is clamped to the grid's box.
VDVR_API Index3 brick_at(const MixedVolume& volume, const Vec3& point);

/// The value of the certified field at a world point, by the sampler of kernels/shared/mixed_sampler.h on the
/// host
/// (`buffer` arithmetic, the same bits as the device). The point must lie in the grid's box; it is clamped to
/// it.
VDVR_API float sample_at(const MixedVolume& volume, const Vec3& point);

/// Storage, as defined in docs/file-format.md.
struct Storage {
  double samples_ratio = 1;  ///< (base + index + tile samples) / base samples
  double bytes_ratio = 1;    ///< device-resident bytes / bytes of the float32 base volume
  std::uint64_t device_bytes = 0;
  std::uint64_t file_bytes = 0;
};
/// `interior`: only bricks wholly within 7/8 of the box in x and y, all z.
VDVR_API Storage storage_of(const MixedVolume& volume, bool interior);

}  // namespace vdvr
