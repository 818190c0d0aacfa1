// Filters between nodes: what they promise is never exceeded by waves, flat functions and sign patterns, and
// is not far above what these reach.
#define BOOST_TEST_MODULE gold_filters
#include "host/certify/kept/gold_filters.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "host/certify/bounds/node_functional.hpp"
#include "tests/support/band_attack.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::array bands{0.01, 0.3, 1.11, pi / 2};

std::vector<double> taps_of(const GoldFilter& filter, int phase) {
  const auto first = filter.weights.begin() + static_cast<std::ptrdiff_t>(phase) * filter.taps;
  return {first, first + filter.taps};
}

double first_of(const GoldFilter& filter, int phase) {
  return filter.first() - static_cast<double>(phase) / filter.rate;
}

// A function of the nodes (any values), on the finer lattice: place / rate, counted from node 0.
template <typename Of>
double interpolant(const GoldFilter& filter, int place, const Of& node) {
  const int cell = place >= 0 ? place / filter.rate : -((filter.rate - 1 - place) / filter.rate);
  const std::vector<double> h = taps_of(filter, place - cell * filter.rate);
  double sum = 0;
  for (int i = 0; i < filter.taps; ++i)
    sum += h[static_cast<std::size_t>(i)] * node(cell + filter.first() + i);
  return sum;
}

// At least the error of the wave kappa, of its amplitude, at any phase; |kappa| <= filter.band.
double gold_filter_error(const GoldFilter& filter, double kappa) {
  double largest = 0;
  for (int phase = 1; 2 * phase <= filter.rate; ++phase)
    largest = std::max(largest, symbol_error(functional(filter, phase), kappa));
  return largest;
}

// What rounding in double precision may add to the errors that are computed here.
double noise(const GoldFilter& filter) { return tolerance::fp64_sum(8 * filter.taps, 1 + filter.norm); }

BOOST_AUTO_TEST_CASE(phases_mirror_each_other_to_the_bit_and_add_to_1_and_the_first_copies) {
  for (const int rate : {1, 2, 4, 8, 16, 32})
    for (const double band : bands) {
      const GoldFilter filter = design_gold_filter(rate, band, 12);
      BOOST_TEST(filter.weights.size() == static_cast<std::size_t>(rate * 12));
      for (int phase = 0; phase < rate; ++phase) {
        std::vector<double> h = taps_of(filter, phase);
        double sum = 0;
        for (const double x : h) sum += x;
        BOOST_TEST(std::abs(sum - 1) <= filter.error);
        if (phase == 0) {
          for (int i = 0; i < filter.taps; ++i)
            BOOST_TEST(h[static_cast<std::size_t>(i)] == (filter.first() + i == 0 ? 1.0 : 0.0));
          continue;
        }
        std::reverse(h.begin(), h.end());
        BOOST_TEST((h == taps_of(filter, rate - phase)));
      }
    }
}

BOOST_AUTO_TEST_CASE(no_wave_of_the_band_exceeds_the_error_and_one_reaches_it) {
  for (const int rate : {2, 8, 32})
    for (const double band : bands) {
      const GoldFilter filter = design_gold_filter(rate, band, rate == 8 ? 8 : 16);
      double reached = 0;
      for (int phase = 0; phase < rate; ++phase)
        for (int s = 0; s <= 1000; ++s) {
          const double kappa = band * s / 1000;
          const double error = wave_error(taps_of(filter, phase), first_of(filter, phase), 0, kappa);
          reached = std::max(reached, error);
          if (s % 50 == 0) BOOST_TEST(error <= gold_filter_error(filter, kappa));
        }
      BOOST_TEST(reached <= filter.error);
      // A thousandth of the band away from the peak of a curve of 16 taps there is little to lose.
      BOOST_TEST(reached >= 0.95 * filter.error);
      BOOST_TEST(filter.sup >= filter.error);
    }
}

BOOST_AUTO_TEST_CASE(the_flattest_functions_stay_below_the_sup_constant_and_come_near) {
  for (const double band : {0.3, pi / 2})
    for (const int taps : {8, 16}) {
      const GoldFilter filter = design_gold_filter(4, band, taps);
      double reached = 0;
      for (int phase = 1; phase < 4; ++phase)
        reached = std::max(
            reached, FlatAttack(taps_of(filter, phase), first_of(filter, phase), band).largest_quotient());
      BOOST_TEST_MESSAGE("band " << band << ", " << taps << " taps: " << reached << " of " << filter.sup);
      BOOST_TEST(reached <= filter.sup);
      BOOST_TEST(reached >= filter.sup / 3);
      if (band > 1) BOOST_TEST(reached > filter.error);  // so E alone would be no bound by sups
    }
}

