// BaseFit and TileFit against the fit written down once in double precision, node by node.
#define BOOST_TEST_MODULE fit_coefficients
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "host/base/opencl/state.hpp"
#include "host/certify/gold/fit_base.hpp"
#include "host/certify/gold/fit_tiles.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using support::device;

namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

constexpr std::int64_t halo = 16;
constexpr float curvature = 0.0625f;

// Two blocks of 33 x 33 x 129 nodes: waves of other frequencies along every axis, of amplitude 1 in all.
struct Blocks {
  Blocks() {
    shape.count = 2;
    shape.nx = 33;
    shape.ny = 33;
    shape.nz = 129;
    shape.halo = halo;
    shape.gold_stride = (shape.nz + 2 * halo + 15) / 16 * 16;
    shape.z_first = -halo;
    shape.z_last = shape.nz - 1 + halo;
    gold.assign(at(shape.count * deep() * wide() * shape.gold_stride), 0);
    for (std::int64_t b = 0; b < shape.count; ++b)
      for (std::int64_t y = -halo; y < shape.ny + halo; ++y)
        for (std::int64_t x = -halo; x < shape.nx + halo; ++x)
          for (std::int64_t z = -halo; z < shape.nz + halo; ++z)
            gold[index(b, {x, y, z})] = static_cast<float>(wave(b, x, y, z));
    margins.assign(at(shape.count * deep() * wide()), 1.0f);
  }
  [[nodiscard]] std::int64_t wide() const { return shape.nx + 2 * halo; }
  [[nodiscard]] std::int64_t deep() const { return shape.ny + 2 * halo; }
  [[nodiscard]] float& margin(std::int64_t b, std::int64_t x, std::int64_t y) {
    return margins[at((b * deep() + y + halo) * wide() + x + halo)];
  }
  // A rim of columns and of heights that are not tested.
  void cut() {
    for (std::int64_t b = 0; b < shape.count; ++b)
      for (std::int64_t y = -halo; y < shape.ny + halo; ++y)
        for (std::int64_t x = -halo; x < shape.nx + halo; ++x)
          if (2 * x + y < 9) margin(b, x, y) = -1.0f;
    shape.z_first = 35;
    shape.z_last = 58;
  }
  [[nodiscard]] std::size_t index(std::int64_t b, const Index3& n) const {
    return at(((b * deep() + n[1] + halo) * wide() + n[0] + halo) * shape.gold_stride + n[2] + halo);
  }
  static double wave(std::int64_t b, std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto of = [](double frequency, std::int64_t n) {
      return std::cos(frequency * static_cast<double>(n));
    };
    return 0.4 * of(0.31, x + b) * of(0.17, y) + 0.4 * of(0.23, z) * of(0.11, x) + 0.2 * of(0.37, y + z);
  }

  GoldBlocks shape;
  std::vector<float> gold, margins;
};

// The fit of docs/error-bounds.md, section 13, of samples first .. last of a lattice, which begins at node 0.
class Reference {
 public:
  Reference(const Blocks& blocks, std::int64_t block, const Index3& spacing, const Index3& first,
            const Index3& last, const FitSteps& steps)
      : blocks_(blocks),
        block_(block),
        spacing_(spacing),
        first_(first),
        share_(static_cast<double>(steps.share)) {
    for (std::size_t a = 0; a < 3; ++a) count_[a] = last[a] - first[a] + 1;
    for_each([&](const Index3& i) { samples_.push_back(gold(node(i))); });
    for (int step = 0; step < steps.count; ++step) fit();
  }
  [[nodiscard]] double operator()(const Index3& n) const {
    Index3 i{};
    for (std::size_t a = 0; a < 3; ++a) i[a] = n[a] / spacing_[a] - first_[a];
    return samples_[place(i)];
  }
  [[nodiscard]] double error(const Index3& n) const { return interpolant(n) - gold(n); }

