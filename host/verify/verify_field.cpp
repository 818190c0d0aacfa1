// Bounds cell by cell on gold that verify_nodes makes.
#include "host/verify/verify_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "host/bounds/result_units.hpp"
#include "host/opencl/kernel.hpp"
#include "host/system/casts.hpp"
#include "host/system/parallel.hpp"
#include "shared/verify_pieces.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrPieces) == 64);
namespace {

constexpr std::int64_t halo = 2;   // of gold nodes: RADIUS of the kernel
constexpr std::int64_t room = 64;  // floats after a buffer's end that 16-lane reads may touch

std::int64_t up(std::int64_t n, std::int64_t multiple) { return (n + multiple - 1) / multiple * multiple; }

// Gold cells of a piece's side at most: what is computed at once stays small whatever the rate.
constexpr std::int64_t most_cells = 64;

// Of cone beam, heights of nodes that are back-projected together, but for those around them.
constexpr std::int64_t most_heights = 128;

/// Host memory counted against --max-memory.
class HostShare {
 public:
  HostShare(opencl::State& state, std::uint64_t bytes, const std::string& what)
      : state_(state), bytes_(bytes) {
    state.memory.take(bytes, what);
  }
  ~HostShare() { state_.memory.give(bytes_); }
  HostShare(const HostShare&) = delete;
  HostShare& operator=(const HostShare&) = delete;

 private:
  opencl::State& state_;
  std::uint64_t bytes_;
};

}  // namespace

/// How the selected bricks are cut into pieces, and these joined to blocks that are computed at once.
struct VerifyField::Shape {
  std::int64_t rate = 1;               // gold cells to a cell of the grid
  Vec3 h{};                            // gold spacing
  std::int64_t width = 1, height = 1;  // pieces per block across z, pieces per slab along z
  std::int64_t cells = 1;              // gold cells of a piece's side
  std::int64_t per_brick = 1;          // pieces of a brick's side
  Index3 pieces{};                     // of the grid
  std::int64_t nx = 0, nz = 0, z_padded = 0, error_padded = 0, words = 0;
  std::int64_t slab_z = 0;  // first layer of pieces
  VerifyNodes::Part nodes;  // that gold is made of
  FieldBounds bounds;       // of parallel beam
  float correction = 1;     // of all bounds

  /// Where a piece begins along an axis.
  [[nodiscard]] double begin(const Grid& grid, std::size_t axis, std::int64_t piece) const {
    return grid.origin[axis] +
           static_cast<double>(piece * cells) / static_cast<double>(rate) * grid.spacing[axis];
  }
  /// The brick that a piece belongs to, (z * bricks_y + y) * bricks_x + x.
  [[nodiscard]] std::size_t brick(const Index3& n, std::int64_t x, std::int64_t y, std::int64_t z) const {
    return at((z / per_brick * n[1] + y / per_brick) * n[0] + x / per_brick);
  }
};

struct VerifyField::Batch {
  std::vector<cl_int4> first, items;
  std::vector<std::int64_t> bricks;  // of the items
  std::vector<std::uint8_t> tested;  // [block][y][x] gold cell columns
};

namespace {

// The stored field times 2^exponent.
DeviceField upload(opencl::State& state, const MixedVolume& volume, int exponent) {
  if (exponent == 0) return {state, volume};
  const HostShare copy(state, volume.base.bytes(), "the stored field in other units");
  MixedVolume scaled = volume;
  scale(scaled, exponent);
  return {state, scaled};
}

}  // namespace

/// Bricks whose nodes are held at once.
struct VerifyField::Part {
  VerifyNodes::Part nodes;
  std::vector<std::uint8_t> selected;
};

/// Blocks that are computed one after another, from the same heights.
struct VerifyField::Slab {
  std::int64_t z = 0;
  std::vector<std::array<std::int64_t, 2>> blocks;
};

