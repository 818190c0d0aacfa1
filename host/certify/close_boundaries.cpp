// Closes the bricks and packs them: finds the type and the step of every tile with which the closed samples
// fit, then stores them. Called by build.cpp. Calls close_coarse.cpp and close_paper.cpp.
#include "host/certify/close_boundaries.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

#include "host/system/casts.hpp"
#include "host/system/parallel.hpp"
#include "host/volume/brick_layout.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr LevelTriple in_base{0, 0, 0};

class Packer {
 public:
  Packer(const OpenBricks& b, Closing closing)
      : open_(b),
        closing_(closing),
        stored_{
            b, closing == Closing::paper ? levels_by_paper(b) : b.level, {}, base_limits(b.base, b.lattice)},
        type_(b.level.size(), b.lattice.least),
        shift_(b.level.size(), 0) {
    if (b.lattice.step > 0) find_steps();
    update_units();
  }

  MixedVolume volume() const {
    MixedVolume v;
    v.grid = open_.grid;
    v.granularity = open_.granularity;
    v.rate = open_.rate;
    v.coarsening = open_.coarsening;
    v.level = stored_.level;
    v.step = open_.lattice.step;
    v.tile.assign(v.level.size(), 0);
    number_tiles(v);
    for_each_tile([&](std::int64_t i, const std::vector<float>& tile) {
      const StoredTile stored = stored_tile(v, at(i));
      pack(tile, open_.lattice, shift_[at(i)], stored.number, v.tiles.at(stored.kind));
    });
    v.base = pack_base(closing_ == Closing::none ? open_.base : shared_base(), open_.lattice);
    return v;
  }

 private:
  // The narrowest type of a triple comes first.
  void number_tiles(MixedVolume& v) const {
    std::map<LevelTriple, std::array<std::uint32_t, 3>> counts;
    for (std::size_t i = 0; i < v.level.size(); ++i)
      if (v.level[i] != in_base) ++counts[v.level[i]][2 - static_cast<std::size_t>(type_[i])];
    for (auto& [triple, of_type] : counts) {
      TileKind kind(triple);
      std::uint32_t next = 0;
      for (std::size_t t = 0; t < 3; ++t) {
        const std::uint32_t n = std::exchange(of_type[t], next);
        next += n;
        if (n == 0) continue;
        v.tiles[kind] =
            empty_block(static_cast<SampleType>(2 - t), n, static_cast<std::uint64_t>(v.tile_size(triple)));
        ++kind.part;
      }
    }
    for (std::size_t i = 0; i < v.level.size(); ++i)
      if (v.level[i] != in_base) v.tile[i] = counts[v.level[i]][2 - static_cast<std::size_t>(type_[i])]++;
  }

  std::vector<float> tile_of(std::int64_t brick) const {
    if (closing_ == Closing::coarse) return tile_by_coarse(stored_, brick);
    if (closing_ == Closing::paper) return tile_by_paper(stored_, brick);
    return open_.samples[at(brick)];
  }

  void for_each_tile(const std::function<void(std::int64_t, const std::vector<float>&)>& visit) const {
    parallel_for(static_cast<std::int64_t>(stored_.level.size()), {}, "close", [&](std::int64_t i) {
      if (stored_.level[at(i)] != in_base) visit(i, tile_of(i));
    });
  }

  void update_units() {
    const Lattice& l = open_.lattice;
    stored_.unit.assign(stored_.level.size(), 0);
    if (l.step == 0) return;
    for (std::size_t i = 0; i < stored_.unit.size(); ++i) {
      const bool base = stored_.level[i] == in_base;
      if (base) stored_.unit[i] = l.base_step();
      else if (type_[i] != SampleType::f32) stored_.unit[i] = std::ldexp(l.step, shift_[i]);
    }
  }

  // Rounding shared samples to a coarser step may push a tile out of its range, which coarsens its own. Steps
  // only coarsen, up to the base's, while types stay, and types only widen: it ends.
  void find_steps() {
    for (bool stable = false; !stable;) {
      update_units();
      std::vector<int> needed(shift_.size(), 0);
      for_each_tile([&](std::int64_t i, const std::vector<float>& tile) {
        const SampleType type = type_[at(i)];
        if (type == SampleType::f32) return;
        const auto [lo, hi] = std::minmax_element(tile.begin(), tile.end());
        const auto shift = fitting_shift(*lo, *hi, open_.lattice, type, open_.lattice.base_shift);
        needed[at(i)] = shift ? std::max(shift_[at(i)], *shift) : -1;
      });
      stable = needed == shift_;
      shift_ = needed;
      widen_types();
    }
  }