// sum_m amplitude cos(k . (p - peak)), frequencies by axis.
struct Wave {
  double amplitude;
  std::array<double, 3> k, peak;
  [[nodiscard]] double at(const std::array<double, 3>& p) const {
    double product = amplitude;
    for (std::size_t axis = 0; axis < 3; ++axis) product *= std::cos(k[axis] * (p[axis] - peak[axis]));
    return product;
  }
};

// A product of cosines is interpolated axis by axis.
double interpolated(const Wave& wave, const GoldFilter& filter, const std::array<int, 3>& place) {
  double product = wave.amplitude;
  for (std::size_t axis = 0; axis < 3; ++axis)
    product *= interpolant(filter, place[axis],
                           [&](int n) { return std::cos(wave.k[axis] * (n - wave.peak[axis])); });
  return product;
}

BOOST_AUTO_TEST_CASE(no_field_of_three_axes_exceeds_the_bounds_by_amplitudes_and_by_sups) {
  std::mt19937 random(7);
  const GoldFilter filter = design_gold_filter(8, pi / 2, 8);
  std::uniform_real_distribution<double> frequency(0, filter.band), phase(-4, 4);
  std::uniform_int_distribution<int> place(-40, 40), kind(0, 3);
  double tightest = 0;
  for (int field = 0; field < 60; ++field) {
    const int peaks = kind(random);  // 0: all waves peak at a midpoint, with the signs of a square wave
    const std::array<int, 3> p{place(random), place(random), place(random)};
    double error = 0, by_amplitudes = 0, magnitude = 0;
    for (int w = 0; w < (peaks == 1 ? 1 : 12); ++w) {
      Wave wave{w % 2 == 0 || peaks != 0 ? 1.0 : -1.0, {}, {}};
      double factor = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        wave.k[axis] = peaks == 1 ? filter.band : frequency(random);
        wave.peak[axis] = peaks < 2 ? p[axis] / 8.0 : phase(random);
        factor *= 1 + gold_filter_error(filter, wave.k[axis]);
      }
      error += interpolated(wave, filter, p) - wave.at({p[0] / 8.0, p[1] / 8.0, p[2] / 8.0});
      by_amplitudes += factor - 1;
      magnitude += 1;  // at least sup |F|
    }
    const double rounding = magnitude * noise(filter);
    BOOST_TEST(std::abs(error) <= by_amplitudes + rounding);
    BOOST_TEST(std::abs(error) <= (std::pow(1 + filter.sup, 3) - 1) * magnitude + rounding);
    tightest = std::max(tightest, std::abs(error) / by_amplitudes);
  }
  BOOST_TEST_MESSAGE("tightest " << tightest);
  BOOST_TEST(tightest >= 0.2);  // the bound is not idle: within a factor of five
}

BOOST_AUTO_TEST_CASE(sums_and_differences_on_the_finer_lattice_reach_their_norms_and_no_more) {
  struct Stencil {
    std::vector<double> coefficients;
    double GoldFilter::*norm;
  };
  const std::vector<Stencil> stencils{{{1}, &GoldFilter::norm},
                                      {{1, -2, 1}, &GoldFilter::second_difference},
                                      {{1, -4, 6, -4, 1}, &GoldFilter::fourth_difference}};
  for (const int rate : {1, 2, 4, 16})
    for (const int taps : {2, 8, 16}) {
      const GoldFilter filter = design_gold_filter(rate, pi / 2, taps);
      for (const auto& [coefficients, norm] : stencils) {
        const int reach = static_cast<int>(coefficients.size()) / 2;
        double largest = 0;
        for (int centre = -rate; centre <= rate; ++centre) {
          double sum = 0;  // over nodes, of what a unit at the node gives
          for (int unit = -taps - 5; unit <= taps + 5; ++unit) {
            double response = 0;
            for (int k = -reach; k <= reach; ++k)
              response += coefficients[static_cast<std::size_t>(k + reach)] *
                          interpolant(filter, centre + k, [&](int n) { return n == unit ? 1.0 : 0.0; });
            sum += std::abs(response);
          }
          largest = std::max(largest, sum);
        }
        const double all = filter.norm * std::pow(2, 2 * reach);
        BOOST_TEST(std::abs(largest - filter.*norm) <= tolerance::fp64_sum(16 * taps, all));
      }
    }
}