 private:
  template <class Visit>
  void for_each(Visit&& visit) const {
    Index3 i{};
    for (i[2] = 0; i[2] < count_[2]; ++i[2])
      for (i[1] = 0; i[1] < count_[1]; ++i[1])
        for (i[0] = 0; i[0] < count_[0]; ++i[0]) visit(i);
  }
  [[nodiscard]] std::size_t place(const Index3& i) const {
    return at((i[2] * count_[1] + i[1]) * count_[0] + i[0]);
  }
  [[nodiscard]] Index3 node(const Index3& i) const {
    Index3 n{};
    for (std::size_t a = 0; a < 3; ++a) n[a] = (i[a] + first_[a]) * spacing_[a];
    return n;
  }
  [[nodiscard]] double gold(const Index3& n) const {
    return static_cast<double>(blocks_.gold[blocks_.index(block_, n)]);
  }
  // Whether the lattice has cells there, in which the field is tested.
  [[nodiscard]] bool counts(const Index3& n) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (n[a] < first_[a] * spacing_[a] || n[a] > (first_[a] + count_[a] - 1) * spacing_[a]) return false;
    const GoldBlocks& s = blocks_.shape;
    return n[2] >= s.z_first && n[2] <= s.z_last &&
           blocks_.margins[at((block_ * blocks_.deep() + n[1] + halo) * blocks_.wide() + n[0] + halo)] >=
               s.lowest;
  }
  // Gold less `curvature` of its second differences; where the halo ends, gold.
  [[nodiscard]] double target(const Index3& n) const {
    const GoldBlocks& s = blocks_.shape;
    const Index3 nodes{s.nx, s.ny, s.nz};
    double around = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      if (n[a] == -halo || n[a] == nodes[a] - 1 + halo) return gold(n);
      for (const int side : {-1, 1}) {
        Index3 m = n;
        m[a] += side;
        around += gold(m) - gold(n);
      }
    }
    return gold(n) - static_cast<double>(curvature) * around;
  }
  [[nodiscard]] double interpolant(const Index3& n) const {
    Index3 low{};
    std::array<double, 3> t{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t from = n[a] - first_[a] * spacing_[a];
      low[a] = std::min(from / spacing_[a], count_[a] - 2);
      t[a] = static_cast<double>(from - low[a] * spacing_[a]) / static_cast<double>(spacing_[a]);
    }
    double sum = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      Index3 i = low;
      double weight = 1;
      for (std::size_t a = 0; a < 3; ++a) {
        i[a] += static_cast<std::int64_t>(corner >> a & 1);
        weight *= (corner >> a & 1) != 0 ? t[a] : 1 - t[a];
      }
      sum += weight * samples_[place(i)];
    }
    return sum;
  }
  // At the sample and in the middles of the edges, faces and cells around it.
  void fit() {
    std::vector<double> moved = samples_;
    for_each([&](const Index3& i) {
      const Index3 centre = node(i);
      double smallest = INFINITY, largest = -INFINITY;
      for (int middle = 0; middle < 27; ++middle) {
        const Index3 n{centre[0] + (middle % 3 - 1) * (spacing_[0] / 2),
                       centre[1] + (middle / 3 % 3 - 1) * (spacing_[1] / 2),
                       centre[2] + (middle / 9 - 1) * (spacing_[2] / 2)};
        if (!counts(n)) continue;
        const double e = interpolant(n) - target(n);
        smallest = std::min(smallest, e);
        largest = std::max(largest, e);
      }
      if (smallest <= largest) moved[place(i)] -= 0.5 * share_ * (smallest + largest);
    });
    samples_ = std::move(moved);
  }

  const Blocks& blocks_;
  std::int64_t block_;
  Index3 spacing_, first_, count_{};
  double share_;
  std::vector<double> samples_;
};

// Visits the nodes of samples of a box.
template <class Visit>
void for_each_sample(const Index3& first, const Index3& last, const Index3& spacing, Visit&& visit) {
  for (std::int64_t z = first[2]; z <= last[2]; z += spacing[2])
    for (std::int64_t y = first[1]; y <= last[1]; y += spacing[1])
      for (std::int64_t x = first[0]; x <= last[0]; x += spacing[0]) visit(Index3{x, y, z});
}

// A step: eight samples, seven terms of a second difference and one sum, each of magnitude below 2; the next
// begins from its errors.
double rounding(int steps) { return steps * tolerance::fp32_sum(16, 2.0); }

// A brick of 32 nodes a side, of block 1.
constexpr std::int64_t side = 32;

struct OnDevice {
  explicit OnDevice(const Blocks& blocks)
      : gold(device().state(), std::span<const float>(blocks.gold), "gold"),
        margin(device().state(), std::span<const float>(blocks.margins), "margins") {}
  opencl::DeviceArray<float> gold, margin;
};

VdvrGoldShape shape_of(const GoldBlocks& b) {
  VdvrGoldShape s{};
  s.nx = static_cast<int>(b.nx);
  s.ny = static_cast<int>(b.ny);
  s.nz = static_cast<int>(b.nz);
  s.halo = static_cast<int>(b.halo);
  s.gold_stride = static_cast<int>(b.gold_stride);
  s.stride = (s.nz + 31) / 16 * 16;
  s.blocks = static_cast<int>(b.count);
  s.lowest = b.lowest;
  return s;
}

