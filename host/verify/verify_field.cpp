// Bounds cell by cell on gold that witness/nodes.cpp makes: part by part, slab by slab. Calls
// verify_parts.cpp and verify_pieces.cpp.
#include "host/verify/verify_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/verify_parts.hpp"
#include "host/volume/result_units.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

std::int64_t up(std::int64_t n, std::int64_t multiple) { return (n + multiple - 1) / multiple * multiple; }

// The stored field times 2^exponent.
DeviceField upload(opencl::State& state, const MixedVolume& volume, int exponent) {
  if (exponent == 0) return {state, volume};
  const HostMemory copy(state, volume.base.bytes(), "the stored field in other units");
  MixedVolume scaled = volume;
  scale(scaled, exponent);
  return {state, scaled};
}

// How far beyond the covered region, across z, a node may lie that is used: corners of tested cells within a
// diagonal of gold, differences two steps on, a polynomial's nodes beyond these.
double furthest_node(const MixedVolume& v, int across) {
  const double diagonal = std::hypot(v.grid.spacing[0], v.grid.spacing[1]);
  return 3.1 * diagonal / std::min(v.rate, across) +
         static_cast<double>(VerifyNodes::Part{}.reach()) * diagonal / across;
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
      sparse_rates_(sparse_node_rates(field, coverage_, volume.grid.spacing)),
      across_(field.views().empty() ? nodes_across(volume.grid, field.geometry()) : rates_of_cone_.across),
      nodes_(field.views().empty()
                 ? VerifyNodes(state, field, volume.grid, unit_, furthest_node(volume, across_))
                 : VerifyNodes(state, field, coverage_, volume.grid, unit_)) {
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
  s.cells = std::min(side, most_piece_cells);
  s.per_brick = side / s.cells;
  for (std::size_t a = 0; a < 3; ++a) s.pieces[a] = (volume_.grid.cells[a] * rate + s.cells - 1) / s.cells;
  // Few bricks are computed one by one, many in blocks with less halo.
  if (many) s.width = s.height = std::max<std::int64_t>(1, most_piece_cells / s.cells);
  s.nx = s.width * s.cells + 1 + 2 * verify_halo;
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
    const double around =
        static_cast<double>(verify_halo) / rate +
        (between_nodes(rate, nodes, part.points).made() ? static_cast<double>(part.reach()) / nodes : 0.0);
    const std::int64_t cells = bricks_to_group(n[a]) * volume_.granularity;
    box.low[a] = grid.origin[a] + (static_cast<double>(p[a] * cells) - around) * grid.spacing[a];
    box.high[a] =
        grid.origin[a] +
        (static_cast<double>(std::min((p[a] + 1) * cells, grid.cells[a])) + around) * grid.spacing[a];
  }
  return box;
}

std::vector<std::int64_t> VerifyField::groups_of(const std::vector<std::uint8_t>& selected) const {
  std::vector<std::int64_t> groups;
  for (std::size_t i = 0; i < selected.size(); ++i)
    if (selected[i]) groups.push_back(group_of(static_cast<std::int64_t>(i)));
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  return groups;
}

std::map<std::int64_t, FieldBounds> VerifyField::bounds_of_groups(
    const Shape& s, const ConeNodeFacts& facts, const std::vector<std::int64_t>& groups) const {
  const ConePath path{nodes_.path(s.nodes, to_int(s.rate)), facts, field_.rounding()};
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
  std::map<std::int64_t, FieldBounds> of_groups;
  for (std::size_t i = 0; i < groups.size(); ++i) of_groups.emplace(groups[i], found[i]);
  return of_groups;
}

// What bounds and tables are made for reaches further out than nodes that are used: by a group of bricks, and
// by a tile or a block.
bool VerifyField::far_from_sources(const VerifyNodes::Part& part) const {
  const Grid& grid = volume_.grid;
  const Index3 n = volume_.bricks();
  Vec3 around{};
  for (std::size_t a = 0; a < 3; ++a) {
    const int nodes = a < 2 ? part.across : part.along;
    around[a] = grid.spacing[a] * (static_cast<double>(bricks_to_group(n[a]) * volume_.granularity) +
                                   static_cast<double>(part.reach() + verify_halo + 24) / nodes);
  }
  const double r = coverage_.inner_radius() + part.furthest + std::hypot(around[0], around[1]);
  const double low = coverage_.heights().first - around[2], high = coverage_.heights().second + around[2];
  return std::all_of(field_.views().begin(), field_.views().end(), [&](const ViewMatrix& m) {
    const double least = m[2][3] + std::min(m[2][2] * low, m[2][2] * high) - r * std::hypot(m[2][0], m[2][1]);
    return least >= 0.1 * m[2][3];
  });
}

