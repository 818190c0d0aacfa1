// The bricks before closing, and their geometry: neighbours, shared parts, indices of one brick's samples in
// another's tile. x, y, z order for everything but level triples.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/certify/closing/tile_store.hpp"
#include "host/volume/quantise.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// Levels of bricks, whether they take part (a brick wholly outside the covered region, or the region of
/// interest, does not), and their own samples.
struct OpenBricks {
  Grid grid;
  int granularity = 4;
  int rate = 8;
  LevelTriple coarsening{};            ///< as in MixedVolume
  std::vector<float> base;             ///< as in MixedVolume, on the lattice
  std::vector<LevelTriple> level;      ///< [bz][by][bx]; 0 where a brick takes no part
  std::vector<std::uint8_t> involved;  ///< [bz][by][bx]
  TileStore samples;                   ///< per brick: its tile at its level; empty at level 0
  IntegerLattice lattice;
  bool sampled = true;  ///< the samples are gold itself, whatever the level
  /// What |V - F| may be in each brick; empty: the same in all.
  std::vector<float> tolerance;

  /// Bricks per axis.
  [[nodiscard]] Index3 counts() const;
  /// The same shape without samples: for sizes.
  [[nodiscard]] MixedVolume shape() const { return {grid, granularity, rate, coarsening, {}, {}, {}, {}, 0}; }
  /// The level of gold, z, y, x.
  [[nodiscard]] LevelTriple finest() const { return finest_level(rate, coarsening); }
  [[nodiscard]] Index3 position(std::int64_t brick) const;
};

/// At most `most` of something, without an allocation: closing asks for millions of such lists.
template <class T, std::size_t most>
class Few {
 public:
  void push_back(const T& item) { items_[size_++] = item; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const T& front() const { return items_[0]; }
  [[nodiscard]] const T& operator[](std::size_t i) const { return items_[i]; }
  [[nodiscard]] const T* begin() const { return items_.data(); }
  [[nodiscard]] const T* end() const { return items_.data() + size_; }
  [[nodiscard]] T* begin() { return items_.data(); }
  [[nodiscard]] T* end() { return items_.data() + size_; }
  /// Keeps an ascending list so, each item once.
  void insert_ascending(const T& item) {
    T* place = std::lower_bound(begin(), end(), item);
    if (place != end() && *place == item) return;
    std::move_backward(place, end(), end() + 1);
    *place = item;
    ++size_;
  }

 private:
  std::array<T, most> items_{};
  std::size_t size_ = 0;
};
using FewBricks = Few<std::int64_t, 8>;

/// A brick among its neighbours.
struct Surroundings {
  Surroundings(const OpenBricks& bricks, std::int64_t brick);
  std::int64_t brick;
  Index3 position;
  std::array<std::int64_t, 27> around{};  ///< 9 z + 3 y + x, the brick itself in the middle; -1: none there
};

/// Bricks of the grid that share a part of a closed brick, ascending: side per axis x, y, z is 0 (low
/// border), 1 (inside) or 2 (high border). Only those that take part, the brick itself included; with `all`,
/// the others too.
FewBricks incident_bricks(const OpenBricks& bricks, const Surroundings& of, const std::array<int, 3>& side,
                          bool all = false);
FewBricks incident_bricks(const OpenBricks& bricks, std::int64_t brick, const std::array<int, 3>& side,
                          bool all = false);

/// What the bricks that share a part store there.
struct SharedPart {
  std::array<int, 3> level{};  ///< x, y, z: the lowest of theirs, of meaning along the part
  std::int64_t owner = 0;      ///< whose samples all of them take at that level
};
/// `level`: of all bricks, as stored; `incident`: of the part `side`, as incident_bricks() has them.
SharedPart shared_part(const OpenBricks& bricks, const std::vector<LevelTriple>& level,
                       const FewBricks& incident, const std::array<int, 3>& side);

/// One brick's samples at some level, under their own index.
struct TileView {
  Index3 position;           // of the brick
  std::array<int, 3> level;  // x, y, z
  Index3 end{};              // last index inside the grid
  Index3 last{};             // last index of the tile: beyond `end` planes repeat
  std::int64_t stride_y = 0, stride_z = 0;

  TileView(const OpenBricks& bricks, const Index3& position, const LevelTriple& level_zyx);
  TileView(const OpenBricks& bricks, std::int64_t brick, const LevelTriple& level_zyx)
      : TileView(bricks, bricks.position(brick), level_zyx) {}
  [[nodiscard]] std::size_t index(const Index3& i) const {
    return static_cast<std::size_t>(i[2] * stride_z + i[1] * stride_y + i[0]);
  }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>((last[2] + 1) * stride_z); }
};

/// The base sample at index i of a brick's tile; i lies on the base lattice.
float base_sample(const OpenBricks& bricks, const TileView& tile, const Index3& i);
/// Beyond the grid the last plane repeats.
void repeat_last_planes(const TileView& view, std::vector<float>& tile);

/// What the bricks will store.
struct StoredAs {
  const OpenBricks& open;
  std::vector<LevelTriple> level;
  std::vector<double>
      unit;  ///< what samples of a brick's tile (of the base, at level 0) round to; 0: float32
  std::pair<float, float> base_limits;  ///< what the base can hold
};

/// A face, an edge or a corner of a brick, without its own border.
class Entity {
 public:
  Entity(const StoredAs& stored, const Surroundings& of, const std::array<int, 3>& side);

  /// The bricks that share it and take part, ascending.
  [[nodiscard]] const FewBricks& incident() const { return incident_; }
  /// Whether bricks that take no part share it as well.
  [[nodiscard]] bool has_outsiders() const { return all_.size() > incident_.size(); }
  /// Axes along it, ascending.
  [[nodiscard]] const Few<std::size_t, 3>& along() const { return along_; }
  /// Calls visit(index) for the samples of `tile` on it whose index along it is a multiple of `step`.
  template <class Visit>
  void for_each(const TileView& tile, const Index3& step, Visit&& visit) const {
    Index3 from{}, to{}, by{1, 1, 1};
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = to[a] = side_[a] == 0 ? 0 : tile.end[a];
      if (side_[a] != 1) continue;
      by[a] = from[a] = step[a];
      to[a] = tile.end[a] - 1;
    }
    Index3 i{};
    for (i[2] = from[2]; i[2] <= to[2]; i[2] += by[2])
      for (i[1] = from[1]; i[1] <= to[1]; i[1] += by[1])
        for (i[0] = from[0]; i[0] <= to[0]; i[0] += by[0]) visit(i);
  }
  /// The coarsest step that a brick which stores this sample of `tile` rounds to.
  [[nodiscard]] double unit(const TileView& tile, const Index3& i) const;
  /// The index of that sample in another incident brick's tile.
  [[nodiscard]] Index3 index_in(const TileView& other, const TileView& tile, const Index3& i) const;

 private:
  const StoredAs& stored_;
  std::array<int, 3> side_;
  Few<std::size_t, 3> along_;
  FewBricks incident_, all_;
  bool one_unit_ = true;  // whether all of them round alike
};

/// Calls visit(side) for the 8 corners, then the 12 edges, then the 6 faces.
template <class Visit>
void for_each_part(Visit&& visit) {
  for (int inside = 0; inside < 3; ++inside)
    for (int part = 0; part < 27; ++part) {
      const std::array<int, 3> side{part % 3, part / 3 % 3, part / 9};
      if ((side[0] == 1) + (side[1] == 1) + (side[2] == 1) == inside) visit(side);
    }
}

}  // namespace vdvr
