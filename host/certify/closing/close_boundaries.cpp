// Closes the bricks and packs them: finds the type and the step of every tile with which the closed samples
// fit, then stores them. Calls close_coarse.cpp and close_paper.cpp.
#include "host/certify/closing/close_boundaries.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/base/system/scratch_pass.hpp"
#include "host/volume/brick_layout.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Bricks that a thread takes at once: a tile takes microseconds.
constexpr std::int64_t batch = 64;

template <class Body>
void for_each_brick(std::size_t count, Body&& body) {
  const auto n = static_cast<std::int64_t>(count);
  parallel_for((n + batch - 1) / batch, {}, "close", [&](std::int64_t part) {
    for (std::int64_t i = part * batch; i < std::min(n, (part + 1) * batch); ++i) body(i);
  });
}

bool borders_outsiders(const OpenBricks& open, std::int64_t brick) {
  const Surroundings of(open, brick);
  return std::any_of(of.around.begin(), of.around.end(),
                     [&](std::int64_t i) { return i >= 0 && !open.involved[at(i)]; });
}

// A tile as it is stored elsewhere: its samples are of one type and size in both.
void copy_tile(const StoredTile& from, std::size_t size, SampleBlock& to, std::size_t number) {
  const auto copy = [&](const auto& source, auto& target) {
    const auto begin = source.begin() + static_cast<std::ptrdiff_t>(from.number * size);
    std::copy(begin, begin + static_cast<std::ptrdiff_t>(size),
              target.begin() + static_cast<std::ptrdiff_t>(number * size));
  };
  if (to.type == SampleType::f32) return copy(from.block->f32, to.f32);
  to.offset[number] = from.block->offset[from.number];
  to.shift[number] = from.block->shift[from.number];
  if (to.type == SampleType::u16) copy(from.block->u16, to.u16);
  else copy(from.block->u8, to.u8);
}

}  // namespace

CloseBoundaries::CloseBoundaries(const OpenBricks& b, Closing closing, MemoryBudget budget)
    : open_(b),
      closing_(closing),
      budget_(std::move(budget)),
      stored_{b, b.level, {}, base_limits(b.base, b.lattice)},
      rim_(b.level.size(), 0) {
  if (closing == Closing::none) return;
  if (closing == Closing::paper) {
    if (!b.sampled) throw InputError("`closing` paper is defined for `coefficients` sampled only");
    for (const LevelTriple& l : b.level)
      if (l[0] != l[1] || l[1] != l[2])
        throw InputError("`closing` paper is defined for `levels` isotropic only");
  }
  for_each_brick(rim_.size(), [&](std::int64_t i) { rim_[at(i)] = borders_outsiders(b, i); });
}

MixedVolume CloseBoundaries::first() {
  passes_.clear();
  moved_.assign(open_.level.size(), 1);
  return volume(nullptr);
}

MixedVolume CloseBoundaries::again(const MixedVolume& before, const std::vector<std::uint8_t>& moved) {
  moved_ = moved;
  return volume(&before);
}

MixedVolume CloseBoundaries::volume(const MixedVolume* before) {
  stored_.level = closing_ == Closing::paper ? levels_by_paper(open_) : open_.level;
  if (before)
    for (std::size_t i = 0; i < moved_.size(); ++i) moved_[i] |= before->level[i] != stored_.level[i];
  type_.assign(stored_.level.size(), open_.lattice.least);
  shift_.assign(stored_.level.size(), 0);
  const Pass last = passes_.empty() ? Pass{type_, shift_, {}} : passes_.back();
  if (open_.lattice.step > 0) find_steps();
  update_units();
  made_ = with_neighbours(unlike(last, true));

  MixedVolume v;
  v.grid = open_.grid;
  v.granularity = open_.granularity;
  v.rate = open_.rate;
  v.coarsening = open_.coarsening;
  v.level = stored_.level;
  v.step = open_.lattice.step;
  v.tile.assign(v.level.size(), 0);
  number_tiles(v);
  ScratchPass pass;
  open_.samples.add_to(pass);
  pass.add_all(v);
  if (before) pass.add_all(*before);
  for_each_tile([&](std::int64_t i) {
    pass.touched(3 * sizeof(float) * count(v.tile_size(v.level[at(i)])));
    const StoredTile to = stored_tile(v, at(i));
    SampleBlock& block = v.tiles.at(to.kind);
    if (made_[at(i)]) pack(tile_of(i), open_.lattice, shift_[at(i)], to.number, block);
    else copy_tile(stored_tile(*before, at(i)), at(v.tile_size(v.level[at(i)])), block, to.number);
  });
  for (std::size_t i = 0; i < made_.size(); ++i) made_[i] = made_[i] && v.level[i] != level_of_base;
  v.base = pack_base(closing_ == Closing::none ? open_.base : shared_base(), open_.lattice);
  return v;
}