namespace {

// How far beyond the covered region, across z, a node may lie that is used: corners of tested cells within a
// diagonal of gold, differences two steps on, a polynomial's nodes beyond these.
double furthest_node(const MixedVolume& v, int across) {
  const double diagonal = std::hypot(v.grid.spacing[0], v.grid.spacing[1]);
  return 3.1 * diagonal / std::min(v.rate, across) +
         static_cast<double>(VerifyNodes::reach) * diagonal / across;
}

/// The bricks that are selected lie in [first, end) along each axis.
struct Box {
  Index3 first{INT64_MAX, INT64_MAX, INT64_MAX}, end{0, 0, 0};
  std::int64_t bricks = 0;

  Box(const Index3& n, const std::vector<std::uint8_t>& selected) {
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
      if (!selected[at(i)]) continue;
      ++bricks;
      const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
      for (std::size_t a = 0; a < 3; ++a) {
        first[a] = std::min(first[a], p[a]);
        end[a] = std::max(end[a], p[a] + 1);
      }
    }
  }
  [[nodiscard]] std::int64_t size() const {
    return (end[0] - first[0]) * (end[1] - first[1]) * (end[2] - first[2]);
  }
};

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

}  // namespace

VerifyField::VerifyField(opencl::State& state, const ExactField& field, const MixedVolume& volume,
                         const std::optional<std::pair<double, double>>& window, const Progress& progress,
                         int density)
    : state_(state),
      field_(field),
      volume_(volume),
      unit_(std::ldexp(1.0, density)),
      coverage_(field.geometry(), field.views()),
      sups_(field.views().empty() ? view_sups(field.coefficients(), field.geometry(), progress)
                                  : cone_view_sups(field, progress)),
      stored_(upload(state, volume, -density)),
      rates_of_cone_(cone_node_rates(field, coverage_, volume.grid.spacing)),
      across_(field.views().empty() ? nodes_across(volume.grid, field.geometry()) : rates_of_cone_.across),
      nodes_(field.views().empty()
                 ? VerifyNodes(state, field, volume.grid, unit_, furthest_node(volume, across_))
                 : VerifyNodes(state, field, coverage_, volume.grid, unit_, furthest_node(volume, across_))) {
  if (window) window_ = {window->first / unit_, window->second / unit_};
}

int VerifyField::least_rate(std::size_t brick) const {
  int rate = 1;
  for (std::size_t a = 0; a < 3; ++a)
    while (std::int64_t{rate} << volume_.coarsening[a] < std::int64_t{1} << volume_.level[brick][a])
      rate *= 2;
  return rate;
}

void VerifyField::look_at(const std::vector<std::size_t>& bricks, std::int64_t nodes_each, unsigned seed) {
  looked_at_.assign(volume_.level.size(), 0);
  for (const std::size_t brick : bricks) looked_at_[brick] = 1;
  nodes_each_ = nodes_each;
  random_.seed(seed);
}

VerifyField::Shape VerifyField::shape_at(int rate, bool many, const VerifyNodes::Part& part) const {
  Shape s;
  s.rate = rate;
  s.h = volume_.grid.spacing;
  for (double& h : s.h) h /= static_cast<double>(rate);
  const std::int64_t side = std::int64_t{volume_.granularity} * rate;
  s.cells = std::min(side, most_cells);
  s.per_brick = side / s.cells;
  for (std::size_t a = 0; a < 3; ++a) s.pieces[a] = (volume_.grid.cells[a] * rate + s.cells - 1) / s.cells;
  // Few bricks are computed one by one, many in blocks with less halo.
  if (many) s.width = s.height = std::max<std::int64_t>(1, most_cells / s.cells);
  s.nx = s.width * s.cells + 1 + 2 * halo;
  s.error_padded = up(s.cells + 1, 16) + 16;
  s.words = (s.cells + 15) / 16;
  s.nodes = part;
  if (field_.views().empty())
    s.bounds = field_bounds(sups_, field_.rounding(), field_.geometry(), s.h, nodes_.path(part, rate));
  return s;
}

// --- cone beam: bounds by groups of bricks ---

