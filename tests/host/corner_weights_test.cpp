#define BOOST_TEST_MODULE corner_weights
#include "host/volume/sampler/corner_weights.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "vdvr/expert/probe_sampler.hpp"

using namespace vdvr;

namespace {

std::mt19937& random_bits() {
  static std::mt19937 bits(11);
  return bits;
}

double uniform(double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random_bits());
}

// Weights that err as those of a unit do: sums of 0.
Corners random_off() {
  Corners off{};
  for (std::size_t c = 0; c < 7; ++c) off[7] -= off[c] = uniform(-1, 1);
  return off;
}

// The largest samples that lie below random ones and differ by at most `steps` along each edge.
Corners random_samples(const std::array<double, 3>& steps) {
  const double range = steps[0] + steps[1] + steps[2];
  Corners given{}, samples{};
  for (double& s : given) s = uniform(0, range);
  for (std::size_t c = 0; c < 8; ++c) {
    samples[c] = std::numeric_limits<double>::infinity();
    for (std::size_t from = 0; from < 8; ++from) {
      double away = 0;
      for (std::size_t a = 0; a < 3; ++a) away += ((c ^ from) >> a & 1U) != 0 ? steps[a] : 0.0;
      samples[c] = std::min(samples[c], given[from] + away);
    }
  }
  return samples;
}

double error_of(const Corners& off, const Corners& samples) {
  double error = 0;
  for (std::size_t c = 0; c < 8; ++c) error += off[c] * samples[c];
  return std::abs(error);
}

BySteps bound_of(const Corners& off) {
  BySteps bound{};
  raise_to_error(bound, off);
  return bound;
}

}  // namespace

BOOST_AUTO_TEST_CASE(no_samples_within_the_steps_err_by_more) {
  double closest = 0;
  for (int i = 0; i < 300; ++i) {
    const Corners off = random_off();
    FilterProbe probe;
    probe.by_steps = bound_of(off);
    for (int k = 0; k < 300; ++k) {
      std::array<double, 3> steps{};
      for (double& s : steps) s = k % 3 == 0 ? 1 : uniform(0, 1);
      const double error = error_of(off, random_samples(steps)), bound = probe.of_steps(steps);
      BOOST_REQUIRE(error <= bound * (1 + 1e-12));
      if (k % 3 == 0) closest = std::max(closest, error / bound);
    }
  }
  // And it is not far above what they do.
  BOOST_TEST(closest > 0.95);
}

BOOST_AUTO_TEST_CASE(what_is_moved_along_edges_costs_their_steps) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Corners off{};
    off[0] = -0.25;
    off[std::size_t{1} << axis] = 0.25;  // one weight that errs along one axis
    const BySteps bound = bound_of(off);
    for (std::size_t steps = 1; steps < 8; ++steps)
      BOOST_TEST(bound[steps] == ((steps >> axis & 1U) != 0 ? 0.25 : 0.125));
  }
  Corners across{};
  across[0] = -0.25;
  across[7] = 0.25;  // from a corner to the opposite one
  const BySteps all = bound_of(across);
  for (std::size_t steps = 1; steps < 8; ++steps) BOOST_TEST(all[steps] == 0.25 * sum_of_steps(steps));
  // Four weights that are no products of three fractions: moved along x or along y, whichever steps less.
  Corners product{};
  for (std::size_t c = 0; c < 8; ++c) product[c] = ((c ^ c >> 1) & 1U) != 0 ? -0.25 : 0.25;
  const BySteps either = bound_of(product);
  BOOST_TEST(either[0b011] == 1.0);
  BOOST_TEST(either[0b001] == 0.5);
  BOOST_TEST(either[0b110] == 0.5);
}

BOOST_AUTO_TEST_CASE(what_is_no_number_is_unbounded) {
  Corners off{};
  off[3] = std::numeric_limits<double>::quiet_NaN();
  const BySteps bound = bound_of(off);
  for (std::size_t steps = 1; steps < 8; ++steps) BOOST_TEST(std::isinf(bound[steps]));
}

BOOST_AUTO_TEST_CASE(trilinear_weights_are_those_of_the_corners) {
  const Corners w = trilinear_weights({0.25, 0.5, 1});
  BOOST_TEST(w[0] == 0.0);
  BOOST_TEST(w[0b100] == 0.375);
  BOOST_TEST(w[0b101] == 0.125);
  BOOST_TEST(w[0b111] == 0.125);
}
