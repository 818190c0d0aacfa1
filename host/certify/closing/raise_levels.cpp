// The rules by which repair raises levels.
#include "host/certify/closing/raise_levels.hpp"

#include <algorithm>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

// Of linear interpolation along one axis.
float error(const AxisErrors& along, std::size_t axis, int level, int top) {
  if (level >= std::min(top, AxisErrors::most_levels)) return 0;
  const auto& e = along.of[axis][at(level)];
  return std::max(e[0], e[1]);
}

void rise(std::uint8_t& level, std::uint8_t to) { level = std::max(level, to); }

class Raise {
 public:
  Raise(const OpenBricks& bricks, std::int64_t brick, const AxisErrors* along, std::vector<LevelTriple>& to)
      : bricks_(bricks),
        brick_(brick),
        own_(bricks.level[at(brick)]),
        top_(bricks.finest()),
        along_(along),
        to_(to) {}

  // Bricks that share this part and are coarser along it: what they store there is what was interpolated
  // from.
  bool coarser_neighbours(const std::array<int, 3>& side) {
    bool any = false;
    for (const std::int64_t j : incident_bricks(bricks_, brick_, side)) {
      if (j == brick_) continue;
      const LevelTriple& other = bricks_.level[at(j)];
      if (!along_) {
        if (other[0] >= own_[0]) continue;
        // A base coarser along one axis gives that axis more levels than the others have.
        for (std::size_t a = 0; a < 3; ++a)
          rise(to_[at(j)][a], std::min<std::uint8_t>(top_[a], static_cast<std::uint8_t>(other[a] + 1)));
        any = true;
        continue;
      }
      for (std::size_t a = 0; a < 3; ++a) {
        if (side[a] != 1 || other[2 - a] >= own_[2 - a]) continue;
        rise(to_[at(j)][2 - a], static_cast<std::uint8_t>(other[2 - a] + 1));
        any = true;
      }
    }
    return any;
  }

  // The others: what they store elsewhere bears on this part only through its owner.
  bool others(const std::array<int, 3>& side) {
    bool any = false;
    for (const std::int64_t j : incident_bricks(bricks_, brick_, side)) {
      if (j == brick_) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        const std::uint8_t level = bricks_.level[at(j)][a];
        if (level >= top_[a]) continue;
        rise(to_[at(j)][a], static_cast<std::uint8_t>(level + 1));
        any = true;
      }
    }
    return any;
  }

  // At a corner all take what the coarsest of them stores: no other's level bears on it.
  bool owners_of_corner(const std::array<int, 3>& side) {
    if (side[0] == 1 || side[1] == 1 || side[2] == 1) return false;
    const auto sum = [&](std::int64_t j) {
      const LevelTriple& l = bricks_.level[at(j)];
      return l[0] + l[1] + l[2];
    };
    const auto incident = incident_bricks(bricks_, brick_, side);
    int lowest = sum(brick_);
    for (const std::int64_t j : incident) lowest = std::min(lowest, sum(j));
    if (lowest == sum(brick_)) return false;
    bool any = false;
    for (const std::int64_t j : incident)
      if (sum(j) == lowest) any = rise_along_worst(j) || any;
    return any;
  }

  // Bricks have tolerances of their own, and one that is looser, or reads the base, has what all store here.
  bool looser_owner(const std::array<int, 3>& side) {
    const auto incident = incident_bricks(bricks_, brick_, side);
    const std::int64_t owner = shared_part(bricks_, bricks_.level, incident, side).owner;
    if (owner == brick_ || bricks_.tolerance[at(owner)] <= bricks_.tolerance[at(brick_)]) return false;
    if (bricks_.level[at(owner)] != level_of_base) return rise_along_worst(owner);
    for (const std::int64_t j : incident)
      if (j != brick_ && bricks_.level[at(j)] == level_of_base) rise_along_worst(j);
    return true;
  }

  bool itself() { return rise_along_worst(brick_); }

 private:
  // The axis that errs most, as far as this brick knows; where that is not known, the coarsest ones; with
  // isotropic levels, all.
  bool rise_along_worst(std::int64_t brick) {
    const LevelTriple own = bricks_.level[at(brick)];
    if (own == top_) return false;
    // Samples a cell, as log2.
    const auto density = [&](std::size_t zyx) { return own[zyx] - bricks_.coarsening[zyx]; };
    const int lowest = std::min({density(0), density(1), density(2)});
    // By what an axis errs, not by what its next level saves: an error can fall only some levels on, and the
    // other axes would rise to gold before it for next to nothing.
    std::size_t worst = 3;
    float most = 0;
    for (std::size_t a = 0; along_ && a < 3; ++a) {
      const int level = own[2 - a], top = top_[2 - a];
      const float errs = error(*along_, a, level, top);
      if (level >= top || errs <= most) continue;
      worst = a;
      most = errs;
    }
    for (std::size_t a = 0; a < 3; ++a)
      if (worst < 3 ? a == worst : density(2 - a) == lowest)
        rise(to_[at(brick)][2 - a], static_cast<std::uint8_t>(own[2 - a] + 1));
    return true;
  }

  const OpenBricks& bricks_;
  std::int64_t brick_;
  LevelTriple own_, top_;
  const AxisErrors* along_;
  std::vector<LevelTriple>& to_;
};

}  // namespace

bool raise_levels(const OpenBricks& bricks, std::int64_t brick, std::uint32_t violated,
                  const AxisErrors* along, std::vector<LevelTriple>& to) {
  Raise raise(bricks, brick, along, to);
  const bool own_tolerances = !bricks.tolerance.empty();
  constexpr int inside = 13;
  bool neighbours = false, done = true;
  std::vector<std::array<int, 3>> mending;
  // What a corner or an edge does not hold is seen beside it too, and mends with it.
  const auto waits = [&](const std::array<int, 3>& side) {
    return own_tolerances && std::any_of(mending.begin(), mending.end(), [&](const auto& other) {
             for (std::size_t a = 0; a < 3; ++a)
               if (side[a] != 1 && side[a] != other[a]) return false;
             return true;
           });
  };
  for_each_part([&](const std::array<int, 3>& side) {
    if (!done || !(violated >> (9 * side[2] + 3 * side[1] + side[0]) & 1) || waits(side)) return;
    if (raise.coarser_neighbours(side) || (own_tolerances && raise.looser_owner(side)) ||
        raise.owners_of_corner(side)) {
      neighbours = true;
      mending.push_back(side);
    } else if (!raise.itself() && !raise.others(side)) {
      done = false;
    }
  });
  if (!done) return false;
  // What a border does not hold is seen inside too, and mends with it.
  return neighbours || !(violated >> inside & 1) || raise.itself();
}

}  // namespace vdvr
