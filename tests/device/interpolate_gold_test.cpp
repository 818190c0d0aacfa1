// Gold between kept columns and heights against sums in double precision, within what each is charged for
// rounding.
#define BOOST_TEST_MODULE interpolate_gold
#include "host/certify/kept/interpolate_gold.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

constexpr int taps = 16;
constexpr float untouched = -1e30f;

std::vector<float> random_floats(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<float> out(n);
  for (float& v : out) v = unit(random);
  return out;
}

// Along one axis: gold's lattice over kept columns, and the nodes of it that are wanted.
struct Axis {
  int phases = 1, step = 1;
  std::int64_t skipped = 0, outputs = 1;
  [[nodiscard]] std::int64_t intervals() const { return (outputs + skipped + phases - 1) / phases; }
  [[nodiscard]] std::int64_t kept() const { return (intervals() - 1) * step + taps; }
};

// What an output is of the kept values that it reads, and the sum of their magnitudes.
struct Sum {
  double value = 0, magnitude = 0;
};
template <class At>
Sum filtered(const Axis& axis, std::span<const float> weights, std::int64_t output, const At& at_place) {
  const std::int64_t position = output + axis.skipped, first = position / axis.phases * axis.step,
                     phase = position % axis.phases;
  if (phase == 0) return at_place(first + taps / 2 - 1);
  Sum out;
  for (std::int64_t t = 0; t < taps; ++t) {
    const double w = static_cast<double>(weights[at((phase - 1) * taps + t)]);
    const Sum v = at_place(first + t);
    out.value += w * v.value;
    out.magnitude += std::abs(w) * v.magnitude;
  }
  return out;
}

void compare(const Axis& x, const Axis& y, std::int64_t z, std::int64_t boxes) {
  opencl::State& state = support::device().state();
  const auto weights_x = random_floats(at((x.phases - 1) * taps), 1),
             weights_y = random_floats(at((y.phases - 1) * taps), 2);
  const AcrossWeights wx(state, x.phases, taps, weights_x), wy(state, y.phases, taps, weights_y);
  const std::vector<float> kept = random_floats(at(boxes * y.kept() * x.kept() * z), 3);
  const opencl::DeviceArray<float> in(state, std::span<const float>(kept), "kept");
  VdvrAcross s{};
  s.in_x = count(z);
  s.in_y = count(x.kept() * z);
  s.in_box = count(y.kept() * x.kept() * z);
  s.out_x = count(z);
  s.out_y = count(x.outputs * z);
  s.out_first = 16;
  s.out_box = count(y.outputs * x.outputs * z) + 16;
  s.boxes = to_int(boxes);
  s.z = to_int(z);
  s.kept_x = to_int(x.kept());
  s.intervals_x = to_int(x.intervals());
  s.step_x = x.step;
  s.step_y = y.step;
  s.skipped_x = to_int(x.skipped);
  s.skipped_y = to_int(y.skipped);
  s.outputs_x = to_int(x.outputs);
  s.outputs_y = to_int(y.outputs);
  opencl::DeviceArray<float> out(state, s.out_first + count(boxes) * s.out_box, "gold");
  out.fill(untouched);
  fill_across(state, wx, wy, in, out, s);
  const std::vector<float> found = out.to_host();
  std::int64_t outside = 0, beside = 0;
  for (std::int64_t box = 0; box < boxes; ++box) {
    const std::int64_t first = static_cast<std::int64_t>(s.out_first + count(box) * s.out_box);
    for (std::int64_t i = first - 16; i < first; ++i) beside += found[at(i)] != untouched ? 1 : 0;
    for (std::int64_t ny = 0; ny < y.outputs; ++ny)
      for (std::int64_t nx = 0; nx < x.outputs; ++nx)
        for (const std::int64_t height : {std::int64_t{0}, z / 2 + 1, z - 1}) {
          const Sum expected = filtered(x, weights_x, nx, [&](std::int64_t kx) {
            return filtered(y, weights_y, ny, [&](std::int64_t ky) {
              const double v =
                  static_cast<double>(kept[at(((box * y.kept() + ky) * x.kept() + kx) * z + height)]);
              return Sum{v, std::abs(v)};
            });
          });
          const double v = static_cast<double>(found[at(first + (ny * x.outputs + nx) * z + height)]);
          // Two filters' taps one after the other.
          if (!(std::abs(v - expected.value) <= tolerance::fp32_sum(2 * taps, expected.magnitude))) ++outside;
        }
  }
  BOOST_TEST(outside == 0, outside << " nodes at " << x.phases << " / " << x.step << " along x, " << y.phases
                                   << " / " << y.step << " along y, " << x.outputs << " x " << y.outputs
                                   << " of " << boxes << " boxes");
  BOOST_TEST(beside == 0);
}

}  // namespace