  // Tiles that fit no step take the next wider type, and begin again.
  void widen_types() {
    for (std::size_t i = 0; i < shift_.size(); ++i) {
      if (shift_[i] >= 0) continue;
      type_[i] = type_[i] == SampleType::u8 ? SampleType::u16 : SampleType::f32;
      shift_[i] = 0;
    }
  }

  // The base with the values of tiles where only bricks that take no part would read its own.
  std::vector<float> shared_base() const {
    std::vector<float> base = open_.base;
    const MixedVolume shape = open_.shape();
    const Index3 n = shape.base_samples();
    for (std::size_t brick = 0; brick < stored_.level.size(); ++brick) {
      if (stored_.level[brick] == in_base || !borders_outsiders(brick)) continue;
      const auto id = static_cast<std::int64_t>(brick);
      const TileView view(open_, id, stored_.level[brick]);
      const std::vector<float> tile = tile_of(id);
      const Index3 first = first_base_sample(shape, view.position);
      Index3 step{};
      for (std::size_t a = 0; a < 3; ++a) step[a] = std::int64_t{1} << view.level[a];
      for_each_part([&](const std::array<int, 3>& side) {
        bool outsiders = false, base_read = false;
        for (const std::int64_t i : incident_bricks(open_, id, side, true)) {
          if (!open_.involved[at(i)]) outsiders = true;
          else if (stored_.level[at(i)] == in_base) base_read = true;
        }
        if (!outsiders || base_read) return;
        Entity(stored_, id, side).for_each(view, step, [&](const Index3& i) {
          Index3 c{};
          for (std::size_t a = 0; a < 3; ++a) c[a] = first[a] + i[a] / step[a];
          base[at((c[2] * n[1] + c[1]) * n[0] + c[0])] = tile[view.index(i)];
        });
      });
    }
    return base;
  }

  bool borders_outsiders(std::size_t brick) const {
    const auto id = static_cast<std::int64_t>(brick);
    for (int part = 0; part < 27; ++part)
      for (const std::int64_t i : incident_bricks(open_, id, {part % 3, part / 3 % 3, part / 9}, true))
        if (!open_.involved[at(i)]) return true;
    return false;
  }

  const OpenBricks& open_;
  Closing closing_;
  StoredAs stored_;
  std::vector<SampleType> type_;  // by brick; of those that have tiles
  std::vector<int> shift_;
};

}  // namespace

MixedVolume close_boundaries(const OpenBricks& b, Closing closing) {
  if (closing == Closing::paper) {
    if (!b.sampled) throw InputError("`closing` paper is defined for `coefficients` sampled only");
    for (const LevelTriple& l : b.level)
      if (l[0] != l[1] || l[1] != l[2])
        throw InputError("`closing` paper is defined for `levels` isotropic only");
  }
  return Packer(b, closing).volume();
}

std::vector<std::uint8_t> changed_bricks(const MixedVolume& before, const MixedVolume& after) {
  std::vector<std::uint8_t> changed(after.level.size(), 0);
  const Bricks bricks(after.grid, after.granularity);
  parallel_for(static_cast<std::int64_t>(changed.size()), {}, "compare", [&](std::int64_t i) {
    if (before.level[at(i)] != after.level[at(i)]) {
      changed[at(i)] = 1;
      return;
    }
    const Index3 p = bricks.position(i);
    const BrickSamples a(before, p), b(after, p);
    const Index3& end = a.end();
    for (std::int64_t z = 0; z <= end[2]; ++z)
      for (std::int64_t y = 0; y <= end[1]; ++y)
        for (std::int64_t x = 0; x <= end[0]; ++x)
          if (std::bit_cast<std::uint32_t>(a(x, y, z)) != std::bit_cast<std::uint32_t>(b(x, y, z)))
            changed[at(i)] = 1;
  });
  return changed;
}

}  // namespace vdvr
