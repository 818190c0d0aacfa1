// Fourth derivatives from fourth differences: the norms, and the theorem on waves whose derivatives are
// exact.
#define BOOST_TEST_MODULE remainder_norms
#include "host/certify/bounds/remainder_norms.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "host/certify/bounds/tap_design.hpp"
#include "tests/support/band_attack.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;

BOOST_AUTO_TEST_CASE(norms_are_those_of_the_text_to_a_few_percent_and_eta_is_reached) {
  // band, nodes, eta, |a|, |b|, |d|: "Fast gold", section 5. Theirs is a linear programme that allows 1.08
  // eta.
  struct Row {
    double band;
    int taps;
    double eta, a, b, d;
  };
  for (const auto& [band, taps, eta, a, b, d] :
       {Row{pi / 2, 12, 1e-3, 1.471, 1.891, 2.645}, Row{pi / 2, 16, 1e-4, 1.538, 2.052, 2.779},
        Row{pi / 4, 8, 1e-3, 1.181, 1.334, 1.506}, Row{pi / 4, 12, 1e-4, 1.181, 1.324, 1.487}}) {
    const RemainderNorms norms = remainder_norms(band, taps, eta);
    BOOST_TEST(norms.eta <= eta);
    BOOST_TEST(norms.value <= 1.06 * a);
    BOOST_TEST(norms.second <= 1.06 * b);
    BOOST_TEST(norms.fourth <= 1.06 * d);
    BOOST_TEST(norms.value_sup >= norms.eta / 2);  // a sup constant is no less than the error of a wave
  }
}

// Taps on differences as taps on the nodes, written out: what remainder_norms.cpp does by steps.
std::vector<double> on_nodes(const std::vector<double>& h, int order) {
  const std::vector<double> difference = order == 0   ? std::vector<double>{1}
                                         : order == 2 ? std::vector<double>{1, -2, 1}
                                                      : std::vector<double>{1, -4, 6, -4, 1};
  std::vector<double> taps(h.size() + difference.size() - 1, 0.0);
  for (std::size_t i = 0; i < h.size(); ++i)
    for (std::size_t k = 0; k < difference.size(); ++k) taps[i + k] += h[i] * difference[k];
  return taps;
}

BOOST_AUTO_TEST_CASE(the_relative_error_of_taps_is_that_of_their_worst_wave) {
  for (const int order : {0, 2, 4})
    for (const double place : {0.0, 0.3, 0.5}) {
      const TapTask task{12, place, pi / 2, order};
      const std::vector<double> h = least_norm_taps(task, 1e-3, least_error_taps(task)),
                                taps = on_nodes(h, order);
      double reached = 0;
      for (int s = 150; s <= 3000; ++s) {  // below, the quotient is of two numbers that rounding makes
        const double kappa = task.band * s / 3000;
        reached = std::max(
            reached, wave_error(taps, 1 - 12 / 2 - order / 2 - place, order, kappa) / std::pow(kappa, order));
      }
      const double error = relative_error(task, h);
      BOOST_TEST(reached <= error);
      BOOST_TEST(reached >= 0.9 * error);
      double norm = 0, start = 0;
      for (const double x : h) norm += std::abs(x);
      for (const double x : least_error_taps(task)) start += std::abs(x);
      BOOST_TEST(norm <= start + 0.01);  // what least_norm_taps is content with
    }
}

// A product of cosines: amplitude prod cos(k_j (x_j - peak_j)), and what is asked of it along an axis.
struct Wave {
  double amplitude;
  std::array<double, 3> k, peak;
  // Times (2 sin(k / 2))^order or k^order, by axis: a difference at a node, or a derivative at a point. The
  // signs of the orders that occur together cancel or are the same for all waves.
  [[nodiscard]] double at(const std::array<double, 3>& p, const std::array<int, 3>& order,
                          bool differ) const {
    double product = amplitude;
    for (std::size_t j = 0; j < 3; ++j)
      product *=
          std::cos(k[j] * (p[j] - peak[j])) * std::pow(differ ? 2 * std::sin(k[j] / 2) : k[j], order[j]);
    return product;
  }
};

