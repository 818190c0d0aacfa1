// Launcher of kernels/certify/kept/fourth_differences.cl.
#include "host/certify/kept/brick_remainder.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <numbers>
#include <stdexcept>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/base/system/outward.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/volume/bricks.hpp"
#include "shared/fourth_differences.h"

namespace vdvr {

static_assert(sizeof(VdvrFourthDifferences) == 44);

namespace {

using std::numbers::pi;
// Bricks of a block's side; across more where there are few along z, since small launches cost more than they
// compute. Of cone beam half as many across: nodes of all that a block reads are kept, and they cost more.
constexpr std::int64_t block_bricks = 8, most_block_bricks = 16, cone_block_bricks = 4;
// Nodes that a fourth difference reads on either side.
constexpr std::int64_t difference_reach = 2;
// fp32: up to nine terms with weights that add to 16, in units of u times the largest value.
constexpr double difference_rounding = 64;

// Room for eight lanes that begin at the last node of the last brick.
std::int64_t stride_of(const GoldBox& box) { return column_stride(box.nodes[2] + 8); }

}  // namespace

BrickRemainder::BrickRemainder(opencl::State& state, KeptGold& kept, const FilteredScan& scan,
                               const FieldSups& sups, const Grid& grid, int granularity, int differences)
    : state_(state),
      kept_(kept),
      scan_(scan),
      sups_(sups),
      coverage_(scan.geometry, scan.views),
      grid_(grid),
      granularity_(granularity) {
  nodes_.phases = phases(differences);
  for (std::size_t a = 0; a < 3; ++a) rates_[a] = kept.rates()[a] * nodes_.phases[a];
  bricks_ = Bricks(grid, granularity).along();
  slack_ = kept.fourth_errors(nodes_);
  for (double& slack : slack_) slack += difference_rounding * unit_roundoff * kept.sup();
  if (scan.views.empty()) set_parallel(scan, sups);
  else set_cone();
  Vec3 spacing{};
  for (std::size_t a = 0; a < 3; ++a) {
    spacing[a] = grid.spacing[a] / static_cast<double>(rates_[a]);
    const std::int64_t side = granularity * rates_[a];
    rings_[a] = (stencil_[a] + side - 1) / side;
  }
  const Index3 all{bricks_[0] + 2 * rings_[0], bricks_[1] + 2 * rings_[1], bricks_[2] + 2 * rings_[2]};
  maxima_.resize(at(all[0] * all[1] * all[2]));
  looked_at_.resize(maxima_.size());
  // Columns that a stencil of a tested cell reads: the cell meets the covered region.
  constexpr double cell = 0.5;  // of gold at 2x
  lowest_ = -(cell * std::hypot(grid.spacing[0], grid.spacing[1]) +
              static_cast<double>(stencil_[0]) * std::hypot(spacing[0], spacing[1])) *
            (1 + 1e-6);
  lowest_z_ = -(cell * grid.spacing[2] + static_cast<double>(stencil_[2]) * spacing[2]) * (1 + 1e-6);
  if (scan.views.empty()) return;
  sixth_.resize(at(bricks_[0] * bricks_[1] * bricks_[2]));
  has_sixth_.resize(sixth_.size());
  const double read = static_cast<double>(difference_reach) * std::hypot(spacing[0], spacing[1]) - lowest_,
               read_z = static_cast<double>(difference_reach) * spacing[2] - lowest_z_;
  if (read > kept.claimed()[0] || read_z > kept.claimed()[2])
    throw std::logic_error("BrickRemainder: reads gold beyond its bounds");
  read_.emplace(coverage_, read);
  read_z_ = {coverage_.heights().first - read_z, coverage_.heights().second + read_z};
}

// Of parallel beam a quarter of a pixel apart at most: of nodes half a pixel apart the norms are three times
// as large. But differences are a sixteenth, and what nodes err by is not: with more than six taps leave,
// half a pixel.
std::array<int, 3> BrickRemainder::phases(int differences) const {
  if (scan_.views.empty()) {
    const int of_all = kept_.interpolation() == Interpolation::six_taps ? 2 : 1;
    return {of_all, of_all, of_all};
  }
  std::array<int, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t kept = kept_.rates()[a];
    const int dense = kept > 2 ? 2 : 4;
    // Of one kept node a cell, stencils of sparse ones would reach farther than bounds do.
    out[a] = differences == sparse_differences && kept > 1 ? dense / 2 : dense;
  }
  return out;
}