BOOST_AUTO_TEST_CASE(nodes_of_any_lattice_are_products_of_filters) {
  for (const int phases : {1, 2, 4, 8, 16, 32})
    for (const std::int64_t skipped : {std::int64_t{0}, std::int64_t{phases} - 1})
      compare({phases, 1, skipped, 37}, {phases, 1, skipped, 5}, 32, 2);
  compare({2, 1, 1, 1}, {4, 1, 3, 1}, 16, 1);
  compare({8, 1, 3, 20}, {1, 4, 0, 3}, 16, 3);
  compare({1, 2, 0, 9}, {2, 1, 1, 9}, 48, 1);
  compare({1, 16, 0, 5}, {1, 3, 0, 4}, 16, 2);
}

// Of a long row a work-group's local memory holds a part.
BOOST_AUTO_TEST_CASE(rows_of_many_chunks_are_rows_of_one) {
  compare({2, 1, 1, 1301}, {2, 1, 0, 2}, 16, 2);
  compare({4, 1, 3, 2601}, {1, 1, 0, 1}, 16, 1);
  compare({1, 16, 0, 97}, {2, 1, 1, 2}, 16, 1);
  compare({1, 1, 0, 700}, {4, 1, 1, 3}, 16, 1);
  compare({1, 300, 0, 7}, {1, 1, 0, 3}, 16, 1);  // groups become smaller
}

BOOST_AUTO_TEST_CASE(filters_of_different_lengths_are_refused) {
  opencl::State& state = support::device().state();
  const opencl::DeviceArray<float> any(state, 16, "any");
  const AcrossWeights sixteen(state, 1, 16, {}), twelve(state, 1, 12, {});
  BOOST_CHECK_THROW(fill_across(state, sixteen, twelve, any, any, {}), std::logic_error);
}

// With all rows in compensated runs; with a band in two chains or in four, wherever it begins in its group,
// within what its runs would be charged.
BOOST_AUTO_TEST_CASE(heights_are_products_with_all_inputs_or_a_band) {
  opencl::State& state = support::device().state();
  struct Case {
    std::int64_t outputs, inputs, band, phases;
  };
  for (const auto& [outputs, inputs, band, phases] :
       {Case{40, 17, 17, 1}, Case{33, 200, 200, 1}, Case{35, 25, 16, 4}, Case{67, 25, 16, 8},
        Case{133, 82, 16, 2}, Case{20, 35, 16, 1}, Case{1, 1, 1, 1}, Case{35, 29, 20, 4},
        Case{133, 90, 24, 2}, Case{67, 38, 28, 8}, Case{21, 53, 32, 1}}) {
    const bool narrow = band < inputs;
    std::vector<double> matrix(at(outputs * inputs), 0.0);
    const auto weights = random_floats(matrix.size(), 4);
    for (std::int64_t i = 0; i < outputs; ++i)
      for (std::int64_t j = 0; j < band; ++j)
        matrix[at(i * inputs + i / phases * (narrow ? 1 : 0) + j)] =
            static_cast<double>(weights[at(i * inputs + j)]);
    const int chains = narrow ? AlongZ::chains_of(band) : 0;
    const HeightWeights of_heights = height_weights(matrix, outputs, inputs, chains);
    const std::int64_t columns = 11, rows = 3, stride = (inputs + 15) / 16 * 16,
                       padded = 16 * of_heights.groups();
    const std::vector<float> kept = random_floats(at(columns * rows * stride), 5);
    const opencl::DeviceArray<float> in(state, std::span<const float>(kept), "kept"),
        out(state, count(columns * rows * padded), "heights");
    VdvrAlongZ shape{};
    shape.in_x = count(stride);
    shape.in_y = count(columns * stride);
    shape.out_x = count(padded);
    shape.out_y = count(columns * padded);
    const std::vector<VdvrColumns> parts{{0, 0, to_int(columns), to_int(rows)}};
    AlongZ(state, of_heights)(state, in, out, parts, shape);
    const std::vector<float> found = out.to_host();
    // A chain, what the chains add up to, and the weight.
    const double charged = product_error(narrow ? band + 8 : inputs, AlongZ::run) + 2,
                 roundings =
                     narrow ? static_cast<double>((band + chains - 1) / chains + chains / 2 + 1) : charged;
    BOOST_TEST(roundings <= charged);
    const double rounding = unit_roundoff * roundings;
    std::int64_t outside = 0;
    for (std::int64_t c = 0; c < columns * rows; ++c)
      for (std::int64_t i = 0; i < outputs; ++i) {
        double sum = 0, magnitude = 0;
        for (std::int64_t j = 0; j < inputs; ++j) {
          const double term = matrix[at(i * inputs + j)] * static_cast<double>(kept[at(c * stride + j)]);
          sum += term;
          magnitude += std::abs(term);
        }
        if (!(std::abs(static_cast<double>(found[at(c * padded + i)]) - sum) <= rounding * magnitude))
          ++outside;
      }
    BOOST_TEST(outside == 0, outside << " of " << outputs << " heights of " << inputs);
  }
}

}  // namespace vdvr