namespace {

// Groups of bricks across the grid at most, along each axis: lambda, and with it every bound, changes little
// in one.
constexpr std::int64_t most_groups = 16;

std::int64_t bricks_to_group(std::int64_t bricks) { return (bricks + most_groups - 1) / most_groups; }

}  // namespace

std::int64_t VerifyField::group_of(std::int64_t brick) const {
  const Index3 n = volume_.bricks(), p{brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
  return (p[2] / bricks_to_group(n[2]) * most_groups + p[1] / bricks_to_group(n[1])) * most_groups +
         p[0] / bricks_to_group(n[0]);
}

// With all nodes that gold of its tested cells, and differences of that gold, are made of.
ConeBox VerifyField::group_box(std::int64_t group, int rate, const VerifyNodes::Part& part) const {
  const Index3 n = volume_.bricks(),
               p{group % most_groups, group / most_groups % most_groups, group / most_groups / most_groups};
  const Grid& grid = volume_.grid;
  ConeBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const int nodes = a < 2 ? part.across : part.along;
    const double around = static_cast<double>(halo) / rate +
                          (rate > nodes ? static_cast<double>(VerifyNodes::reach) / nodes : 0.0);
    const std::int64_t cells = bricks_to_group(n[a]) * volume_.granularity;
    box.low[a] = grid.origin[a] + (static_cast<double>(p[a] * cells) - around) * grid.spacing[a];
    box.high[a] =
        grid.origin[a] +
        (static_cast<double>(std::min((p[a] + 1) * cells, grid.cells[a])) + around) * grid.spacing[a];
  }
  return box;
}

void VerifyField::bound_groups(const Shape& s, const std::vector<std::uint8_t>& selected) {
  std::vector<std::int64_t> groups;
  for (std::size_t i = 0; i < selected.size(); ++i)
    if (selected[i]) groups.push_back(group_of(static_cast<std::int64_t>(i)));
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  const ConePath path{nodes_.path(s.nodes, to_int(s.rate)), nodes_.cone_facts(), field_.rounding()};
  const auto bounds = [&](std::int64_t group, bool corrected) {
    return cone_field_bounds(field_.views(), sups_, group_box(group, to_int(s.rate), s.nodes), s.h, path,
                             corrected);
  };
  // On coarse gold the sixth derivatives weigh more than what the fourth differences gain: one choice for
  // all, as kernels make it.
  const std::int64_t middle = groups[groups.size() / 2];
  const bool corrected = !(bounds(middle, false).second < bounds(middle, true).second);
  std::vector<FieldBounds> found(groups.size());
  parallel_for(static_cast<std::int64_t>(groups.size()), {}, "",
               [&](std::int64_t i) { found[at(i)] = bounds(groups[at(i)], corrected); });
  of_groups_.clear();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    of_groups_.emplace(groups[i], found[i]);
    arithmetic_ = std::max(arithmetic_, found[i].arithmetic);
  }
}

const FieldBounds& VerifyField::bounds_of(const Shape& s, std::int64_t brick) const {
  return field_.views().empty() ? s.bounds : of_groups_.at(group_of(brick));
}

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