double sum_at(const std::vector<Wave>& waves, const std::array<double, 3>& p, const std::array<int, 3>& order,
              bool differ) {
  double sum = 0;
  for (const Wave& w : waves) sum += w.at(p, order, differ);
  return sum;
}

double largest_difference(const std::vector<Wave>& waves, const std::array<int, 3>& order, int taps) {
  double largest = 0;
  for (int x = 1 - taps / 2; x <= taps / 2; ++x)
    for (int y = 1 - taps / 2; y <= taps / 2; ++y)
      for (int z = 1 - taps / 2; z <= taps / 2; ++z)
        largest = std::max(largest, std::abs(sum_at(waves, {1.0 * x, 1.0 * y, 1.0 * z}, order, true)));
  return largest;
}

// Truth over the bound without its tail; checks both bounds.
double check(const std::vector<Wave>& waves, const std::array<double, 3>& p, bool mixed,
             const RemainderNorms& n) {
  const std::array<int, 3> order = mixed ? std::array{2, 2, 0} : std::array{4, 0, 0};
  const double truth = std::abs(sum_at(waves, p, order, false));
  const double local =
      (mixed ? mixed_factor(n, n, n) : pure_factor(n, n, n)) * largest_difference(waves, order, n.taps);
  double amplitudes = 0, sup = 0;
  for (const Wave& w : waves) {
    amplitudes += std::abs(w.amplitude) * std::pow(w.k[0], order[0]) * std::pow(w.k[1], order[1]);
    sup += std::abs(w.amplitude);
  }
  BOOST_TEST(truth <= local + (std::pow(1 + n.eta, 3) - 1) * amplitudes);
  BOOST_TEST(truth <= local + (mixed ? mixed_tail(n, n, n) : pure_tail(n, n, n)) * sup);
  return truth / local;
}

BOOST_AUTO_TEST_CASE(no_derivative_exceeds_what_differences_allow) {
  std::mt19937 random(11);
  const RemainderNorms norms = remainder_norms(pi / 2, 12, 1e-3);
  std::uniform_real_distribution<double> frequency(0, norms.band), place(0, 1), sign(-1, 1);
  for (int field = 0; field < 40; ++field) {
    const std::array<double, 3> p{place(random), place(random), place(random)};
    std::vector<Wave> waves;
    for (int w = 0; w < 6; ++w) {
      waves.push_back({sign(random), {}, p});
      for (std::size_t j = 0; j < 3; ++j) {
        waves.back().k[j] = w < 3 ? norms.band : frequency(random);
        if (field % 2 == 1) waves.back().peak[j] = 9 * place(random);
      }
    }
    check(waves, p, field % 4 < 2, norms);
  }
}

BOOST_AUTO_TEST_CASE(a_wave_that_peaks_between_nodes_comes_near_the_bound) {
  const RemainderNorms norms = remainder_norms(pi / 2, 16, 1e-4);
  const std::vector<Wave> peak{{1, {norms.band, norms.band, norms.band}, {0.5, 0.5, 0.5}}};
  // 2.8 = 2^(3 / 2): at the nodes each factor is cos(pi / 4) of its peak; 1.52 = (pi / 4 / sin(pi / 4))^4.
  for (const bool mixed : {false, true})
    BOOST_TEST(check(peak, {0.5, 0.5, 0.5}, mixed, norms) >= 2.8 * 1.52 / 7.2);
}

BOOST_AUTO_TEST_CASE(norms_that_cannot_be_are_refused) {
  BOOST_CHECK_THROW(remainder_norms(0), InputError);
  BOOST_CHECK_THROW(remainder_norms(1.6), InputError);
  BOOST_CHECK_THROW(remainder_norms(1, 7), InputError);
  BOOST_CHECK_THROW(remainder_norms(1, 16, 1e-7), InputError);
}

}  // namespace
}  // namespace vdvr
