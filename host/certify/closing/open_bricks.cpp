// Geometry of bricks and what they share.
#include "host/certify/closing/open_bricks.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {

Index3 OpenBricks::counts() const { return Bricks(grid, granularity).along(); }

Index3 OpenBricks::position(std::int64_t brick) const { return Bricks(grid, granularity).position(brick); }

Surroundings::Surroundings(const OpenBricks& b, std::int64_t of) : brick(of) {
  const Bricks bricks(b.grid, b.granularity);
  const Index3& n = bricks.along();
  position = bricks.position(of);
  std::size_t next = 0;
  for (std::int64_t z = position[2] - 1; z <= position[2] + 1; ++z)
    for (std::int64_t y = position[1] - 1; y <= position[1] + 1; ++y)
      for (std::int64_t x = position[0] - 1; x <= position[0] + 1; ++x) {
        const bool there = z >= 0 && y >= 0 && x >= 0 && z < n[2] && y < n[1] && x < n[0];
        around[next++] = there ? (z * n[1] + y) * n[0] + x : -1;
      }
}

FewBricks incident_bricks(const OpenBricks& b, const Surroundings& of, const std::array<int, 3>& side,
                          bool all) {
  const auto low = [&](std::size_t a) { return side[a] == 0 ? 0 : 1; };
  const auto high = [&](std::size_t a) { return side[a] == 2 ? 2 : 1; };
  FewBricks out;
  for (int z = low(2); z <= high(2); ++z)
    for (int y = low(1); y <= high(1); ++y)
      for (int x = low(0); x <= high(0); ++x) {
        const std::int64_t i = of.around[static_cast<std::size_t>(9 * z + 3 * y + x)];
        if (i >= 0 && (all || i == of.brick || b.involved[at(i)])) out.push_back(i);
      }
  return out;
}

FewBricks incident_bricks(const OpenBricks& b, std::int64_t brick, const std::array<int, 3>& side, bool all) {
  return incident_bricks(b, Surroundings(b, brick), side, all);
}

namespace {

// Half powers of two of a tolerance: a brick whose own is hardly larger may own what it shares, and a coarse
// one costs the others less.
int looseness(const OpenBricks& b, std::int64_t brick) {
  if (b.tolerance.empty()) return 0;
  return static_cast<int>(std::floor(2 * std::log2(std::max(b.tolerance[at(brick)], 0x1p-100f))));
}

}  // namespace

SharedPart shared_part(const OpenBricks& b, const std::vector<LevelTriple>& level, const FewBricks& incident,
                       const std::array<int, 3>& side) {
  SharedPart out;
  for (std::size_t a = 0; a < 3; ++a) {
    out.level[a] = level[at(incident.front())][2 - a];
    for (const std::int64_t i : incident) out.level[a] = std::min<int>(out.level[a], level[at(i)][2 - a]);
  }
  // One that reads the base, since nothing else can be stored there. Then the strictest, since what the
  // others fitted may err by what they are allowed. Then those that have the part's own lattice, if any has:
  // their samples are fitted to that. Then the coarsest.
  const auto rank = [&](std::int64_t i) {
    const LevelTriple& l = level[at(i)];
    bool same = true;
    for (std::size_t a = 0; a < 3; ++a) same = same && (side[a] != 1 || l[2 - a] == out.level[a]);
    return std::array{l == LevelTriple{0, 0, 0} ? 0 : 1, looseness(b, i), same ? 0 : 1, l[0] + l[1] + l[2]};
  };
  out.owner = incident.front();
  for (const std::int64_t i : incident)
    if (rank(i) < rank(out.owner)) out.owner = i;
  return out;
}

TileView::TileView(const OpenBricks& b, const Index3& brick, const LevelTriple& l)
    : position(brick), level{l[2], l[1], l[0]} {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t width =
        std::min<std::int64_t>(b.granularity, b.grid.cells[a] - position[a] * b.granularity);
    end[a] = width << level[a] >> b.coarsening[2 - a];
    last[a] = static_cast<std::int64_t>(b.granularity) << level[a] >> b.coarsening[2 - a];
  }
  stride_y = last[0] + 1;
  stride_z = stride_y * (last[1] + 1);
}

float base_sample(const OpenBricks& b, const TileView& t, const Index3& i) {
  const Index3 n = base_samples(b.grid, b.coarsening);
  Index3 c{};
  for (std::size_t a = 0; a < 3; ++a)
    c[a] = std::min((t.position[a] * b.granularity >> b.coarsening[2 - a]) + (i[a] >> t.level[a]), n[a] - 1);
  return b.base[at((c[2] * n[1] + c[1]) * n[0] + c[0])];
}

void repeat_last_planes(const TileView& t, std::vector<float>& tile) {
  if (t.last == t.end) return;
  for (std::int64_t z = 0; z <= t.last[2]; ++z)
    for (std::int64_t y = 0; y <= t.last[1]; ++y)
      for (std::int64_t x = 0; x <= t.last[0]; ++x)
        tile[t.index({x, y, z})] =
            tile[t.index({std::min(x, t.end[0]), std::min(y, t.end[1]), std::min(z, t.end[2])})];
}

Entity::Entity(const StoredAs& stored, const Surroundings& of, const std::array<int, 3>& side)
    : stored_(stored),
      side_(side),
      incident_(incident_bricks(stored.open, of, side)),
      all_(incident_bricks(stored.open, of, side, true)) {
  for (std::size_t a = 0; a < 3; ++a)
    if (side[a] == 1) along_.push_back(a);
  for (const std::int64_t brick : all_)
    one_unit_ = one_unit_ && stored.unit[at(brick)] == stored.unit[at(of.brick)];
}

double Entity::unit(const TileView& tile, const Index3& i) const {
  if (one_unit_) return stored_.unit[at(all_.front())];
  double unit = 0;
  for (const std::int64_t brick : all_) {
    const LevelTriple& l = stored_.level[at(brick)];
    bool stores = true;
    for (const std::size_t a : along_)
      stores = stores && tile.level[a] - l[2 - a] <= std::countr_zero(static_cast<std::uint64_t>(i[a]));
    if (stores) unit = std::max(unit, stored_.unit[at(brick)]);
  }
  return unit;
}

Index3 Entity::index_in(const TileView& other, const TileView& tile, const Index3& i) const {
  Index3 o{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (side_[a] == 1) {
      const int shift = other.level[a] - tile.level[a];
      o[a] = shift >= 0 ? i[a] << shift : i[a] >> -shift;
    } else {
      // The border between two positions; the other brick may lie on either side of it.
      const std::int64_t plane = tile.position[a] + (side_[a] == 2 ? 1 : 0);
      o[a] = other.position[a] == plane ? 0 : other.end[a];
    }
  }
  return o;
}

}  // namespace vdvr