// The narrowest type of a triple comes first.
void CloseBoundaries::number_tiles(MixedVolume& v) const {
  std::map<LevelTriple, std::array<std::uint32_t, 3>> counts;
  std::uint64_t bytes = 0;
  constexpr std::array<std::uint64_t, 3> bytes_of{sizeof(float), sizeof(std::uint16_t), sizeof(std::uint8_t)};
  for (std::size_t i = 0; i < v.level.size(); ++i)
    if (v.level[i] != level_of_base) {
      ++counts[v.level[i]][2 - static_cast<std::size_t>(type_[i])];
      bytes +=
          bytes_of[static_cast<std::size_t>(type_[i])] * static_cast<std::uint64_t>(v.tile_size(v.level[i]));
    }
  const std::shared_ptr<Scratch> scratch = budget_.for_bytes(bytes);
  for (auto& [triple, of_type] : counts) {
    TileKind kind(triple);
    std::uint32_t next = 0;
    for (std::size_t t = 0; t < 3; ++t) {
      const std::uint32_t n = std::exchange(of_type[t], next);
      next += n;
      if (n == 0) continue;
      v.tiles[kind] = empty_block(static_cast<SampleType>(2 - t), n,
                                  static_cast<std::uint64_t>(v.tile_size(triple)), scratch);
      ++kind.part;
    }
  }
  for (std::size_t i = 0; i < v.level.size(); ++i)
    if (v.level[i] != level_of_base) v.tile[i] = counts[v.level[i]][2 - static_cast<std::size_t>(type_[i])]++;
}

std::vector<float> CloseBoundaries::tile_of(std::int64_t brick) const {
  if (closing_ == Closing::coarse) return tile_by_coarse(stored_, brick);
  if (closing_ == Closing::paper) return tile_by_paper(stored_, brick);
  return open_.samples.copy(at(brick));
}

void CloseBoundaries::for_each_tile(const std::function<void(std::int64_t)>& visit) const {
  for_each_brick(stored_.level.size(), [&](std::int64_t i) {
    if (stored_.level[at(i)] != level_of_base) visit(i);
  });
}

void CloseBoundaries::update_units() {
  const IntegerLattice& l = open_.lattice;
  stored_.unit.assign(stored_.level.size(), 0);
  if (l.step == 0) return;
  for (std::size_t i = 0; i < stored_.unit.size(); ++i) {
    const bool base = stored_.level[i] == level_of_base;
    if (base) stored_.unit[i] = l.base_step();
    else if (type_[i] != SampleType::f32) stored_.unit[i] = std::ldexp(l.step, shift_[i]);
  }
}