BOOST_AUTO_TEST_CASE(narrow_bands_cost_the_rounding_of_the_weights_only) {
  for (const double band : {1e-6, 0.01, 0.3})
    for (const int taps : {8, 16, 32}) {
      const GoldFilter filter = design_gold_filter(32, band, taps);
      // Each weight is rounded by u of itself; 1e-8 is what they are designed for.
      BOOST_TEST(filter.error <= 1e-8 + tolerance::unit_roundoff * filter.norm);
      BOOST_TEST(filter.sup <= 4 * filter.error);
      // Neighbouring phases are alike: second differences over 1 / 32 of a node.
      BOOST_TEST(filter.second_difference <= filter.norm * (pi / 32) * (pi / 32) * taps);
    }
}

BOOST_AUTO_TEST_CASE(the_midpoint_filters_are_as_good_as_those_of_the_text) {
  // taps, band, E as rounded, L: "Fast gold", section 3. Printed to two digits.
  struct Row {
    int taps;
    double band, error, norm;
  };
  for (const auto& [taps, band, error, norm] :
       {Row{8, pi / 2, 5.4e-4, 1.605}, Row{12, pi / 2, 1.3e-5, 1.738}, Row{14, pi / 2, 2.0e-6, 1.789},
        Row{16, pi / 2, 3.5e-7, 1.832}, Row{8, pi / 4, 1.6e-6, 1.514}, Row{6, pi / 8, 7.1e-7, 1.397}}) {
    const GoldFilter filter = design_gold_filter(2, band, taps);
    BOOST_TEST(filter.error <= error * 1.05);
    BOOST_TEST(filter.norm <= norm + 0.005);
  }
}

BOOST_AUTO_TEST_CASE(the_bounds_of_a_printed_filter_are_those_of_the_text) {
  const std::array half{-6.80918238e-05F, 0.000627964677F, -0.00310280267F, 0.0108528044F,
                        -0.03029087F,     0.0735253766F,   -0.17460382F,    0.623059452F};
  NodeFunctional f{{half.begin(), half.end()}, -7.5, 0};
  f.taps.insert(f.taps.end(), half.rbegin(), half.rend());
  double error = 0;
  for (int i = 0; i <= 4000; ++i) error = std::max(error, wave_error(f.taps, f.first, 0, pi / 2 * i / 4000));
  BOOST_TEST_MESSAGE(error << " " << largest_symbol_error(f, pi / 2));
  BOOST_TEST((error > 3.45e-7 && error < 3.55e-7));  // printed: 3.5e-7
  BOOST_TEST(largest_symbol_error(f, pi / 2) >= error);
  BOOST_TEST(largest_symbol_error(f, pi / 2) <= 1.02 * error);
  BOOST_TEST(sup_constant(f, pi / 2) < 3.15e-6);  // printed, with another cut: 3.1e-6
}

BOOST_AUTO_TEST_CASE(filters_that_cannot_be_are_refused) {
  BOOST_CHECK_THROW(design_gold_filter(3, 1), InputError);
  BOOST_CHECK_THROW(design_gold_filter(64, 1), InputError);
  BOOST_CHECK_THROW(design_gold_filter(2, 1, 1), InputError);
  BOOST_CHECK_THROW(design_gold_filter(2, 1, 7), InputError);
  BOOST_CHECK_THROW(design_gold_filter(2, 0), InputError);
  BOOST_CHECK_THROW(design_gold_filter(2, 1.001 * highest_gold_band), InputError);
  BOOST_CHECK_THROW(design_gold_filter(2, std::nan("")), InputError);
  const GoldFilter copy = design_gold_filter(1, pi / 2);
  BOOST_TEST(copy.error == 0);
  BOOST_TEST(copy.sup == 0);
  BOOST_TEST(copy.norm == 1);
  BOOST_TEST(copy.second_difference == 4);
  BOOST_TEST(copy.fourth_difference == 16);
}

}  // namespace
}  // namespace vdvr