bool VerifyField::sparse_nodes_serve(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                                     double worth, double most) const {
  if (field_.views().empty() || sparse_rates_.across >= std::min(rates.front(), across_)) return false;
  const std::vector<std::uint8_t> near = near_coverage(selected);
  const auto nodes = [](const std::vector<Part>& parts) {
    double blocks = 0;
    for (const Part& part : parts)
      blocks += static_cast<double>(std::count(part.nodes.blocks.begin(), part.nodes.blocks.end(), 1));
    return blocks;
  };
  const std::vector<Part> sparse = parts_of(near, rates, Made::sparse);
  if (sparse.empty() || std::any_of(sparse.begin(), sparse.end(), [&](const Part& part) {
        return nodes_.bytes_of(part.nodes) > part_bytes();
      }))
    return false;
  if (nodes(sparse) > worth * nodes(parts_of(near, rates.first(1), Made::dense))) return false;
  const Shape shape = shape_at(rates.front(), true, sparse.front().nodes);
  if (!far_from_sources(shape.nodes)) return false;
  // What places err in blocks so large is known when nodes are made: about so many units on scans that were
  // tried. And some groups show what all err.
  ConeNodeFacts facts;
  facts.place_u = 25 * half_ulp;
  facts.place_v = 40 * half_ulp;
  facts.together = facts.calls = std::llround(std::sqrt(static_cast<double>(field_.views().size())));
  const std::vector<std::int64_t> all = groups_of(near);
  const std::size_t some = std::min<std::size_t>(64, all.size());
  std::vector<std::int64_t> groups;
  for (std::size_t i = 0; i < some; ++i) groups.push_back(all[i * all.size() / some]);
  try {
    const auto bounds = bounds_of_groups(shape, facts, groups);
    return std::all_of(bounds.begin(), bounds.end(),
                       [&](const auto& of) { return of.second.arithmetic <= most; });
  } catch (const InputError&) {  // a box reaches a source's plane
    return false;
  }
}

const FieldBounds& VerifyField::bounds_of(const Shape& s, std::int64_t brick) const {
  return field_.views().empty() ? s.bounds : of_groups_.at(group_of(brick));
}

void VerifyField::run(const std::vector<std::uint8_t>& selected, std::span<const int> rates,
                      const std::function<bool(std::size_t brick, int rate)>& wants,
                      const std::function<void(const Piece&)>& on_piece, const Progress& progress,
                      Made made) {
  for (const int rate : rates)
    if (rate < 1 || (made == Made::dense && rates.size() > 1 && rate % across_ != 0))
      throw InputError(fmt::format("gold of rate {} is not made of {} nodes a cell", rate, across_));
  arithmetic_ = 0;
  const std::vector<Part> parts = parts_of(near_coverage(selected), rates, made);
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
      std::vector<std::uint8_t> unseen = wanted;
      const auto see = [&](const Piece& piece) {
        unseen[at(piece.brick)] = 0;
        on_piece(piece);
      };
      const BoxOfBricks box(volume_.bricks(), wanted);
      if (box.bricks > 0) {
        Shape s = shape_at(rate, 2 * box.bricks > box.size(), part.nodes);
        arithmetic_ = std::max(arithmetic_, s.bounds.arithmetic);
        s.correction = s.bounds.correction;
        if (!field_.views().empty()) {
          of_groups_ = bounds_of_groups(s, nodes_.cone_facts(), groups_of(wanted));
          s.correction = of_groups_.begin()->second.correction;
          for (const auto& [group, bounds] : of_groups_)
            arithmetic_ = std::max(arithmetic_, bounds.arithmetic);
        }
        const std::vector<Slab> slabs = slabs_of(s, wanted);
        for (std::size_t i = 0; i < slabs.size(); ++i) {
          s.slab_z = slabs[i].z;
          const std::int64_t layers = std::min(s.height, s.pieces[2] - s.slab_z);
          s.nz = std::min(layers * s.cells, volume_.grid.cells[2] * s.rate - s.slab_z * s.cells) + 1 +
                 2 * verify_halo;
          s.z_padded = up(s.nz, 16);
          run_slab(s, slabs[i].blocks, wanted, see);
          tick(static_cast<double>(i + 1) / static_cast<double>(slabs.size()));
        }
      }
      // At the rim coarse cells may be tested where no fine one is: that is an answer too.
      for (std::size_t i = 0; i < unseen.size(); ++i)
        if (unseen[i] != 0) on_piece(Piece{.brick = static_cast<std::int64_t>(i), .rate = rate});
      ++done;
    }
  }
  nodes_.release();
}

void VerifyField::run_slab(const Shape& s, const std::vector<std::array<std::int64_t, 2>>& blocks,
                           const std::vector<std::uint8_t>& selected,
                           const std::function<void(const Piece&)>& on_piece) {
  const std::int64_t per_block = s.nx * s.nx * s.z_padded,
                     per_item =
                         (s.cells + 1) * (s.cells + 1) * s.error_padded + s.cells * s.cells * (4 + s.words);
  const std::int64_t bytes =
      4 * (per_block + nodes_.floats_per_block(s.nodes, static_cast<int>(s.rate), s.nx, s.z_padded) +
           s.width * s.width * s.height * per_item);
  const std::uint64_t budget = std::min<std::uint64_t>(state_.memory.left() / 2, 96 << 20);
  const std::size_t together = at(std::clamp<std::int64_t>(static_cast<std::int64_t>(budget) / bytes, 1,
                                                           static_cast<std::int64_t>(blocks.size())));
  const opencl::DeviceArray<float> values(
      state_, count(static_cast<std::int64_t>(together) * per_block + lanes_beyond),
      "field to verify against");
  for (std::size_t first = 0; first < blocks.size(); first += together) {
    const auto part = std::span(blocks).subspan(first, std::min(together, blocks.size() - first));
    const Batch batch = make_batch(s, part, selected);
    if (batch.items.empty()) continue;
    std::vector<std::array<std::int64_t, 2>> nodes;
    for (const auto& b : part) nodes.push_back({b[0] * s.cells - verify_halo, b[1] * s.cells - verify_halo});
    nodes_.gold({to_int(s.rate), nodes, s.nx, s.slab_z * s.cells - verify_halo, s.z_padded}, values);
    measure(batch, s, values, on_piece);
    if (nodes_each_ > 0) look(batch, s, values);
  }
}

}  // namespace vdvr