// Bricks that are not stored as in that pass or, where it is one of the call before, have moved since.
std::vector<std::uint8_t> CloseBoundaries::unlike(const Pass& pass, bool call_before) const {
  std::vector<std::uint8_t> out(type_.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = pass.type[i] != type_[i] || pass.shift[i] != shift_[i] || (call_before && moved_[i]);
  return out;
}

// Whatever a tile is made of lies in its brick and in those around it.
std::vector<std::uint8_t> CloseBoundaries::with_neighbours(const std::vector<std::uint8_t>& bricks) const {
  std::vector<std::uint8_t> out = bricks;
  for (std::size_t i = 0; i < bricks.size(); ++i)
    if (bricks[i])
      for (const std::int64_t near : Surroundings(open_, static_cast<std::int64_t>(i)).around)
        if (near >= 0) out[at(near)] = 1;
  return out;
}

// Of a tile closed with the steps as they are; -1 where none will do.
std::int8_t CloseBoundaries::needed_shift(std::int64_t brick) const {
  const SampleType type = type_[at(brick)];
  if (type == SampleType::f32) return 0;
  const std::vector<float> tile = tile_of(brick);
  const auto [lo, hi] = std::minmax_element(tile.begin(), tile.end());
  const auto shift = fitting_shift(*lo, *hi, open_.lattice, type, open_.lattice.base_shift);
  return shift ? std::max(shift_[at(brick)], static_cast<std::int8_t>(*shift)) : std::int8_t{-1};
}

// Rounding shared samples to a coarser step may push a tile out of its range, which coarsens its own. Steps
// only coarsen, up to the base's, while types stay, and types only widen: it ends. Every call begins anew, so
// that its volume depends on nothing but the bricks; a tile whose surroundings are as they were in the same
// pass of the call before, or in the pass before, asks for what it did.
void CloseBoundaries::find_steps() {
  const std::vector<Pass> before = std::exchange(passes_, {});
  for (bool stable = false; !stable;) {
    update_units();
    Pass pass{type_, shift_, std::vector<std::int8_t>(shift_.size(), 0)};
    ScratchPass touched;
    open_.samples.add_to(touched);
    const Pass* known = passes_.size() < before.size() ? &before[passes_.size()]
                        : passes_.empty()              ? nullptr
                                                       : &passes_.back();
    const std::vector<std::uint8_t> open =
        known ? with_neighbours(unlike(*known, passes_.size() < before.size()))
              : std::vector<std::uint8_t>(shift_.size(), 1);
    const MixedVolume shape = open_.shape();
    for_each_tile([&](std::int64_t i) {
      if (open[at(i)]) touched.touched(sizeof(float) * count(shape.tile_size(stored_.level[at(i)])));
      pass.needed[at(i)] = open[at(i)] ? needed_shift(i) : known->needed[at(i)];
    });
    stable = pass.needed == shift_;
    shift_ = pass.needed;
    passes_.push_back(std::move(pass));
    widen_types();
  }
}

// Tiles that fit no step take the next wider type, and begin again.
void CloseBoundaries::widen_types() {
  for (std::size_t i = 0; i < shift_.size(); ++i) {
    if (shift_[i] >= 0) continue;
    type_[i] = type_[i] == SampleType::u8 ? SampleType::u16 : SampleType::f32;
    shift_[i] = 0;
  }
}

// The base with the values of tiles where only bricks that take no part would read its own.
std::vector<float> CloseBoundaries::shared_base() const {
  std::vector<float> base = open_.base;
  for (std::size_t i = 0; i < rim_.size(); ++i)
    if (rim_[i] && stored_.level[i] != level_of_base) share(static_cast<std::int64_t>(i), base);
  return base;
}

void CloseBoundaries::share(std::int64_t brick, std::vector<float>& base) const {
  const MixedVolume shape = open_.shape();
  const Index3 n = shape.base_samples();
  const Surroundings of(open_, brick);
  const TileView view(open_, of.position, stored_.level[at(brick)]);
  const std::vector<float> tile = tile_of(brick);
  const Index3 first = first_base_sample(shape, view.position);
  Index3 step{};
  for (std::size_t a = 0; a < 3; ++a) step[a] = std::int64_t{1} << view.level[a];
  for_each_part([&](const std::array<int, 3>& side) {
    bool outsiders = false, base_read = false;
    for (const std::int64_t i : incident_bricks(open_, of, side, true)) {
      if (!open_.involved[at(i)]) outsiders = true;
      else if (stored_.level[at(i)] == level_of_base) base_read = true;
    }
    if (!outsiders || base_read) return;
    Entity(stored_, of, side).for_each(view, step, [&](const Index3& i) {
      Index3 c{};
      for (std::size_t a = 0; a < 3; ++a) c[a] = first[a] + i[a] / step[a];
      base[at((c[2] * n[1] + c[1]) * n[0] + c[0])] = tile[view.index(i)];
    });
  });
}

MixedVolume close_boundaries(const OpenBricks& b, Closing closing) {
  return CloseBoundaries(b, closing).first();
}

std::vector<std::uint8_t> changed_bricks(const MixedVolume& before, const MixedVolume& after,
                                         const std::vector<std::uint8_t>& among) {
  std::vector<std::uint8_t> changed(after.level.size(), 0);
  const Bricks bricks(after.grid, after.granularity);
  ScratchPass pass;
  pass.add_all(before);
  pass.add_all(after);
  for_each_brick(changed.size(), [&](std::int64_t i) {
    if (!among.empty() && !among[at(i)]) return;
    pass.touched(2 * sizeof(float) * count(after.tile_size(after.level[at(i)])));
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
