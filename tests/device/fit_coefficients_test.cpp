// LatticeFit against the fit written down once in double precision, node by node.
#define BOOST_TEST_MODULE fit_coefficients
#include "host/certify/gold/fit_coefficients.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "host/base/opencl/state.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using support::device;

namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

constexpr std::int64_t halo = 16;
constexpr float curvature = 0.0625f;

// Two blocks of 33 x 25 x 129 nodes: waves of other frequencies along every axis, of amplitude 1 in all.
struct Blocks {
  Blocks() {
    shape.count = 2;
    shape.nx = 33;
    shape.ny = 25;
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

// The fit of docs/error-bounds.md, section 13, of one block's lattice that reaches over the halo.
class Reference {
 public:
  Reference(const Blocks& blocks, std::int64_t block, const Index3& spacing, int steps)
      : blocks_(blocks), block_(block), spacing_(spacing) {
    const GoldBlocks& s = blocks.shape;
    const Index3 nodes{s.nx, s.ny, s.nz};
    for (std::size_t a = 0; a < 3; ++a) {
      reach_[a] = halo / spacing[a];
      count_[a] = (nodes[a] - 1) / spacing[a] + 1 + 2 * reach_[a];
    }
    for_each([&](const Index3& i) { samples_.push_back(gold(node(i))); });
    for (int step = 0; step < steps; ++step) fit();
  }
  [[nodiscard]] double operator()(const Index3& n) const {
    Index3 i{};
    for (std::size_t a = 0; a < 3; ++a) i[a] = n[a] / spacing_[a] + reach_[a];
    return samples_[place(i)];
  }

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
    for (std::size_t a = 0; a < 3; ++a) n[a] = (i[a] - reach_[a]) * spacing_[a];
    return n;
  }
  [[nodiscard]] double gold(const Index3& n) const {
    return static_cast<double>(blocks_.gold[blocks_.index(block_, n)]);
  }
  // Whether the field is tested there.
  [[nodiscard]] bool counts(const Index3& n) const {
    const GoldBlocks& s = blocks_.shape;
    return n[2] >= s.z_first && n[2] <= s.z_last &&
           blocks_.margins[at((block_ * blocks_.deep() + n[1] + halo) * blocks_.wide() + n[0] + halo)] >=
               s.lowest;
  }
  // Gold less `curvature` of its second differences.
  [[nodiscard]] double target(const Index3& n) const {
    double around = 0;
    for (std::size_t a = 0; a < 3; ++a)
      for (const int side : {-1, 1}) {
        Index3 m = n;
        m[a] += side;
        around += gold(m) - gold(n);
      }
    return gold(n) - static_cast<double>(curvature) * around;
  }
  [[nodiscard]] double interpolant(const Index3& n) const {
    Index3 low{};
    std::array<double, 3> t{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t from = n[a] + reach_[a] * spacing_[a];
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
  void fit() {
    std::vector<double> moved = samples_;
    for_each([&](const Index3& i) {
      // What the halo's rim does is nobody's concern: two steps look no further than one spacing and a half.
      for (std::size_t a = 0; a < 3; ++a)
        if (i[a] == 0 || i[a] == count_[a] - 1) return;
      const Index3 centre = node(i);
      double smallest = INFINITY, largest = -INFINITY;
      Index3 n{};
      for (n[2] = centre[2] - spacing_[2] / 2; n[2] <= centre[2] + spacing_[2] / 2; ++n[2])
        for (n[1] = centre[1] - spacing_[1] / 2; n[1] <= centre[1] + spacing_[1] / 2; ++n[1])
          for (n[0] = centre[0] - spacing_[0] / 2; n[0] <= centre[0] + spacing_[0] / 2; ++n[0]) {
            if (!counts(n)) continue;
            const double e = interpolant(n) - target(n);
            smallest = std::min(smallest, e);
            largest = std::max(largest, e);
          }
      if (smallest <= largest) moved[place(i)] -= 0.8 * 0.5 * (smallest + largest);
    });
    samples_ = std::move(moved);
  }

  const Blocks& blocks_;
  std::int64_t block_;
  Index3 spacing_, reach_{}, count_{};
  std::vector<double> samples_;
};

// The lattice's samples at the nodes of a box.
std::vector<float> in_box(const LevelSamples& level, const NodeBox& box) {
  const std::vector<float> samples = level.samples.to_host();
  const VdvrLattice& l = level.shape;
  std::vector<float> out;
  for (std::int64_t z = box.first[2]; z <= box.last[2]; z += l.spacing_z)
    for (std::int64_t y = box.first[1]; y <= box.last[1]; y += l.spacing_y)
      for (std::int64_t x = box.first[0]; x <= box.last[0]; x += l.spacing_x)
        out.push_back(samples[at(
            ((box.block * l.cy + y / l.spacing_y + l.reach_y) * l.cx + x / l.spacing_x + l.reach_x) * l.cz +
            z / l.spacing_z + l.reach_z)]);
  return out;
}

const std::vector<Index3> spacings{{8, 8, 8}, {4, 8, 2}, {2, 4, 8}, {8, 2, 4}, {2, 2, 2}};

}  // namespace

BOOST_AUTO_TEST_CASE(samples_are_those_of_the_fit_in_double_precision) {
  const Blocks blocks;
  opencl::State& state = device().state();
  const opencl::DeviceArray<float> gold(state, std::span<const float>(blocks.gold), "gold"),
      margin(state, std::span<const float>(blocks.margins), "margins");
  LatticeFit fit(state, blocks.shape);
  for (const Index3& spacing : spacings) {
    const NodeBox box{1, {8, 8, 32}, {24, 16, 64}};
    const std::vector<float> found =
        in_box(fit(gold, margin, {box}, spacing, level_fit_steps, curvature), box);
    const Reference reference(blocks, 1, spacing, level_fit_steps);
    double worst = 0, moved = 0;
    std::size_t i = 0;
    for (std::int64_t z = box.first[2]; z <= box.last[2]; z += spacing[2])
      for (std::int64_t y = box.first[1]; y <= box.last[1]; y += spacing[1])
        for (std::int64_t x = box.first[0]; x <= box.last[0]; x += spacing[0]) {
          const double expected = reference({x, y, z});
          worst = std::max(worst, std::abs(static_cast<double>(found[i++]) - expected));
          moved = std::max(moved, std::abs(expected - blocks.wave(1, x, y, z)));
        }
    BOOST_TEST(i == found.size());
    // A step: eight samples, seven terms of a second difference and one sum, each of magnitude below 2; the
    // next begins from its errors.
    BOOST_TEST(worst <= level_fit_steps * tolerance::fp32_sum(16, 2.0));
    BOOST_TEST(moved > 100 * worst);
  }
}

BOOST_AUTO_TEST_CASE(at_twice_the_spacing_many_steps_are_those_in_double_precision) {
  Blocks blocks;
  // A rim of columns and of heights that are not tested runs through the boxes.
  for (std::int64_t b = 0; b < blocks.shape.count; ++b)
    for (std::int64_t y = -halo; y < blocks.shape.ny + halo; ++y)
      for (std::int64_t x = -halo; x < blocks.shape.nx + halo; ++x)
        if (2 * x + y < 9)
          blocks.margins[at((b * blocks.deep() + y + halo) * blocks.wide() + x + halo)] = -1.0f;
  blocks.shape.z_first = 35;
  blocks.shape.z_last = 58;
  opencl::State& state = device().state();
  const opencl::DeviceArray<float> gold(state, std::span<const float>(blocks.gold), "gold"),
      margin(state, std::span<const float>(blocks.margins), "margins");
  constexpr int steps = 7;  // as far as the halo reaches, less one
  const Reference reference(blocks, 1, {2, 2, 2}, steps);
  LatticeFit fit(state, blocks.shape);
  const std::vector<NodeBox> boxes{{1, {0, 0, 32}, {8, 8, 64}}, {1, {16, 8, 32}, {24, 24, 64}}};
  const LevelSamples& level = fit(gold, margin, boxes, {2, 2, 2}, steps, curvature);
  double worst = 0, moved = 0;
  for (const NodeBox& box : boxes) {
    const std::vector<float> found = in_box(level, box);
    std::size_t i = 0;
    for (std::int64_t z = box.first[2]; z <= box.last[2]; z += 2)
      for (std::int64_t y = box.first[1]; y <= box.last[1]; y += 2)
        for (std::int64_t x = box.first[0]; x <= box.last[0]; x += 2) {
          const double expected = reference({x, y, z});
          worst = std::max(worst, std::abs(static_cast<double>(found.at(i++)) - expected));
          moved = std::max(moved, std::abs(expected - blocks.wave(1, x, y, z)));
        }
  }
  BOOST_TEST(worst <= steps * tolerance::fp32_sum(16, 2.0));
  BOOST_TEST(moved > 100 * worst);
}

BOOST_AUTO_TEST_CASE(samples_of_a_box_do_not_depend_on_what_else_is_wanted) {
  const Blocks blocks;
  opencl::State& state = device().state();
  const opencl::DeviceArray<float> gold(state, std::span<const float>(blocks.gold), "gold"),
      margin(state, std::span<const float>(blocks.margins), "margins");
  const std::vector<NodeBox> boxes{{0, {0, 0, 0}, {8, 8, 32}},
                                   {1, {8, 8, 32}, {16, 16, 64}},
                                   {1, {24, 16, 96}, {32, 24, 128}},
                                   {0, {16, 0, 64}, {24, 8, 96}}};
  std::vector<NodeBox> all;
  for (std::int64_t block = 0; block < 2; ++block) all.push_back({block, {0, 0, 0}, {32, 24, 128}});
  LatticeFit alone(state, blocks.shape), together(state, blocks.shape);
  for (const Index3& spacing : spacings) {
    const LevelSamples& whole = together(gold, margin, all, spacing, level_fit_steps, curvature);
    for (const NodeBox& box : boxes)
      BOOST_TEST(
          in_box(alone(gold, margin, {box}, spacing, level_fit_steps, curvature), box) == in_box(whole, box),
          boost::test_tools::per_element());
  }
}

BOOST_AUTO_TEST_CASE(columns_of_more_runs_than_bits_are_fitted_to_their_end) {
  // 40 runs of 16 nodes and the halo: the last bit stands for nine of them.
  Blocks blocks;
  blocks.shape.count = 1;
  blocks.shape.nx = blocks.shape.ny = 9;
  blocks.shape.nz = 641;
  blocks.shape.gold_stride = (641 + 2 * halo + 15) / 16 * 16;
  blocks.shape.z_last = 640 + halo;
  blocks.gold.assign(at(blocks.deep() * blocks.wide() * blocks.shape.gold_stride), 0);
  for (std::int64_t y = -halo; y < 9 + halo; ++y)
    for (std::int64_t x = -halo; x < 9 + halo; ++x)
      for (std::int64_t z = -halo; z < 641 + halo; ++z)
        blocks.gold[blocks.index(0, {x, y, z})] = static_cast<float>(Blocks::wave(0, x, y, z));
  blocks.margins.assign(at(blocks.deep() * blocks.wide()), 1.0f);
  opencl::State& state = device().state();
  const opencl::DeviceArray<float> gold(state, std::span<const float>(blocks.gold), "gold"),
      margin(state, std::span<const float>(blocks.margins), "margins");
  LatticeFit alone(state, blocks.shape), together(state, blocks.shape);
  const NodeBox end{0, {0, 0, 608}, {8, 8, 640}}, whole{0, {0, 0, 0}, {8, 8, 640}};
  const auto of_all = in_box(together(gold, margin, {whole}, {4, 4, 8}, level_fit_steps, curvature), end);
  BOOST_TEST(in_box(alone(gold, margin, {end}, {4, 4, 8}, level_fit_steps, curvature), end) == of_all,
             boost::test_tools::per_element());
  const Reference reference(blocks, 0, {4, 4, 8}, level_fit_steps);
  BOOST_TEST(std::abs(static_cast<double>(of_all.back()) - reference({8, 8, 640})) <=
             level_fit_steps * tolerance::fp32_sum(16, 2.0));
}
