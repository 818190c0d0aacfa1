// Closing on the host. Called by build.cpp. Interpolates with the sampler's own lerp, so that the stored
// samples of a fine brick lie on what its coarse neighbour interpolates.
#include "host/close_boundaries.hpp"

#include <algorithm>

#include "host/brick_layout.hpp"
#include "host/parallel.hpp"

namespace vdvr {
namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

Index3 brick_counts(const OpenBricks& b) {
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (b.grid.cells[a] + b.granularity - 1) / b.granularity;
  return n;
}

Index3 brick_position(const OpenBricks& b, std::int64_t brick) {
  const Index3 n = brick_counts(b);
  return {brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
}

// One brick's samples under its own index: x, y, z order for everything here.
struct TileView {
  Index3 position;  // of the brick
  std::array<int, 3> level;
  Index3 end;  // last index inside the grid
  std::int64_t stride_y, stride_z;

  TileView(const OpenBricks& b, std::int64_t brick) : position(brick_position(b, brick)) {
    const LevelTriple& l = b.level[at(brick)];
    level = {l[2], l[1], l[0]};
    std::array<std::int64_t, 3> side{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t width =
          std::min<std::int64_t>(b.granularity, b.grid.cells[a] - position[a] * b.granularity);
      end[a] = width << level[a];
      side[a] = (static_cast<std::int64_t>(b.granularity) << level[a]) + 1;
    }
    stride_y = side[0];
    stride_z = side[0] * side[1];
  }
  [[nodiscard]] std::size_t index(const Index3& i) const {
    return at(i[2] * stride_z + i[1] * stride_y + i[0]);
  }
};

// What a brick stores before closing: its tile, or at level 0 its part of the base.
class BrickSamples {
 public:
  BrickSamples(const OpenBricks& b, std::int64_t brick)
      : bricks_(&b), view_(b, brick), tile_(&b.gold[at(brick)]) {}
  [[nodiscard]] const TileView& view() const { return view_; }
  [[nodiscard]] float operator()(const Index3& i) const {
    if (!tile_->empty()) return (*tile_)[view_.index(i)];
    const Index3 n = bricks_->grid.samples();
    const std::int64_t g = bricks_->granularity;
    return bricks_->base[at(((view_.position[2] * g + i[2]) * n[1] + view_.position[1] * g + i[1]) * n[0] +
                            view_.position[0] * g + i[0])];
  }

 private:
  const OpenBricks* bricks_;
  TileView view_;
  const std::vector<float>* tile_;
};

// The closing of one corner, edge or face of a brick.
class Entity {
 public:
  Entity(const OpenBricks& b, std::int64_t brick, const std::array<int, 3>& side)
      : own_(b, brick), owner_(b, brick) {
    // The coarsest incident brick is the source, the first of them where there are several.
    std::int64_t owner = brick;
    lowest_ = own_.level;
    for (const std::int64_t i : incident_bricks(b, brick, side)) {
      const LevelTriple &l = b.level[at(i)], &o = b.level[at(owner)];
      if (l < o || (l == o && i < owner)) owner = i;
      for (std::size_t a = 0; a < 3; ++a) lowest_[a] = std::min(lowest_[a], static_cast<int>(l[2 - a]));
    }
    owner_ = BrickSamples(b, owner);
    for (std::size_t a = 0; a < 3; ++a) {
      fixed_[a] = side[a] == 0 ? 0 : own_.end[a];
      if (side[a] == 1) along_.push_back(a);
    }
    unchanged_ = owner == brick;
  }

  void close(std::vector<float>& tile) const {
    if (unchanged_) return;
    std::vector<std::int64_t> step;
    for (const std::size_t a : along_) step.push_back(std::int64_t{1} << (own_.level[a] - lowest_[a]));
    if (along_.empty()) take_from_owner(tile, fixed_);
    else if (along_.size() == 1) close_edge(tile, along_[0], step[0]);
    else close_face(tile, along_[0], along_[1], step[0], step[1]);
  }

 private:
  // The sample that every incident brick takes at a lattice point of the coarsest one.
  void take_from_owner(std::vector<float>& tile, const Index3& i) const {
    const TileView& owner = owner_.view();
    Index3 o{};
    for (std::size_t a = 0; a < 3; ++a) {
      const bool runs_along = std::find(along_.begin(), along_.end(), a) != along_.end();
      if (runs_along) {
        const int shift = owner.level[a] - own_.level[a];
        o[a] = shift >= 0 ? i[a] << shift : i[a] >> -shift;
      } else {
        const bool far_side = i[a] != 0;  // of this brick; the owner may lie on either side of the border
        const std::int64_t plane = own_.position[a] + (far_side ? 1 : 0);
        o[a] = owner.position[a] == plane ? 0 : owner.end[a];
      }
    }
    tile[own_.index(i)] = owner_(o);
  }

  void close_edge(std::vector<float>& tile, std::size_t a, std::int64_t step) const {
    Index3 i = fixed_;
    for (i[a] = step; i[a] < own_.end[a]; i[a] += step) take_from_owner(tile, i);
    for (std::int64_t j = 1; j < own_.end[a]; ++j) {
      const std::int64_t below = j / step * step;
      if (below == j) continue;
      Index3 low = fixed_, high = fixed_;
      low[a] = below;
      high[a] = below + step;
      i[a] = j;
      tile[own_.index(i)] =
          vdvr_lerp(tile[own_.index(low)], tile[own_.index(high)], fraction(j - below, step));
    }
  }

  void close_face(std::vector<float>& tile, std::size_t p, std::size_t q, std::int64_t step_p,
                  std::int64_t step_q) const {
    Index3 i = fixed_;
    for (i[q] = step_q; i[q] < own_.end[q]; i[q] += step_q)
      for (i[p] = step_p; i[p] < own_.end[p]; i[p] += step_p) take_from_owner(tile, i);
    const auto value = [&](std::int64_t jp, std::int64_t jq) {
      Index3 j = fixed_;
      j[p] = jp;
      j[q] = jq;
      return tile[own_.index(j)];
    };
    for (std::int64_t jq = 1; jq < own_.end[q]; ++jq)
      for (std::int64_t jp = 1; jp < own_.end[p]; ++jp) {
        const std::int64_t lp = jp / step_p * step_p, lq = jq / step_q * step_q;
        if (lp == jp && lq == jq) continue;
        const std::int64_t hp = lp == jp ? lp : lp + step_p, hq = lq == jq ? lq : lq + step_q;
        const float tp = fraction(jp - lp, step_p), tq = fraction(jq - lq, step_q);
        const float low = vdvr_lerp(value(lp, lq), value(hp, lq), tp),
                    high = vdvr_lerp(value(lp, hq), value(hp, hq), tp);
        i[p] = jp;
        i[q] = jq;
        tile[own_.index(i)] = vdvr_lerp(low, high, tq);
      }
  }

  static float fraction(std::int64_t part, std::int64_t whole) {
    return static_cast<float>(part) / static_cast<float>(whole);
  }

  TileView own_;
  BrickSamples owner_;
  std::array<int, 3> lowest_{};
  Index3 fixed_{};
  std::vector<std::size_t> along_;  // ascending axes
  bool unchanged_ = false;
};

// Beyond the grid the last plane repeats.
void repeat_last_planes(const TileView& t, int granularity, std::vector<float>& tile) {
  Index3 last{};
  bool whole = true;
  for (std::size_t a = 0; a < 3; ++a) {
    last[a] = static_cast<std::int64_t>(granularity) << t.level[a];
    whole = whole && last[a] == t.end[a];
  }
  if (whole) return;
  for (std::int64_t z = 0; z <= last[2]; ++z)
    for (std::int64_t y = 0; y <= last[1]; ++y)
      for (std::int64_t x = 0; x <= last[0]; ++x)
        tile[t.index({x, y, z})] =
            tile[t.index({std::min(x, t.end[0]), std::min(y, t.end[1]), std::min(z, t.end[2])})];
}

std::vector<float> closed_tile(const OpenBricks& b, std::int64_t brick) {
  const TileView t(b, brick);
  std::vector<float> tile = b.gold[at(brick)];
  for (const std::size_t inside :
       {std::size_t{0}, std::size_t{1}, std::size_t{2}})  // corners, edges along one axis, faces along two
    for (int part = 0; part < 27; ++part) {
      const std::array<int, 3> side{part % 3, part / 3 % 3, part / 9};
      if (static_cast<std::size_t>(std::count(side.begin(), side.end(), 1)) == inside)
        Entity(b, brick, side).close(tile);
    }
  repeat_last_planes(t, b.granularity, tile);
  return tile;
}

}  // namespace

std::vector<std::int64_t> incident_bricks(const OpenBricks& b, std::int64_t brick,
                                          const std::array<int, 3>& side) {
  const Index3 n = brick_counts(b), p = brick_position(b, brick);
  std::array<std::vector<std::int64_t>, 3> range;
  for (std::size_t a = 0; a < 3; ++a) {
    range[a].push_back(p[a]);
    if (side[a] == 0 && p[a] > 0) range[a].push_back(p[a] - 1);
    if (side[a] == 2 && p[a] + 1 < n[a]) range[a].push_back(p[a] + 1);
  }
  std::vector<std::int64_t> out;
  for (const std::int64_t z : range[2])
    for (const std::int64_t y : range[1])
      for (const std::int64_t x : range[0]) {
        const std::int64_t i = (z * n[1] + y) * n[0] + x;
        if (i == brick || b.involved[at(i)]) out.push_back(i);
      }
  return out;
}

MixedVolume close_boundaries(const OpenBricks& b) {
  MixedVolume v;
  v.grid = b.grid;
  v.granularity = b.granularity;
  v.rate = b.rate;
  v.base = b.base;
  v.level = b.level;
  v.tile.assign(b.level.size(), 0);
  std::map<LevelTriple, std::uint32_t> counts;
  for (std::size_t i = 0; i < b.level.size(); ++i)
    if (b.level[i] != LevelTriple{0, 0, 0}) v.tile[i] = counts[b.level[i]]++;
  for (const auto& [triple, n] : counts)
    v.tiles[triple].resize(static_cast<std::size_t>(n) * at(v.tile_size(triple)));
  parallel_for(static_cast<std::int64_t>(b.level.size()), {}, "close", [&](std::int64_t i) {
    const LevelTriple& l = b.level[at(i)];
    if (l == LevelTriple{0, 0, 0}) return;
    const auto tile = closed_tile(b, i);
    std::copy(tile.begin(), tile.end(),
              v.tiles.at(l).begin() + static_cast<std::ptrdiff_t>(std::size_t{v.tile[at(i)]} * tile.size()));
  });
  return v;
}

}  // namespace vdvr