void BrickRemainder::set_parallel(const FilteredScan& scan, const FieldSups& sups) {
  const ParallelGeometry& g = scan.geometry;
  std::array<RemainderNorms, 3> norms;
  for (std::size_t a = 0; a < 3; ++a) {
    const double spacing = grid_.spacing[a] / static_cast<double>(rates_[a]),
                 pitch = a == 2 ? g.pitch_v : g.pitch_u;
    norms[a] = a == 1 && grid_.spacing[1] == grid_.spacing[0] && rates_[1] == rates_[0]
                   ? norms[0]
                   : remainder_norms(std::min(pi / 2, pi * spacing / pitch));
    // The stencil of a point one step of gold outside the brick.
    stencil_[a] = norms[a].taps / 2 + step_of_gold(a);
  }
  const std::array<std::array<std::size_t, 3>, 6> axes{
      {{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {0, 1, 2}, {0, 2, 1}, {1, 2, 0}}};
  for (std::size_t d = 0; d < 6; ++d) {
    const auto& [i, j, k] = axes[d];
    const double factor = d < 3 ? pure_factor(norms[i], norms[j], norms[k])
                                : mixed_factor(norms[i], norms[j], norms[k]),
                 tail = d < 3 ? pure_tail(norms[i], norms[j], norms[k])
                              : mixed_tail(norms[i], norms[j], norms[k]);
    factor_[d] = round_up(factor);
    addend_[d] = round_up(factor * slack_[d] + tail * sups.value);
  }
}

// F has no band limit, but bounds of its sixth derivatives: a fourth derivative anywhere in a cell of nodes
// is at most the largest at the cell's corners and what second derivatives of it allow between them; at a
// corner a fourth difference errs by a sixth derivative (docs/error-bounds.md, section 16).
void BrickRemainder::set_cone() {
  for (std::size_t a = 0; a < 3; ++a) stencil_[a] = 1 + step_of_gold(a);
  factor_.fill(1);
  std::transform(slack_.begin(), slack_.end(), addend_.begin(), [](double slack) { return round_up(slack); });
}

// What sixth derivatives add to X on some bricks and a stencil around them; those of the differences' own
// stencils count.
BrickRemainder::Maxima BrickRemainder::addends_of(const Index3& first, const Index3& bricks) const {
  Vec3 low{}, high{}, square{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double node = grid_.spacing[a] / static_cast<double>(rates_[a]),
                 around = static_cast<double>(stencil_[a] + difference_reach) * node,
                 side = static_cast<double>(granularity_) * grid_.spacing[a];
    low[a] = grid_.origin[a] + static_cast<double>(first[a]) * side - around;
    high[a] = grid_.origin[a] + static_cast<double>(first[a] + bricks[a]) * side + around;
    square[a] = node * node;
  }
  low[2] = std::max(low[2], read_z_.first);
  high[2] = std::min(high[2], read_z_.second);
  const Corners part = read_->part(low, high);
  if (part.empty()) return {};
  const SixthSups sixth = sixth_sups(scan_.views, sups_.by_view, part);
  // h_i^2 h_j^2 h_k^2 |F_iijjkk|, at least.
  const auto sup = [&](std::size_t i, std::size_t j, std::size_t k) {
    return square[i] * square[j] * square[k] *
           sixth.along(static_cast<int>(i), static_cast<int>(j), static_cast<int>(k));
  };
  constexpr std::array<std::array<std::size_t, 2>, 6> axes{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  Maxima out{};
  for (std::size_t d = 0; d < 6; ++d) {
    const auto& [i, j] = axes[d];
    const double at_corner = i == j ? sup(i, i, i) / 6 : (sup(i, i, j) + sup(i, j, j)) / 12,
                 between = (sup(i, j, 0) + sup(i, j, 1) + sup(i, j, 2)) / 8;
    out[d] = round_up(at_corner + between);
  }
  return out;
}

// Neighbours share theirs, since a sum over all views takes up to milliseconds: but no more of them than a
// twenty-fourth of the region, where lambda differs by little.
void BrickRemainder::add_sixth(const std::vector<std::uint8_t>& selected) {
  const std::int64_t group =
      std::clamp<std::int64_t>(*std::max_element(bricks_.begin(), bricks_.end()) / 24, 1, 4);
  const Bricks bricks(grid_, granularity_);
  std::set<Index3> firsts;
  for (std::int64_t brick = 0; brick < bricks.size(); ++brick) {
    if (!selected[at(brick)] || has_sixth_[at(brick)]) continue;
    const Index3 p = bricks.position(brick);
    firsts.insert({p[0] / group * group, p[1] / group * group, p[2] / group * group});
  }
  const std::vector<Index3> groups(firsts.begin(), firsts.end());
  parallel_for(static_cast<std::int64_t>(groups.size()), {}, "", [&](std::int64_t n) {
    const Index3& first = groups[at(n)];
    Index3 size{};
    for (std::size_t a = 0; a < 3; ++a) size[a] = std::min(group, bricks_[a] - first[a]);
    const Maxima of_group = addends_of(first, size);
    for (std::int64_t z = first[2]; z < first[2] + size[2]; ++z)
      for (std::int64_t y = first[1]; y < first[1] + size[1]; ++y)
        for (std::int64_t x = first[0]; x < first[0] + size[0]; ++x) {
          const std::size_t i = at((z * bricks_[1] + y) * bricks_[0] + x);
          sixth_[i] = of_group;
          has_sixth_[i] = 1;
        }
  });
}

std::size_t BrickRemainder::slot(const Index3& p) const {
  return at(((p[2] + rings_[2]) * (bricks_[1] + 2 * rings_[1]) + p[1] + rings_[1]) *
                (bricks_[0] + 2 * rings_[0]) +
            p[0] + rings_[0]);
}

void BrickRemainder::require(const std::vector<std::uint8_t>& selected, const Progress& progress) {
  if (!scan_.views.empty()) add_sixth(selected);
  look_at(open(selected), progress);
}

std::vector<GoldBox> BrickRemainder::boxes(std::span<const Block> blocks) const {
  std::vector<GoldBox> out;
  for (const Block& block : blocks) out.push_back(box_of(block.first, block.bricks));
  return out;
}

void BrickRemainder::will_require(const std::vector<std::uint8_t>& selected) {
  kept_.will_read(nodes_, boxes(open(selected)));
}

// Some blocks are launched one after another before the first is asked for: a CPU waits for no answer, and a
// card does not run dry.
void BrickRemainder::look_at(std::span<const Block> blocks, const Progress& progress) {
  constexpr std::size_t together = 8;
  kept_.prepare(nodes_, boxes(blocks), progress);
  std::uint64_t room = 0;
  for (const GoldBox& box : boxes(blocks)) room = std::max(room, room_for(box));
  opencl::DeviceArray<float> gold(state_, room, "gold of bricks");
  gold.fill(0.0f);  // what is not written does not count, but must be finite
  for (std::size_t first = 0; first < blocks.size(); first += together) {
    const auto some = blocks.subspan(first, std::min(together, blocks.size() - first));
    std::vector<opencl::DeviceArray<float>> found;
    for (const Block& block : some) found.push_back(launch(block, gold));
    for (std::size_t i = 0; i < some.size(); ++i) take(some[i], found[i].to_host());
    report(progress, "remainder",
           static_cast<double>(first + some.size()) / static_cast<double>(blocks.size()));
  }
}

template <class Visit>
void BrickRemainder::for_each_block(Visit&& visit) const {
  Block block;
  Index3& first = block.first;
  const std::int64_t layers = std::min(block_bricks, bricks_[2] + 2 * rings_[2]);
  std::int64_t across = scan_.views.empty() ? block_bricks : cone_block_bricks;
  while (scan_.views.empty() && across < most_block_bricks &&
         (across + 1) * (across + 1) * layers <= block_bricks * block_bricks * block_bricks)
    ++across;
  const Index3 side{across, across, block_bricks};
  for (first[2] = -rings_[2]; first[2] < bricks_[2] + rings_[2]; first[2] += side[2])
    for (first[1] = -rings_[1]; first[1] < bricks_[1] + rings_[1]; first[1] += side[1])
      for (first[0] = -rings_[0]; first[0] < bricks_[0] + rings_[0]; first[0] += side[0]) {
        for (std::size_t a = 0; a < 3; ++a)
          block.bricks[a] = std::min(side[a], bricks_[a] + rings_[a] - first[a]);
        visit(block);
      }
}

template <class Visit>
void BrickRemainder::for_each_slot(const Block& block, Visit&& visit) const {
  const Index3 &f = block.first, &n = block.bricks;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) visit(slot({f[0] + x, f[1] + y, f[2] + z}), Index3{x, y, z});
}

std::vector<BrickRemainder::Block> BrickRemainder::open(const std::vector<std::uint8_t>& selected) const {
  const Bricks bricks(grid_, granularity_);
  std::vector<std::uint8_t> wanted(maxima_.size(), 0);
  for (std::int64_t brick = 0; brick < bricks.size(); ++brick) {
    if (!selected[at(brick)]) continue;
    const Index3 p = bricks.position(brick);
    for (std::int64_t z = p[2] - rings_[2]; z <= p[2] + rings_[2]; ++z)
      for (std::int64_t y = p[1] - rings_[1]; y <= p[1] + rings_[1]; ++y)
        for (std::int64_t x = p[0] - rings_[0]; x <= p[0] + rings_[0]; ++x) wanted[slot({x, y, z})] = 1;
  }
  std::vector<Block> out;
  for_each_block([&](const Block& block) {
    // As much of it as holds them: a sample of the bricks can lie in all blocks and fill none.
    Index3 low = block.bricks, high{};
    for_each_slot(block, [&](std::size_t i, const Index3& p) {
      if (!wanted[i] || looked_at_[i]) return;
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], p[a]);
        high[a] = std::max(high[a], p[a] + 1);
      }
    });
    if (high[0] == 0) return;
    Block part;
    for (std::size_t a = 0; a < 3; ++a) {
      part.first[a] = block.first[a] + low[a];
      part.bricks[a] = high[a] - low[a];
    }
    out.push_back(part);
  });
  return out;
}

