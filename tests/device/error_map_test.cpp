#define BOOST_TEST_MODULE error_map
#include "vdvr/expert/error_map.hpp"

#include <boost/test/unit_test.hpp>
#include <numbers>
#include <random>

#include "tests/reference/wave_error.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;

// Grid of the search: fine enough that the refinement starts on the right hill, which is some tenths wide.
int search_steps(std::size_t axes) { return axes == 1 ? 400 : axes == 2 ? 60 : 24; }
double searched(const std::vector<double>& kappa) {
  return reference::worst_wave_error(kappa, search_steps(kappa.size()));
}
// The last step of the search is 1e-10, at a maximum where the error is flat: what is left is rounding of
// some 20 operations on numbers of up to 2.
const double resolution = tolerance::fp64_sum(40, 2);

// Frequencies of 1, 2 or 3 axes up to Nyquist, every second one crowded towards it.
std::vector<std::vector<double>> random_frequencies(int count, int rate, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<std::vector<double>> all;
  for (int i = 0; i < count; ++i) {
    std::vector<double> kappa(1 + static_cast<std::size_t>(i) % 3);
    for (double& k : kappa) k = pi / rate * std::pow(unit(random), (i / 3) % 2 == 0 ? 1.0 : 0.2);
    all.push_back(kappa);
  }
  return all;
}

double product(const std::vector<double>& kappa) { return 1 - centre_error(kappa); }

// sum_j (2 - kappa_j cot(kappa_j / 2))^2 <= 4 centre_error: the cell's centre is a local maximum of the
// error. That it is then the largest is observed, and proved only from kExactProduct on.
bool centre_is_local_maximum(std::span<const double> kappa) {
  double sum = 0;
  for (const double k : kappa) {
    const double half = std::abs(k) / 2;
    // 2 - kappa cot(kappa / 2) is kappa^2 / 6 + ... at 0, where the quotient loses its digits.
    const double a = half < 1e-3 ? 2 * half * half / 3 : 2 - 2 * half * std::cos(half) / std::sin(half);
    sum += a * a;
  }
  return sum <= 4 * centre_error(kappa);
}

using support::device;

}  // namespace

BOOST_AUTO_TEST_CASE(search_over_positions_agrees_with_search_over_phases) {
  constexpr int phases = 2000, positions = 200;
  for (const double kappa : {0.1, 0.7, 1.5, 2.4, 3.0, pi}) {
    const double by_position = searched({kappa}),
                 by_phase = reference::worst_wave_error_by_phase(kappa, phases, positions);
    // A phase is missed by at most pi / phases, a position not at all: the best one is a node.
    const double missed = by_position * (1 - std::cos(pi / phases));
    BOOST_TEST(by_phase <= by_position + resolution);
    BOOST_TEST(by_phase >= by_position - missed - resolution);
  }
}

BOOST_AUTO_TEST_CASE(largest_errors_are_those_of_the_method) {
  // Four digits are given.
  const double digits = 0.5e-4;
  const std::vector<std::vector<double>> table{
      {1, .2929, .0761, .0192}, {1.0618, .5, .1464, .0381}, {1.0963, .6464, .2114, .0565}};
  for (std::size_t axes = 1; axes <= 3; ++axes)
    for (int level = 0; level < 4; ++level) {
      const std::vector<double> corner(axes, pi / (1 << level));
      const double truth = searched(corner), given = table[axes - 1][static_cast<std::size_t>(level)];
      BOOST_TEST(std::abs(truth - given) <= digits, axes << " axes, rate " << (1 << level) << ": " << truth);
      BOOST_TEST(truth <= wave_error_bound(corner) + resolution);
      if (level > 0 || axes == 1) BOOST_TEST(std::abs(truth - centre_error(corner)) <= resolution);
    }
}

BOOST_AUTO_TEST_CASE(largest_wave_error_is_attained_in_the_corner) {
  const double rounded_up = 1e-4;  // by at most that much: error_map.hpp
  for (int axes = 1; axes <= 3; ++axes) {
    const double truth = searched(std::vector<double>(static_cast<std::size_t>(axes), pi)),
                 bound = largest_wave_error(axes);
    BOOST_TEST(truth <= bound + resolution);
    BOOST_TEST(bound <= tolerance::bound(truth + rounded_up));
  }
  BOOST_CHECK_THROW(static_cast<void>(largest_wave_error(4)), InputError);
}

BOOST_AUTO_TEST_CASE(searched_error_never_exceeds_the_bound) {
  double loosest = 0;
  for (const int rate : {1, 2, 4, 8, 16})
    for (const auto& kappa :
         random_frequencies(rate == 1 ? 600 : 150, rate, 11u + static_cast<unsigned>(rate))) {
      const double truth = searched(kappa), bound = wave_error_bound(kappa);
      BOOST_TEST(truth <= bound + resolution);
      BOOST_TEST(centre_error(kappa) <= truth + resolution);
      loosest = std::max(loosest, bound / truth);
      // The theorem: from this product on the bound is the error.
      if (kappa.size() == 1 || product(kappa) >= kExactProduct)
        BOOST_TEST(std::abs(truth - bound) <= resolution, truth << " at product " << product(kappa));
    }
  BOOST_TEST(loosest >= 1);
  BOOST_TEST_MESSAGE("bound / searched error up to " << loosest);
}

