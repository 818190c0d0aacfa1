// Closing `coarse`: the fine side follows the coarse one. Interpolates with the sampler's own lerp, so that
// the stored samples of a fine brick lie on what its coarse neighbour interpolates.
#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/certify/closing/close_boundaries.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {
namespace {

float fraction(std::int64_t part, std::int64_t whole) {
  return static_cast<float>(part) / static_cast<float>(whole);
}

class Closer {
 public:
  Closer(const StoredAs& stored, const Surroundings& of, const TileView& own, const std::array<int, 3>& side,
         std::vector<float>& tile)
      : stored_(stored), entity_(stored, of, side), own_(own), tile_(tile) {
    const SharedPart shared = shared_part(stored.open, stored.level, entity_.incident(), side);
    lowest_ = shared.level;
    owner_ = shared.owner;
    bool unchanged = owner_ == of.brick && stored.open.lattice.step == 0;
    for (const std::size_t a : entity_.along()) unchanged = unchanged && lowest_[a] == own_.level[a];
    if (unchanged) return;
    take_from_owner();
    if (entity_.along().size() == 1) fill_edge(entity_.along()[0]);
    if (entity_.along().size() == 2) fill_face(entity_.along()[0], entity_.along()[1]);
  }

 private:
  bool is_on_base(const Index3& i) const {
    bool on_base = true;
    for (const std::size_t a : entity_.along())
      on_base = on_base && i[a] % (std::int64_t{1} << own_.level[a]) == 0;
    return on_base;
  }
  float rounded(float value, const Index3& i) const { return round_to(value, entity_.unit(own_, i)); }
  float value(const Index3& i) const { return tile_[own_.index(i)]; }

  // At the entity's level all incident bricks take the samples of its owner: at level 0 these are
  // base samples, and any others may differ from them.
  void take_from_owner() {
    const LevelTriple& level = stored_.level[at(owner_)];
    const TileView owner(stored_.open, owner_, level);
    Index3 step{};
    for (std::size_t a = 0; a < 3; ++a) step[a] = std::int64_t{1} << (own_.level[a] - lowest_[a]);
    const bool in_base = level == LevelTriple{0, 0, 0};
    entity_.for_each(own_, step, [&](const Index3& i) {
      const Index3 o = entity_.index_in(owner, own_, i);
      float v =
          in_base ? base_sample(stored_.open, owner, o) : stored_.open.samples[at(owner_)][owner.index(o)];
      // The base will hold this value for the bricks that take no part.
      if (entity_.has_outsiders() && is_on_base(i))
        v = std::clamp(v, stored_.base_limits.first, stored_.base_limits.second);
      tile_[own_.index(i)] = rounded(v, i);
    });
  }

  // Level by level among those that meet here, each from the one below as it is stored: the field of every
  // incident brick along the edge then runs through the stored samples of the next finer.
  void fill_edge(std::size_t a) {
    Few<int, 8> levels;
    for (const std::int64_t i : entity_.incident())
      if (stored_.level[at(i)][2 - a] <= own_.level[a]) levels.insert_ascending(stored_.level[at(i)][2 - a]);
    for (std::size_t n = 1; n < levels.size(); ++n) {
      const std::int64_t coarse = std::int64_t{1} << (own_.level[a] - levels[n - 1]);
      Index3 step{1, 1, 1};
      step[a] = std::int64_t{1} << (own_.level[a] - levels[n]);
      entity_.for_each(own_, step, [&](const Index3& i) {
        const std::int64_t below = i[a] / coarse * coarse;
        if (below == i[a]) return;
        Index3 low = i, high = i;
        low[a] = below;
        high[a] = below + coarse;
        tile_[own_.index(i)] = rounded(vdvr_lerp(value(low), value(high), fraction(i[a] - below, coarse)), i);
      });
    }
  }

  void fill_face(std::size_t p, std::size_t q) {
    const std::int64_t step_p = std::int64_t{1} << (own_.level[p] - lowest_[p]),
                       step_q = std::int64_t{1} << (own_.level[q] - lowest_[q]);
    if (step_p == 1 && step_q == 1) return;
    entity_.for_each(own_, {1, 1, 1}, [&](const Index3& i) {
      const std::int64_t lp = i[p] / step_p * step_p, lq = i[q] / step_q * step_q;
      if (lp == i[p] && lq == i[q]) return;
      const std::int64_t hp = lp == i[p] ? lp : lp + step_p, hq = lq == i[q] ? lq : lq + step_q;
      const auto corner = [&](std::int64_t jp, std::int64_t jq) {
        Index3 j = i;
        j[p] = jp;
        j[q] = jq;
        return value(j);
      };
      const float tp = fraction(i[p] - lp, step_p), tq = fraction(i[q] - lq, step_q);
      const float low = vdvr_lerp(corner(lp, lq), corner(hp, lq), tp),
                  high = vdvr_lerp(corner(lp, hq), corner(hp, hq), tp);
      tile_[own_.index(i)] = rounded(vdvr_lerp(low, high, tq), i);
    });
  }

  const StoredAs& stored_;
  Entity entity_;
  const TileView& own_;
  std::vector<float>& tile_;
  std::int64_t owner_ = 0;
  std::array<int, 3> lowest_{};  // level of the entity
};

}  // namespace

std::vector<float> tile_by_coarse(const StoredAs& stored, std::int64_t brick) {
  std::vector<float> tile = stored.open.samples.copy(at(brick));
  const Surroundings around(stored.open, brick);
  const TileView own(stored.open, around.position, stored.level[at(brick)]);
  for_each_part([&](const std::array<int, 3>& side) { Closer(stored, around, own, side, tile); });
  repeat_last_planes(own, tile);
  return tile;
}

}  // namespace vdvr