VerifyNodes::Part VerifyField::nodes_of(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                                        bool rows) const {
  const Index3 n = volume_.bricks();
  const Box box(n, selected);
  VerifyNodes::Part p;
  p.across = std::min(rates.front(), across_);
  const std::int64_t side = std::int64_t{volume_.granularity} * p.across,
                     around = rates.back() > p.across ? VerifyNodes::reach : halo;
  p.first_x = box.first[0] * side - around;
  p.first_y = box.first[1] * side - around;
  p.nx = (box.end[0] - box.first[0]) * side + 1 + 2 * around;
  p.ny = (box.end[1] - box.first[1]) * side + 1 + 2 * around;
  p.rows = rows;
  if (!rows) {
    p.along = 1;
    const auto dense = [&](int along) {
      return field_.views().empty() ? volume_.grid.spacing[2] / along <= 0.25 * field_.geometry().pitch_v
                                    : along >= rates_of_cone_.along;
    };
    while (p.along < rates.back() && !dense(p.along)) p.along *= 2;
    const std::int64_t tall = std::int64_t{volume_.granularity} * p.along;
    // Steps of the coarsest rate, and a polynomial's nodes.
    const std::int64_t beyond = halo * std::max<std::int64_t>(1, p.along / rates.front()) +
                                (rates.back() > p.along ? VerifyNodes::reach : 0);
    p.first_z = box.first[2] * tall - beyond;
    p.nz = (box.end[2] - box.first[2]) * tall + 1 + 2 * beyond;
  }
  const std::int64_t across = VerifyNodes::tiles_across(p.nx);
  p.tiles.assign(at(across * VerifyNodes::tiles_across(p.ny)), 0);
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
    if (!selected[at(i)]) continue;
    const std::int64_t x = (i % n[0] - box.first[0]) * side, y = (i / n[0] % n[1] - box.first[1]) * side;
    for (std::int64_t ty = y / VDVR_VERIFY_TILE; ty <= (y + side + 2 * around) / VDVR_VERIFY_TILE; ++ty)
      for (std::int64_t tx = x / VDVR_VERIFY_TILE; tx <= (x + side + 2 * around) / VDVR_VERIFY_TILE; ++tx)
        p.tiles[at(ty * across + tx)] = 1;
  }
  return p;
}