BOOST_AUTO_TEST_CASE(centre_is_the_worst_position_where_it_is_a_local_maximum) {
  double factor = 0;
  int beyond = 0;
  for (const auto& kappa : random_frequencies(900, 1, 5)) {
    const double truth = searched(kappa), e = centre_error(kappa);
    if (centre_is_local_maximum(kappa)) {
      BOOST_TEST(std::abs(truth - e) <= resolution);
    } else {
      ++beyond;
      factor = std::max(factor, truth / e);
      // Observed, not proved: no more than in the outermost corner.
      BOOST_TEST(truth <= e * largest_wave_error(static_cast<int>(kappa.size())) + resolution);
    }
  }
  BOOST_TEST(beyond > 0);
  BOOST_TEST_MESSAGE("beyond the criterion: " << beyond << ", error / error at the centre up to " << factor);
}

BOOST_AUTO_TEST_CASE(centre_is_a_local_maximum_wherever_the_theorem_holds) {
  for (const auto& kappa : random_frequencies(3000, 1, 3))
    if (product(kappa) >= kExactProduct) BOOST_TEST(centre_is_local_maximum(kappa));
  const std::vector<double> zero{0, 0, 0}, nyquist{pi}, corner{pi, pi};
  BOOST_TEST(centre_is_local_maximum(zero));
  BOOST_TEST(!centre_is_local_maximum(corner));
  BOOST_TEST(centre_error(zero) == 0.0);
  BOOST_TEST(wave_error_bound(nyquist) == centre_error(nyquist));
  BOOST_TEST(wave_error_bound(std::vector<double>{0.1, 3.2}) == 2.0);
}

BOOST_AUTO_TEST_CASE(lemma_of_the_phase_holds) {
  // |phi| <= alpha (1 - r) and phi^2 <= 0.8146 ln(r / c) ln(1 / r), on which every bound rests.
  constexpr int steps = 400;
  for (int i = 1; i < steps; ++i)
    for (int j = 1; j < steps; ++j) {
      const double theta = pi / 2 * i / steps, alpha = theta * j / steps;
      const double c = std::cos(theta), r = c / std::cos(alpha);
      const double phi = alpha - theta * std::tan(alpha) / std::tan(theta);
      const double rounding = tolerance::fp64_sum(16, 1);
      BOOST_TEST(phi <= alpha * (1 - r) + rounding);
      BOOST_TEST(phi * phi <= 0.8146 * std::log(r / c) * std::log(1 / r) + rounding);
    }
}

BOOST_AUTO_TEST_CASE(device_map_is_the_closed_form_to_rounding) {
  for (const int rate : {1, 2, 4, 8}) {
    // Odd sizes, beyond one work-group in x; centred and one-sided axes.
    const std::array<FrequencyAxis, 3> axes{FrequencyAxis{-67, 135, pi / 67}, FrequencyAxis{0, 13, pi / 12},
                                            FrequencyAxis{-3, 5, pi / 3}};
    const ErrorMap map = error_map(device(), axes, rate);
    BOOST_REQUIRE(map.centre.size() == 135u * 13u * 5u);
    std::size_t i = 0;
    for (int z = -3; z < 2; ++z)
      for (int y = 0; y < 13; ++y)
        for (int x = -67; x < 68; ++x, ++i) {
          const std::vector<double> kappa{pi / 67 * x / rate, pi / 12 * y / rate, pi / 3 * z / rate};
          const double e = centre_error(kappa);
          // Sine to 4 ulp, squared, and what kappa, sums and products round: 64 u of the value itself.
          BOOST_TEST(std::abs(static_cast<double>(map.centre[i]) - e) <= tolerance::fp32_sum(64, e));
          const double bound = static_cast<double>(map.bound[i]), truth = wave_error_bound(kappa);
          BOOST_TEST(bound >= (product(kappa) >= kExactProduct ? truth : e));
          // At most one entry of the table apart, which the step of the product and the margin cover.
          const double entry = product(kappa) >= kExactProduct ? 0.0 : kExactProduct / 256 * 4;
          BOOST_TEST(bound <= truth + entry + tolerance::fp32_sum(256, truth));
        }
  }
}

BOOST_AUTO_TEST_CASE(map_at_rate_8_is_the_central_eighth_of_the_map_at_rate_1) {
  const FrequencyAxis wide{-64, 129, pi / 64}, narrow{-8, 17, pi / 64}, dense{-8, 17, pi / 8};
  const ErrorMap centre = error_map(device(), {narrow, narrow, FrequencyAxis{}}, 1),
                 fine = error_map(device(), {dense, dense, FrequencyAxis{}}, 8),
                 whole = error_map(device(), {wide, wide, FrequencyAxis{}}, 1);
  BOOST_TEST(fine.bound == centre.bound, boost::test_tools::per_element());
  BOOST_TEST(whole.bound[64 * 129 + 64 + 3] == fine.bound[8 * 17 + 8 + 3]);
}

BOOST_AUTO_TEST_CASE(frequencies_beyond_nyquist_are_refused) {
  BOOST_CHECK_THROW(error_map(device(), {FrequencyAxis{0, 11, pi / 9}, {}, {}}, 1), InputError);
  BOOST_CHECK_THROW(error_map(device(), {FrequencyAxis{0, 0, 0}, {}, {}}, 1), InputError);
  BOOST_CHECK_THROW(error_map(device(), {FrequencyAxis{0, 3, 1}, {}, {}}, 0), InputError);
}
