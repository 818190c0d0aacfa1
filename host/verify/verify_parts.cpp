// How the bricks that are asked for are cut: by the nodes that memory holds, and into slabs of blocks.
#include "host/verify/verify_parts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdvr {
namespace {

// Of cone beam, heights of nodes that are back-projected together, but for those around them, of which sparse
// nodes need more.
constexpr std::int64_t most_heights = 128, most_sparse_heights = 512;

/// Only the selected bricks in layers [first, end) along an axis.
std::vector<std::uint8_t> layers_of(const std::vector<std::uint8_t>& selected, const Index3& n,
                                    std::size_t axis, std::int64_t first, std::int64_t end) {
  std::vector<std::uint8_t> some(selected.size(), 0);
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
    const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
    some[at(i)] = p[axis] >= first && p[axis] < end ? selected[at(i)] : std::uint8_t{0};
  }
  return some;
}

/// To hold [first, last] of a tile too, as far as these lie in it.
void widen(std::array<std::uint8_t, 4>& range, std::size_t axis, std::int64_t first, std::int64_t last) {
  const auto in_tile = [](std::int64_t n) {
    return static_cast<std::uint8_t>(std::clamp<std::int64_t>(n, 0, VDVR_VERIFY_TILE - 1));
  };
  range[axis] = std::min(range[axis], in_tile(first));
  range[axis + 1] = std::max(range[axis + 1], in_tile(last));
}

}  // namespace

// A brick whose middle lies further outside than half its diagonal and a cell's has no tested cell, nor has
// one above or below what is covered.
std::vector<std::uint8_t> VerifyField::near_coverage(std::vector<std::uint8_t> selected) const {
  const Index3 n = volume_.bricks();
  const Grid& grid = volume_.grid;
  const double g = volume_.granularity, diagonal = std::hypot(grid.spacing[0], grid.spacing[1]);
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
    const double x = grid.origin[0] + (static_cast<double>(i % n[0]) + 0.5) * g * grid.spacing[0],
                 y = grid.origin[1] + (static_cast<double>(i / n[0] % n[1]) + 0.5) * g * grid.spacing[1];
    if (coverage_.margin(x, y) < -(0.5 * g + 1) * diagonal) selected[at(i)] = 0;
    const double z = grid.origin[2] + (static_cast<double>(i / n[0] / n[1]) + 0.5) * g * grid.spacing[2];
    if (coverage_.margin_z(z) < -(0.5 * g + 1) * grid.spacing[2]) selected[at(i)] = 0;
  }
  return selected;
}

int VerifyField::nodes_along(int most) const {
  const auto dense = [&](int along) {
    return field_.views().empty() ? volume_.grid.spacing[2] / along <= 0.25 * field_.geometry().pitch_v
                                  : along >= rates_of_cone_.along;
  };
  int along = 1;
  while (along < most && !dense(along)) along *= 2;
  return along;
}

std::uint64_t VerifyField::part_bytes() const {
  return std::min(state_.memory.left() / 3, state_.info.max_allocation);
}

bool VerifyField::rows_serve(std::int64_t layers) const {
  if (!field_.views().empty()) return false;
  const std::int64_t of_layer = std::int64_t{volume_.granularity} * nodes_along(1 << 24) + 1 +
                                2 * (verify_halo + VerifyNodes::Part{}.reach());
  return field_.geometry().rows <= std::min(layers, volume_.bricks()[2]) * of_layer;
}

VerifyField::Spread VerifyField::spread_of(std::span<const int> rates, Made made) const {
  Spread s;
  if (made == Made::sparse) {
    s.across = sparse_rates_.across;
    s.along = sparse_rates_.along;
    s.points = sparse_points;
    const auto around = [&](std::int64_t nodes) {
      return s.points / 2 + (verify_halo * nodes + rates.front() - 1) / rates.front();
    };
    s.around = around(s.across);
    s.beyond = around(s.along);
    return s;
  }
  const std::int64_t reach = VerifyNodes::Part{}.reach();
  s.across = std::min(rates.front(), across_);
  s.along = nodes_along(rates.back());
  s.around = rates.back() > s.across ? reach : verify_halo;
  // Steps of the coarsest rate, and a polynomial's nodes.
  s.beyond =
      verify_halo * std::max<std::int64_t>(1, s.along / rates.front()) + (rates.back() > s.along ? reach : 0);
  return s;
}