// Whole blocks, and the bricks of others.
std::vector<BrickRemainder::Block> BrickRemainder::known() const {
  std::vector<Block> out;
  for_each_block([&](const Block& block) {
    std::vector<Block> bricks;
    for_each_slot(block, [&](std::size_t i, const Index3& p) {
      if (looked_at_[i])
        bricks.push_back({{block.first[0] + p[0], block.first[1] + p[1], block.first[2] + p[2]}, {1, 1, 1}});
    });
    if (std::ssize(bricks) == block.bricks[0] * block.bricks[1] * block.bricks[2]) out.push_back(block);
    else out.insert(out.end(), bricks.begin(), bricks.end());
  });
  return out;
}

std::vector<float> BrickRemainder::found(const Block& block) const {
  std::vector<float> out;
  for_each_slot(block, [&](std::size_t i, const Index3&) {
    out.insert(out.end(), maxima_[i].begin(), maxima_[i].end());
  });
  return out;
}

void BrickRemainder::take(const Block& block, std::span<const float> found) {
  const auto bricks = at(block.bricks[0] * block.bricks[1] * block.bricks[2]);
  if (found.size() != 6 * bricks) throw std::logic_error("BrickRemainder: not six numbers a brick");
  for_each_slot(block, [&](std::size_t i, const Index3&) {
    std::copy_n(found.begin(), 6, maxima_[i].begin());
    found = found.subspan(6);
    looked_at_[i] = 1;
  });
}