// What F may lie above and below gold by: another number at every node.
struct Slack {
  explicit Slack(const VdvrGoldShape& s) : shape(s) {
    for (std::size_t i = 0; i < at(std::int64_t{s.blocks} * s.ny * s.nx * s.stride); ++i) {
      above.push_back(0.001f * static_cast<float>(i % 7));
      below.push_back(0.001f * static_cast<float>(i % 11));
    }
  }
  [[nodiscard]] double total(double error, std::int64_t block, const Index3& n) const {
    const std::size_t i = at(((block * shape.ny + n[1]) * shape.nx + n[0]) * shape.stride + n[2]);
    return std::max(error + static_cast<double>(below[i]), static_cast<double>(above[i]) - error);
  }
  VdvrGoldShape shape;
  std::vector<float> above, below;
};

// Samples that lie around a brick's own: what steps read, as far as there is gold.
Reference of_tile(const Blocks& blocks, const TileToFit& tile, const FitSteps& steps) {
  const GoldBlocks& s = blocks.shape;
  const Index3 nodes{s.nx, s.ny, s.nz};
  Index3 first{}, last{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t spacing = tile.spacing[a], own = tile.node[a] / spacing,
                       end = std::min(tile.node[a] + side, nodes[a] - 1) / spacing,
                       around = spacing > 1 ? steps.count : 0;
    first[a] = std::max(own - around, -(halo / spacing));
    last[a] = std::min(end + around, (nodes[a] - 1 + halo) / spacing);
  }
  return {blocks, tile.block, tile.spacing, first, last, steps};
}

// The tiles' samples and what their nodes are found to err by, against the reference.
void compare(const Blocks& blocks, const std::vector<TileToFit>& tiles, const FitSteps& fit_steps) {
  const int steps = fit_steps.count;
  opencl::State& state = device().state();
  const OnDevice on(blocks);
  const VdvrGoldShape shape = shape_of(blocks.shape);
  const Slack slack(shape);
  const opencl::DeviceArray<float> above(state, std::span<const float>(slack.above), "above"),
      below(state, std::span<const float>(slack.below), "below");
  TileFit fit(state);
  const auto errors =
      fit({on.gold, on.margin, above, below, shape, blocks.shape.z_first, blocks.shape.z_last}, tiles, side,
          fit_steps, true);
  const std::vector<float> samples = fit.samples().to_host();
  BOOST_TEST_REQUIRE(errors.size() == tiles.size());
  double moved = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const TileToFit& t = tiles[i];
    const Reference reference = of_tile(blocks, t, fit_steps);
    const Index3 end{t.node[0] + side, t.node[1] + side, std::min(t.node[2] + side, blocks.shape.nz - 1)};
    const TileFit::Place place = fit.place(i);
    double worst = 0, total = -1;
    for_each_sample(t.node, end, t.spacing, [&](const Index3& n) {
      std::uint64_t from = place.first;
      for (std::size_t a = 0; a < 3; ++a)
        from += static_cast<std::uint64_t>((n[a] - t.node[a]) / t.spacing[a] * place.step[a]);
      worst = std::max(worst, std::abs(static_cast<double>(samples.at(from)) - reference(n)));
      moved = std::max(moved, std::abs(reference(n) - Blocks::wave(t.block, n[0], n[1], n[2])));
    });
    for_each_sample(t.node, end, {1, 1, 1}, [&](const Index3& n) {
      if (n[0] >= blocks.shape.nx || n[1] >= blocks.shape.ny) return;
      if (blocks.margins[at((t.block * blocks.deep() + n[1] + halo) * blocks.wide() + n[0] + halo)] >= 0)
        total = std::max(total, slack.total(reference.error(n), t.block, n));
    });
    BOOST_TEST(worst <= rounding(std::max(steps, 1)));
    BOOST_TEST(std::abs(static_cast<double>(errors[i]) - total) <= rounding(steps + 1));
  }
  BOOST_TEST((steps == 0 || moved > 100 * rounding(steps)));
}

const std::vector<Index3> spacings{{8, 8, 8}, {4, 8, 2}, {2, 4, 8}, {8, 2, 4}, {2, 2, 2},
                                   {1, 4, 8}, {8, 1, 1}, {4, 4, 1}, {1, 1, 2}, {16, 32, 16}};

}  // namespace

BOOST_AUTO_TEST_CASE(tiles_of_any_level_are_those_of_the_fit_in_double_precision) {
  const Blocks blocks;
  for (const int steps : {0, 1, level_fit_steps}) {
    std::vector<TileToFit> tiles;
    for (const Index3& spacing : spacings) tiles.push_back({1, {0, 0, 32}, spacing});
    for (const float share : {smooth_fit_share, noise_fit_share})
      compare(blocks, tiles, {steps, share, curvature});
  }
}