VerifyNodes::Part VerifyField::nodes_of(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                                        bool rows, Made made) const {
  const Index3 n = volume_.bricks();
  const BoxOfBricks box(n, selected);
  const Spread spread = spread_of(rates, made);
  VerifyNodes::Part p;
  p.across = spread.across;
  p.points = spread.points;
  const std::int64_t side = std::int64_t{volume_.granularity} * p.across, around = spread.around;
  // Corners of tested cells lie within a diagonal of gold, differences two steps on, a polynomial's nodes
  // beyond these.
  const double diagonal = std::hypot(volume_.grid.spacing[0], volume_.grid.spacing[1]);
  p.furthest = diagonal * (3.1 / rates.front() + static_cast<double>(around) / p.across);
  p.first_x = box.first[0] * side - around;
  p.first_y = box.first[1] * side - around;
  p.nx = (box.end[0] - box.first[0]) * side + 1 + 2 * around;
  p.ny = (box.end[1] - box.first[1]) * side + 1 + 2 * around;
  p.rows = rows;
  if (!rows) {
    p.along = spread.along;
    const std::int64_t tall = std::int64_t{volume_.granularity} * p.along, beyond = spread.beyond;
    p.first_z = box.first[2] * tall - beyond;
    p.nz = (box.end[2] - box.first[2]) * tall + 1 + 2 * beyond;
  }
  const std::int64_t across = VerifyNodes::tiles_across(p.nx);
  p.tiles.assign(at(across * VerifyNodes::tiles_across(p.ny)), 0);
  const bool cone = !field_.views().empty();
  const std::int64_t blocks = cone ? p.blocks_along() : 0, tall = std::int64_t{volume_.granularity} * p.along,
                     around_z = cone ? (p.nz - 1 - (box.end[2] - box.first[2]) * tall) / 2 : 0;
  p.blocks.assign(p.tiles.size() * at(blocks), 0);
  constexpr std::int64_t tile_side = VDVR_VERIFY_TILE;
  if (cone) p.ranges.assign(p.tiles.size(), {tile_side, 0, tile_side, 0});
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
    if (!selected[at(i)]) continue;
    const std::int64_t x = (i % n[0] - box.first[0]) * side, y = (i / n[0] % n[1] - box.first[1]) * side;
    const std::int64_t z = (i / n[0] / n[1] - box.first[2]) * tall, first_block = z / 16,
                       last_block = cone ? (z + tall + 2 * around_z) / 16 : -1;
    for (std::int64_t ty = y / VDVR_VERIFY_TILE; ty <= (y + side + 2 * around) / VDVR_VERIFY_TILE; ++ty)
      for (std::int64_t tx = x / VDVR_VERIFY_TILE; tx <= (x + side + 2 * around) / VDVR_VERIFY_TILE; ++tx) {
        p.tiles[at(ty * across + tx)] = 1;
        if (!cone) continue;
        widen(p.ranges[at(ty * across + tx)], 0, x - tx * tile_side, x + side + 2 * around - tx * tile_side);
        widen(p.ranges[at(ty * across + tx)], 2, y - ty * tile_side, y + side + 2 * around - ty * tile_side);
        for (std::int64_t b = first_block; b <= last_block; ++b)
          p.blocks[at((ty * across + tx) * blocks + b)] = 1;
      }
  }
  return p;
}

