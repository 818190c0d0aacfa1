// The paper's closing (its section 4.3): the low side of a border is upgraded and fed with the gold of the
// high side there; what else is new is interpolated. A brick between three levels is fed at the first,
// interpolated again, then fed at the second.
#include <algorithm>
#include <bit>

#include "host/base/system/casts.hpp"
#include "host/certify/closing/close_boundaries.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {
namespace {

LevelTriple isotropic(int level) {
  const auto l = static_cast<std::uint8_t>(level);
  return {l, l, l};
}

// The samples of a tile one level finer, interpolated between those of `coarse`.
std::vector<float> refined(const TileView& view, const std::vector<float>& coarse, const TileView& finer) {
  std::vector<float> out(finer.size());
  Index3 i{};
  for (i[2] = 0; i[2] <= finer.last[2]; ++i[2])
    for (i[1] = 0; i[1] <= finer.last[1]; ++i[1])
      for (i[0] = 0; i[0] <= finer.last[0]; ++i[0]) {
        const std::size_t low = view.index({i[0] / 2, i[1] / 2, i[2] / 2});
        const std::size_t dx = i[0] % 2 ? 1 : 0, dy = i[1] % 2 ? at(view.stride_y) : 0,
                          dz = i[2] % 2 ? at(view.stride_z) : 0;
        const auto row = [&](std::size_t from) {
          return dx ? vdvr_lerp(coarse[from], coarse[from + dx], 0.5f) : coarse[from];
        };
        const auto plane = [&](std::size_t from) {
          return dy ? vdvr_lerp(row(from), row(from + dy), 0.5f) : row(from);
        };
        out[finer.index(i)] = dz ? vdvr_lerp(plane(low), plane(low + dz), 0.5f) : plane(low);
      }
  return out;
}

// What a brick starts from: its own samples, those on the base lattice from the base.
std::vector<float> own_tile(const OpenBricks& b, std::int64_t brick, const TileView& view) {
  std::vector<float> tile = b.samples.copy(at(brick));
  tile.resize(view.size());
  Index3 i{};
  for (i[2] = 0; i[2] <= view.last[2]; i[2] += std::int64_t{1} << view.level[2])
    for (i[1] = 0; i[1] <= view.last[1]; i[1] += std::int64_t{1} << view.level[1])
      for (i[0] = 0; i[0] <= view.last[0]; i[0] += std::int64_t{1} << view.level[0])
        tile[view.index(i)] = base_sample(b, view, i);
  return tile;
}

// One part of the border at one level: fed where an incident brick has that level as its own; else what was
// interpolated there is rounded as every brick that stores it rounds it.
void feed(const StoredAs& stored, const Entity& entity, const TileView& view, int level,
          std::vector<float>& tile) {
  const OpenBricks& b = stored.open;
  const auto& incident = entity.incident();
  const auto source = std::find_if(incident.begin(), incident.end(),
                                   [&](std::int64_t i) { return b.level[at(i)] == isotropic(level); });
  const bool fed = source != incident.end() && level > 0;
  const TileView from(b, fed ? *source : incident.front(), isotropic(level));
  entity.for_each(view, {1, 1, 1}, [&](const Index3& i) {
    int on_base = level;
    for (const std::size_t a : entity.along())
      on_base = std::min(on_base, std::countr_zero(static_cast<std::uint64_t>(i[a])));
    if (on_base == level) return;  // base samples stand
    float& sample = tile[view.index(i)];
    if (fed) sample = b.samples[at(*source)][from.index(entity.index_in(from, view, i))];
    sample = round_to(sample, entity.unit(view, i));
  });
}

}  // namespace

std::vector<LevelTriple> levels_by_paper(const OpenBricks& b) {
  std::vector<LevelTriple> levels = b.level;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (!b.involved[i]) continue;
    const Surroundings around(b, static_cast<std::int64_t>(i));
    for (int part = 0; part < 27; ++part)
      for (const std::int64_t j : incident_bricks(b, around, {part % 3, part / 3 % 3, part / 9}))
        for (std::size_t a = 0; a < 3; ++a) levels[i][a] = std::max(levels[i][a], b.level[at(j)][a]);
  }
  return levels;
}

std::vector<float> tile_by_paper(const StoredAs& stored, std::int64_t brick) {
  const OpenBricks& b = stored.open;
  const Surroundings around(b, brick);
  const int own = b.level[at(brick)][0], top = stored.level[at(brick)][0];
  TileView view(b, brick, isotropic(own));
  std::vector<float> tile = own_tile(b, brick, view);
  for (int level = own; level <= top; ++level) {
    if (level > own) {
      const TileView finer(b, brick, isotropic(level));
      tile = refined(view, tile, finer);
      view = finer;
    }
    for_each_part([&](const std::array<int, 3>& side) {
      feed(stored, Entity(stored, around, side), view, level, tile);
    });
  }
  repeat_last_planes(view, tile);
  return tile;
}

}  // namespace vdvr