// Of cone beam: neighbouring layers of bricks together, whose heights around them are then the same.
std::vector<std::vector<std::uint8_t>> VerifyField::joined(std::vector<std::vector<std::uint8_t>> layers,
                                                           const std::vector<std::uint8_t>& selected) const {
  const Index3 n = volume_.bricks();
  const auto together =
      std::max<std::int64_t>(1, most_heights / (std::int64_t{volume_.granularity} * rates_of_cone_.along));
  std::vector<std::vector<std::uint8_t>> out;
  std::int64_t first = -1, last = -1;
  for (const std::vector<std::uint8_t>& layer : layers) {
    const std::int64_t z = Box(n, layer).first[2];
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
                                                     std::span<const int> rates) const {
  const Index3 n = volume_.bricks();
  std::vector<std::vector<std::uint8_t>> runs;
  std::int64_t heights = 0;
  for (std::int64_t z = 0; z < n[2]; ++z) {
    std::vector<std::uint8_t> layer = layers_of(selected, n, 2, z, z + 1);
    if (std::find(layer.begin(), layer.end(), 1) == layer.end()) continue;
    heights += nodes_of(layer, rates, false).nz;
    runs.push_back(std::move(layer));
  }
  // Of cone beam no two nodes see the same rows.
  const bool rows = field_.views().empty() && field_.geometry().rows <= heights;
  if (rows) runs.assign(1, selected);
  if (!field_.views().empty()) runs = joined(std::move(runs), selected);
  const std::uint64_t budget = std::min(state_.memory.left() / 3, state_.info.max_allocation);
  std::vector<Part> parts;
  for (const std::vector<std::uint8_t>& run : runs) {
    const Box box(n, run);
    for (std::int64_t y = box.first[1]; y < box.end[1];) {
      std::int64_t end = box.end[1];
      Part part;
      for (;; end = y + (end - y + 1) / 2) {
        part.selected = layers_of(run, n, 1, y, end);
        if (Box(n, part.selected).bricks == 0) break;
        part.nodes = nodes_of(part.selected, rates, rows);
        if (end == y + 1 || nodes_.bytes_of(part.nodes) <= budget) break;
      }
      y = end;
      if (Box(n, part.selected).bricks > 0) parts.push_back(std::move(part));
    }
  }
  return parts;
}

std::vector<VerifyField::Slab> VerifyField::slabs_of(const Shape& s,
                                                     const std::vector<std::uint8_t>& selected) const {
  const Index3 n = volume_.bricks();
  const Box box(n, selected);
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

void VerifyField::run(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                      const std::function<bool(std::size_t brick, int rate)>& wants,
                      const std::function<void(const Piece&)>& on_piece, const Progress& progress) {
  for (const int rate : rates)
    if (rate < 1 || (rates.size() > 1 && rate % across_ != 0))
      throw InputError(fmt::format("gold of rate {} is not made of {} nodes a cell", rate, across_));
  arithmetic_ = 0;
  const std::vector<Part> parts = parts_of(near_coverage(selected), rates);
  double done = 0;
  const double steps = static_cast<double>(parts.size() * (1 + rates.size()));
  const auto tick = [&](double share) { report(progress, "verify", (done + share) / steps); };
  for (const Part& part : parts) {
    tick(0);
    nodes_.make(part.nodes);
    tick(1);
    ++done;
    for (const int rate : rates) {
      std::vector<std::uint8_t> wanted = part.selected;
      for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = wanted[i] && wants(i, rate);
      const Box box(volume_.bricks(), wanted);
      if (box.bricks > 0) {
        Shape s = shape_at(rate, 2 * box.bricks > box.size(), part.nodes);
        arithmetic_ = std::max(arithmetic_, s.bounds.arithmetic);
        s.correction = s.bounds.correction;
        if (!field_.views().empty()) {
          bound_groups(s, wanted);
          s.correction = of_groups_.begin()->second.correction;
        }
        const std::vector<Slab> slabs = slabs_of(s, wanted);
        for (std::size_t i = 0; i < slabs.size(); ++i) {
          s.slab_z = slabs[i].z;
          const std::int64_t layers = std::min(s.height, s.pieces[2] - s.slab_z);
          s.nz =
              std::min(layers * s.cells, volume_.grid.cells[2] * s.rate - s.slab_z * s.cells) + 1 + 2 * halo;
          s.z_padded = up(s.nz, 16);
          run_slab(s, slabs[i].blocks, wanted, on_piece);
          tick(static_cast<double>(i + 1) / static_cast<double>(slabs.size()));
        }
      }
      ++done;
    }
  }
}

VerifyField::Batch VerifyField::make_batch(const Shape& s,
                                           std::span<const std::array<std::int64_t, 2>> blocks,
                                           const std::vector<std::uint8_t>& selected) const {
  const Grid& grid = volume_.grid;
  const Index3 n = volume_.bricks();
  const std::int64_t side = s.width * s.cells;
  Batch batch;
  batch.tested.assign(blocks.size() * at(side * side), 0);
  // A cell that holds a covered point has its centre within half its diagonal of the region.
  const double half = 0.5 * std::hypot(s.h[0], s.h[1]) * (1 + 1e-9);
  parallel_for(static_cast<std::int64_t>(blocks.size()) * side, {}, "", [&](std::int64_t row) {
    const auto& b = blocks[at(row / side)];
    const double y = s.begin(grid, 1, b[1]) + (static_cast<double>(row % side) + 0.5) * s.h[1];
    for (std::int64_t i = 0; i < side; ++i) {
      const double x = s.begin(grid, 0, b[0]) + (static_cast<double>(i) + 0.5) * s.h[0];
      // Margins change by no more than the distance, so most corners need not be asked for.
      const double margin = coverage_.margin(x, y), dx = 0.5 * s.h[0], dy = 0.5 * s.h[1];
      const bool covered =
          margin >= half || (margin >= -half && coverage_.margin(x - dx, y - dy) >= 0 &&
                             coverage_.margin(x + dx, y - dy) >= 0 && coverage_.margin(x - dx, y + dy) >= 0 &&
                             coverage_.margin(x + dx, y + dy) >= 0);
      batch.tested[at(row * side + i)] = covered ? 2 : margin >= -half ? 1 : 0;
    }
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto& b = blocks[i];
    batch.first.push_back({{to_int(b[0]), to_int(b[1]), to_int(s.slab_z), 0}});
    for (std::int64_t z = s.slab_z; z < std::min(s.pieces[2], s.slab_z + s.height); ++z)
      for (std::int64_t y = b[1]; y < std::min(s.pieces[1], b[1] + s.width); ++y)
        for (std::int64_t x = b[0]; x < std::min(s.pieces[0], b[0] + s.width); ++x) {
          const std::size_t brick = s.brick(n, x, y, z);
          if (!selected[brick]) continue;
          const std::uint8_t* mask = batch.tested.data() + i * at(side * side) +
                                     at((y - b[1]) * s.cells * side + (x - b[0]) * s.cells);
          bool any = false;
          for (std::int64_t j = 0; j < s.cells && !any; ++j)
            any =
                std::any_of(mask + j * side, mask + j * side + s.cells, [](std::uint8_t f) { return f > 0; });
          if (!any) continue;
          batch.items.push_back({{to_int(x), to_int(y), to_int(z), to_int(static_cast<std::int64_t>(i))}});
          batch.bricks.push_back(static_cast<std::int64_t>(brick));
        }
  }
  return batch;
}

void VerifyField::run_slab(const Shape& s, const std::vector<std::array<std::int64_t, 2>>& blocks,
                           const std::vector<std::uint8_t>& selected,
                           const std::function<void(const Piece&)>& on_piece) {
  const std::int64_t per_block = s.nx * s.nx * s.z_padded,
                     per_item =
                         (s.cells + 1) * (s.cells + 1) * s.error_padded + s.cells * s.cells * (4 + s.words);
  const std::int64_t bytes = 4 * (per_block + nodes_.floats_per_block(s.rate, s.nx, s.z_padded) +
                                  s.width * s.width * s.height * per_item);
  const std::uint64_t budget = std::min<std::uint64_t>(state_.memory.left() / 2, 96 << 20);
  const std::size_t together = at(std::clamp<std::int64_t>(static_cast<std::int64_t>(budget) / bytes, 1,
                                                           static_cast<std::int64_t>(blocks.size())));
  const opencl::DeviceArray<float> values(
      state_, count(static_cast<std::int64_t>(together) * per_block + room), "field to verify against");
  for (std::size_t first = 0; first < blocks.size(); first += together) {
    const auto part = std::span(blocks).subspan(first, std::min(together, blocks.size() - first));
    const Batch batch = make_batch(s, part, selected);
    if (batch.items.empty()) continue;
    std::vector<std::array<std::int64_t, 2>> nodes;
    for (const auto& b : part) nodes.push_back({b[0] * s.cells - halo, b[1] * s.cells - halo});
    nodes_.gold({to_int(s.rate), nodes, s.nx, s.slab_z * s.cells - halo, s.z_padded}, values);
    measure(batch, s, values, on_piece);
    if (nodes_each_ > 0) look(batch, s, values);
  }
}

// Reads a few nodes at one height, so that F in double precision is cheap there.
void VerifyField::look(const Batch& batch, const Shape& s, const opencl::DeviceArray<float>& values) {
  const auto draw = [&](std::int64_t last) {
    return std::uniform_int_distribution<std::int64_t>(0, last)(random_);
  };
  for (std::size_t i = 0; i < batch.items.size(); ++i) {
    if (!looked_at_[at(batch.bricks[i])]) continue;
    const cl_int4 item = batch.items[i], first = batch.first[at(std::int64_t{item.s[3]})];
    Index3 last{};
    for (std::size_t a = 0; a < 3; ++a)
      last[a] = std::min(s.cells, volume_.grid.cells[a] * s.rate - item.s[a] * s.cells);
    const std::int64_t z = draw(last[2]);
    for (std::int64_t n = 0; n < nodes_each_; ++n) {
      const Index3 in{draw(last[0]), draw(last[1]), z};
      Node node;
      Index3 place{};
      for (std::size_t a = 0; a < 3; ++a) {
        node.at[a] = s.begin(volume_.grid, a, item.s[a]) + static_cast<double>(in[a]) * s.h[a];
        place[a] = (item.s[a] - first.s[a]) * s.cells + in[a] + halo;
      }
      if (!covered(node.at)) continue;
      float value = 0;
      values.read(std::span(&value, 1),
                  count(((item.s[3] * s.nx + place[1]) * s.nx + place[0]) * s.z_padded + place[2]));
      node.value = unit_ * static_cast<double>(value);
      node.arithmetic = bounds_of(s, batch.bricks[i]).arithmetic;
      seen_.push_back(node);
    }
  }
}

namespace {

/// Gold nodes of a piece that are corners of a tested cell. bits: 16 cells to a word, [y][x][words].
std::int64_t tested_nodes(const std::uint32_t* bits, std::int64_t cells, std::int64_t words) {
  std::int64_t nodes = 0;
  for (std::int64_t y = 0; y <= cells; ++y)
    for (std::int64_t x = 0; x <= cells; ++x) {
      std::uint32_t carry = 0;  // cell 15 of the word before touches node 0 of this one
      for (std::int64_t w = 0; w < words; ++w) {
        std::uint32_t word = 0;
        for (std::int64_t j = std::max<std::int64_t>(y - 1, 0); j <= std::min(y, cells - 1); ++j)
          for (std::int64_t i = std::max<std::int64_t>(x - 1, 0); i <= std::min(x, cells - 1); ++i)
            word |= bits[(j * cells + i) * words + w];
        nodes += std::popcount((word | word << 1 | carry) & 0xffffu);
        carry = word >> 15;
      }
      nodes += carry;
    }
  return nodes;
}

}  // namespace

// The first and the last layer of cells along z that meet the covered heights, and those that lie in them.
VerifyField::Layers VerifyField::covered_cells(const Shape& s) const {
  const double first_z = s.begin(volume_.grid, 2, s.slab_z);
  Layers l{to_int(s.nz), -1, to_int(s.nz), -1};
  for (int k = 0; k < s.nz - 1 - 2 * halo; ++k) {
    const auto margin = [&](double cells) { return coverage_.margin_z(first_z + (k + cells) * s.h[2]); };
    if (margin(0.5) < -0.5 * s.h[2] * (1 + 1e-9)) continue;
    l.first = std::min(l.first, k);
    l.last = k;
    if (margin(0) < 0 || margin(1) < 0) continue;
    l.in_first = std::min(l.in_first, k);
    l.in_last = k;
  }
  return l;
}

void VerifyField::measure(const Batch& batch, const Shape& s, const opencl::DeviceArray<float>& values,
                          const std::function<void(const Piece&)>& on_piece) {
  const std::int64_t n = static_cast<std::int64_t>(batch.items.size()), side = s.cells + 1;
  const VdvrGrid& grid = stored_.grid;
  const opencl::DeviceArray<cl_int4> items(state_, std::span<const cl_int4>(batch.items), "bricks to verify"),
      first(state_, std::span<const cl_int4>(batch.first), "blocks to verify");
  const opencl::DeviceArray<std::uint8_t> tested(state_, std::span<const std::uint8_t>(batch.tested),
                                                 "columns to verify");
  opencl::DeviceArray<float> error(state_, count(n * side * side * s.error_padded + room), "errors at nodes");
  opencl::DeviceArray<cl_float8> fourth(state_, count(n * side), "fourth differences");
  opencl::DeviceArray<cl_int4> columns(state_, count(n * s.cells * s.cells), "columns of gold cells");
  opencl::DeviceArray<cl_uint> bits(state_, count(n * s.cells * s.cells * s.words), "tested gold cells");
  const Layers layers = covered_cells(s);
  const VdvrPieces pieces{to_int(n),
                          to_int(s.rate),
                          to_int(s.cells),
                          to_int(s.nx),
                          to_int(s.nx),
                          to_int(s.z_padded),
                          to_int(s.error_padded),
                          to_int(s.words),
                          layers.first,
                          layers.last,
                          layers.in_first,
                          layers.in_last,
                          window_ ? 1 : 0,
                          window_ ? std::nextafter(static_cast<float>(window_->first), -INFINITY) : 0.0f,
                          window_ ? std::nextafter(static_cast<float>(window_->second), INFINITY) : 0.0f,
                          s.correction};

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces>
      errors(state_, "verify/verify_field", "verify_errors", stored_.defines);
  errors({{count(side), count(side), count(n)}, {count(side), 1, 1}}, error.buffer(), values.buffer(),
         stored_.samples.buffer(), stored_.bricks.buffer(), grid, items.buffer(), first.buffer(), pieces);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces> fourths(
      state_, "verify/verify_field", "verify_fourth", stored_.defines);
  fourths({{count(side), count(n), 1}, {1, 1, 1}}, fourth.buffer(), values.buffer(), tested.buffer(), grid,
          items.buffer(), first.buffer(), pieces);

  const std::vector<cl_float8> rows = fourth.to_host();
  std::vector<double> constants(at(n));
  std::vector<float> widening(at(n));
  for (std::int64_t i = 0; i < n; ++i) {
    std::array<double, 6> largest{};
    for (std::int64_t y = 0; y < side; ++y)
      for (std::size_t q = 0; q < 6; ++q)
        largest[q] = std::max(largest[q], unit_ * static_cast<double>(rows[at(i * side + y)].s[q]));
    const FieldBounds& bounds = bounds_of(s, batch.bricks[at(i)]);
    constants[at(i)] = brick_constant(bounds, largest) + bounds.arithmetic;
    widening[at(i)] = static_cast<float>(constants[at(i)] / unit_ * (1 + 1e-6));
  }
  const opencl::DeviceArray<float> device_widening(state_, std::span<const float>(widening),
                                                   "constants of pieces");

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer,
                 cl::Buffer, VdvrPieces>
      cells(state_, "verify/verify_field", "verify_cells", stored_.defines);
  cells({{count(s.cells), count(s.cells), count(n)}, {count(s.cells), 1, 1}}, columns.buffer(), bits.buffer(),
        error.buffer(), values.buffer(), tested.buffer(), grid, items.buffer(), first.buffer(),
        device_widening.buffer(), pieces);

  std::vector<Column> host(at(n * s.cells * s.cells));
  {
    const std::vector<cl_int4> raw = columns.to_host();
    static_assert(sizeof(cl_int4) == sizeof(Column));
    std::transform(raw.begin(), raw.end(), host.begin(), [](const cl_int4& c) {
      return Column{std::bit_cast<float>(c.s[0]), std::bit_cast<float>(c.s[1]), c.s[2], 0};
    });
  }
  const std::vector<cl_uint> host_bits = bits.to_host();
  for (std::int64_t i = 0; i < n; ++i) {
    Piece b;
    b.brick = batch.bricks[at(i)];
    b.rate = to_int(s.rate);
    b.arithmetic = bounds_of(s, b.brick).arithmetic;
    const cl_int4 place = batch.items[at(i)];
    for (int a = 0; a < 3; ++a) b.first_cell[at(a)] = place.s[a] % s.per_brick * s.cells;
    b.constant = constants[at(i)];
    b.unit = unit_;
    b.columns = std::span<const Column>(host).subspan(at(i * s.cells * s.cells), at(s.cells * s.cells));
    const std::uint32_t* flags = host_bits.data() + i * s.cells * s.cells * s.words;
    for (std::int64_t w = 0; w < s.cells * s.cells * s.words; ++w) b.cells += std::popcount(flags[w]);
    if (b.cells > 0) b.nodes = tested_nodes(flags, s.cells, s.words);
    float best = -1;
    for (std::int64_t j = 0; j < s.cells * s.cells; ++j) {
      const Column& c = b.columns[at(j)];
      if (c.total < 0) continue;
      b.error = std::max(b.error, unit_ * static_cast<double>(c.error));
      if (c.total <= best) continue;
      best = c.total;
      b.worst_cell = {b.first_cell[0] + j % s.cells, b.first_cell[1] + j / s.cells,
                      b.first_cell[2] + c.worst_z};
    }
    if (best >= 0) b.total = unit_ * static_cast<double>(best) + b.constant;
    on_piece(b);
  }
}

}  // namespace vdvr