BOOST_AUTO_TEST_CASE(tiles_at_the_rim_of_what_is_tested_are_fitted_to_the_rest) {
  Blocks blocks;
  blocks.cut();
  std::vector<TileToFit> tiles;
  for (const Index3& spacing : spacings) tiles.push_back({0, {0, 0, 32}, spacing});
  compare(blocks, tiles, {level_fit_steps, smooth_fit_share, curvature});
}

// The grid ends at node 112 of the blocks.
BOOST_AUTO_TEST_CASE(tiles_that_end_with_the_grid_have_the_samples_that_there_are) {
  Blocks blocks;
  blocks.shape.nz = 113;
  blocks.shape.z_last = 112;
  std::vector<TileToFit> tiles;
  for (const Index3& spacing : spacings) tiles.push_back({1, {0, 0, 96}, spacing});
  compare(blocks, tiles, {level_fit_steps, smooth_fit_share, curvature});
}

BOOST_AUTO_TEST_CASE(tiles_that_do_not_fit_together_are_split) {
  const Blocks blocks;
  const OnDevice on(blocks);
  const TestedGold gold{on.gold, on.margin, on.gold, on.gold, shape_of(blocks.shape), 0, 128};
  const std::vector<TileToFit> tiles(5, {1, {0, 0, 32}, {4, 4, 4}});
  BOOST_TEST(TileFit::together(gold, tiles, side, level_fit_steps, 0) == 1U);
  BOOST_TEST(TileFit::together(gold, tiles, side, level_fit_steps, 1 << 30) == 5U);
}

BOOST_AUTO_TEST_CASE(base_samples_after_many_steps_are_those_in_double_precision) {
  Blocks blocks;
  blocks.cut();
  const OnDevice on(blocks);
  constexpr int steps = 7;  // as far as the halo reaches, less one
  const Index3 spacing{2, 2, 2}, first{-halo / 2, -halo / 2, -halo / 2},
      last{(blocks.shape.nx - 1 + halo) / 2, (blocks.shape.ny - 1 + halo) / 2,
           (blocks.shape.nz - 1 + halo) / 2};
  const Reference reference(blocks, 1, spacing, first, last, {steps, fit_share, curvature});
  BaseFit fit(device().state(), blocks.shape);
  const std::vector<NodeBox> boxes{{1, {0, 0, 32}, {8, 8, 64}}, {1, {16, 8, 32}, {24, 24, 64}}};
  const BaseLattice& base = fit(on.gold, on.margin, boxes, steps, curvature);
  const std::vector<float> samples = base.samples.to_host();
  const VdvrLattice& l = base.shape;
  double worst = 0, moved = 0;
  for (const NodeBox& box : boxes)
    for_each_sample(box.first, box.last, spacing, [&](const Index3& n) {
      const float found =
          samples[at(((box.block * l.cy + n[1] / 2 + l.reach_y) * l.cx + n[0] / 2 + l.reach_x) * l.cz +
                     n[2] / 2 + l.reach_z)];
      worst = std::max(worst, std::abs(static_cast<double>(found) - reference(n)));
      moved = std::max(moved, std::abs(reference(n) - Blocks::wave(1, n[0], n[1], n[2])));
    });
  BOOST_TEST(worst <= rounding(steps));
  BOOST_TEST(moved > 100 * worst);
}

BOOST_AUTO_TEST_CASE(base_samples_do_not_depend_on_what_else_is_wanted) {
  const Blocks blocks;
  const OnDevice on(blocks);
  const NodeBox box{1, {8, 8, 32}, {16, 16, 64}};
  BaseFit alone(device().state(), blocks.shape), together(device().state(), blocks.shape);
  constexpr int steps = 3;
  const auto in_box = [&](const BaseLattice& base) {
    const std::vector<float> samples = base.samples.to_host();
    const VdvrLattice& l = base.shape;
    std::vector<float> out;
    for_each_sample(box.first, box.last, {2, 2, 2}, [&](const Index3& n) {
      out.push_back(
          samples[at(((box.block * l.cy + n[1] / 2 + l.reach_y) * l.cx + n[0] / 2 + l.reach_x) * l.cz +
                     n[2] / 2 + l.reach_z)]);
    });
    return out;
  };
  BOOST_TEST(
      in_box(alone(on.gold, on.margin, {box}, steps, curvature)) ==
          in_box(together(on.gold, on.margin, {{0, {0, 0, 0}, {32, 24, 128}}, {1, {0, 0, 0}, {32, 24, 128}}},
                          steps, curvature)),
      boost::test_tools::per_element());
}