GoldBox BrickRemainder::box_of(const Index3& first, const Index3& bricks) const {
  GoldBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t side = granularity_ * rates_[a];
    box.first[a] = first[a] * side - difference_reach;
    box.nodes[a] = bricks[a] * side + 1 + 2 * difference_reach;
  }
  return box;
}

// Of the box' heights, two before the bricks not counted, the first and last that a tested cell's stencil
// reads: of cone beam others are not kept.
std::pair<int, int> BrickRemainder::heights_read(const GoldBox& box) const {
  const std::int64_t last = box.nodes[2] - 1 - 2 * difference_reach;
  if (scan_.views.empty()) return {0, to_int(last)};
  std::pair<int, int> read{to_int(last + 1), -1};
  for (std::int64_t k = 0; k <= last; ++k) {
    const double z = grid_.origin[2] + static_cast<double>(box.first[2] + difference_reach + k) *
                                           grid_.spacing[2] / static_cast<double>(rates_[2]);
    if (coverage_.margin_z(z) < lowest_z_) continue;
    read.first = std::min(read.first, to_int(k));
    read.second = to_int(k);
  }
  return read;
}

std::uint64_t BrickRemainder::room_for(const GoldBox& box) {
  return count(box.nodes[0] * box.nodes[1] * stride_of(box));
}