// Of cone beam: neighbouring layers of bricks together, whose heights around them are then the same.
std::vector<std::vector<std::uint8_t>> VerifyField::joined(std::vector<std::vector<std::uint8_t>> layers,
                                                           const std::vector<std::uint8_t>& selected,
                                                           Made made) const {
  const Index3 n = volume_.bricks();
  const bool sparse = made == Made::sparse;
  const auto together = std::max<std::int64_t>(
      1, (sparse ? most_sparse_heights : most_heights) /
             (std::int64_t{volume_.granularity} * (sparse ? sparse_rates_ : rates_of_cone_).along));
  std::vector<std::vector<std::uint8_t>> out;
  std::int64_t first = -1, last = -1;
  for (const std::vector<std::uint8_t>& layer : layers) {
    const std::int64_t z = BoxOfBricks(n, layer).first[2];
    if (!out.empty() && z == last + 1 && z < first + together) {
      out.back() = layers_of(selected, n, 2, first, z + 1);
    } else {
      out.push_back(layer);
      first = z;
    }
    last = z;
  }
  return out;
}

// The detector's rows serve all heights; where fewer heights are asked for, they are made themselves, layer
// by layer of bricks. Both in bands of bricks whose nodes fit the memory.
std::vector<VerifyField::Part> VerifyField::parts_of(const std::vector<std::uint8_t>& selected,
                                                     std::span<const int> rates, Made made) const {
  const Index3 n = volume_.bricks();
  std::vector<std::vector<std::uint8_t>> runs;
  std::int64_t heights = 0;
  for (std::int64_t z = 0; z < n[2]; ++z) {
    std::vector<std::uint8_t> layer = layers_of(selected, n, 2, z, z + 1);
    if (std::find(layer.begin(), layer.end(), 1) == layer.end()) continue;
    heights += nodes_of(layer, rates, false, made).nz;
    runs.push_back(std::move(layer));
  }
  // Of cone beam no two nodes see the same rows.
  const bool rows = field_.views().empty() && field_.geometry().rows <= heights;
  if (rows) runs.assign(1, selected);
  if (!field_.views().empty()) runs = joined(std::move(runs), selected, made);
  std::vector<Part> parts;
  for (const std::vector<std::uint8_t>& run : runs) {
    const BoxOfBricks box(n, run);
    for (std::int64_t y = box.first[1]; y < box.end[1];) {
      std::int64_t end = box.end[1];
      Part part;
      for (;; end = y + (end - y + 1) / 2) {
        part.selected = layers_of(run, n, 1, y, end);
        if (BoxOfBricks(n, part.selected).bricks == 0) break;
        part.nodes = nodes_of(part.selected, rates, rows, made);
        if (end == y + 1 || nodes_.bytes_of(part.nodes) <= part_bytes()) break;
      }
      y = end;
      if (BoxOfBricks(n, part.selected).bricks > 0) parts.push_back(std::move(part));
    }
  }
  return parts;
}

std::vector<VerifyField::Slab> VerifyField::slabs_of(const Shape& s,
                                                     const std::vector<std::uint8_t>& selected) const {
  const Index3 n = volume_.bricks();
  const BoxOfBricks box(n, selected);
  const auto end = [&](std::size_t a) { return std::min(s.pieces[a], box.end[a] * s.per_brick); };
  std::vector<Slab> slabs;
  for (std::int64_t z = box.first[2] * s.per_brick; z < end(2); z += s.height) {
    Slab slab{z, {}};
    for (std::int64_t y = box.first[1] * s.per_brick; y < end(1); y += s.width)
      for (std::int64_t x = box.first[0] * s.per_brick; x < end(0); x += s.width) {
        bool any = false;
        for (std::int64_t bz = z; bz < std::min(end(2), z + s.height); ++bz)
          for (std::int64_t by = y; by < std::min(end(1), y + s.width); ++by)
            for (std::int64_t bx = x; bx < std::min(end(0), x + s.width); ++bx)
              any = any || selected[s.brick(n, bx, by, bz)] != 0;
        if (any) slab.blocks.push_back({x, y});
      }
    if (!slab.blocks.empty()) slabs.push_back(std::move(slab));
  }
  return slabs;
}

}  // namespace vdvr