// Enqueues; what is found are six numbers a brick. `gold` may be another block's afterwards.
opencl::DeviceArray<float> BrickRemainder::launch(const Block& block, opencl::DeviceArray<float>& gold) {
  const auto& [first, bricks] = block;
  const GoldBox box = box_of(first, bricks);
  const std::int64_t stride = stride_of(box);
  kept_.fill(nodes_, box, gold, 0, stride);
  std::vector<float> margins(at(box.nodes[0] * box.nodes[1]));
  const auto place = [&](std::int64_t node, std::size_t a) {
    return grid_.origin[a] +
           static_cast<double>(box.first[a] + node) * grid_.spacing[a] / static_cast<double>(rates_[a]);
  };
  parallel_for(box.nodes[1], {}, "", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < box.nodes[0]; ++x)
      margins[at(y * box.nodes[0] + x)] =
          static_cast<float>(coverage_.margin_above(place(x, 0), place(y, 1), 2 * lowest_));
  });
  const auto margin = opencl::copied<float>(state_, margins, "coverage margins");
  opencl::DeviceArray<float> out(state_, count(bricks[0] * bricks[1] * bricks[2] * 6), "fourth differences");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrFourthDifferences, cl::LocalSpaceArg> kernel(
      state_, "certify/kept/fourth_differences", "fourth_differences",
      opencl::height_defines(state_.info, 8));
  const auto side = [&](std::size_t a) { return to_int(granularity_ * rates_[a]); };
  const auto [first_z, last_z] = heights_read(box);
  kernel(opencl::shared_groups(state_.info, {count(bricks[0]), count(bricks[1]), count(bricks[2])}),
         out.buffer(), gold.buffer(), margin.buffer(),
         VdvrFourthDifferences{to_int(bricks[0]), to_int(bricks[1]), to_int(bricks[2]), side(0), side(1),
                               side(2), to_int(box.nodes[0]), to_int(stride), first_z, last_z,
                               static_cast<float>(lowest_)},
         opencl::shared_room(state_.info));
  return out;
}

float BrickRemainder::of(std::int64_t brick, const GoldLattice& lattice) const {
  const Index3 p = Bricks(grid_, granularity_).position(brick);
  Maxima largest{};
  for (std::int64_t z = p[2] - rings_[2]; z <= p[2] + rings_[2]; ++z)
    for (std::int64_t y = p[1] - rings_[1]; y <= p[1] + rings_[1]; ++y)
      for (std::int64_t x = p[0] - rings_[0]; x <= p[0] + rings_[0]; ++x)
        for (std::size_t d = 0; d < 6; ++d) largest[d] = std::max(largest[d], maxima_[slot({x, y, z})][d]);
  return round_up(sum_of(lattice, [&](std::size_t d) {
    return static_cast<double>(factor_[d]) * static_cast<double>(largest[d]) +
           static_cast<double>(addend_[d]) +
           (sixth_.empty() ? 0.0 : static_cast<double>(sixth_[at(brick)][d]));
  }));
}

double BrickRemainder::largest_of_sixth(const GoldLattice& lattice) {
  const Bricks bricks(grid_, granularity_);
  const auto layer_at = [&](double z) {
    const double layer = (z - grid_.origin[2]) / (static_cast<double>(granularity_) * grid_.spacing[2]);
    return static_cast<std::int64_t>(std::clamp(layer, 0.0, static_cast<double>(bricks_[2] - 1)));
  };
  const std::int64_t low = layer_at(coverage_.heights().first), high = layer_at(coverage_.heights().second);
  std::vector<std::uint8_t> selected(at(bricks.size()), 0);
  for (const std::int64_t z : {low, (low + high) / 2, high})
    for (std::int64_t y = 0; y < bricks_[1]; ++y)
      for (std::int64_t x = 0; x < bricks_[0]; ++x) selected[at(bricks.number({x, y, z}))] = 1;
  add_sixth(selected);
  double largest = 0;
  for (const Maxima& sixth : sixth_)  // 0 where nobody has looked
    largest =
        std::max(largest, sum_of(lattice, [&](std::size_t d) { return static_cast<double>(sixth[d]); }));
  return largest;
}

// Of X_ij = sup(d) with nodes' spacings.
template <class Sup>
double BrickRemainder::sum_of(const GoldLattice& lattice, Sup&& sup) const {
  std::array<double, 3> square{};  // of gold's spacing over that of the nodes
  for (std::size_t a = 0; a < 3; ++a)
    square[a] = std::pow(static_cast<double>(lattice.step[a]) * nodes_.phases[a] / lattice.phases[a], 2);
  const double pure = square[0] * square[0] * sup(0) + square[1] * square[1] * sup(1) +
                      square[2] * square[2] * sup(2),
               mixed = square[0] * square[1] * sup(3) + square[0] * square[2] * sup(4) +
                       square[1] * square[2] * sup(5);
  return 0.125 * (5.0 / 24 * pure + 2.0 / 8 * mixed);
}

}  // namespace vdvr
