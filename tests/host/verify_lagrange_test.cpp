// Twelve points of Lagrange as verify uses them: weights, what they err on a band, how errors of nodes grow.
#define BOOST_TEST_MODULE verify_lagrange
#include "host/verify/witness/lagrange.hpp"

#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "host/verify/witness/field_bounds.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

/// The weights in double precision, by Neville's scheme on unit vectors: another formula than the code's.
std::vector<double> weights_at(double place) {
  std::vector<double> weights;
  for (int unit = 0; unit < lagrange_points; ++unit) {
    std::array<double, lagrange_points> p{};
    p[at(unit)] = 1;
    for (int order = 1; order < lagrange_points; ++order)
      for (int i = 0; i + order < lagrange_points; ++i) {
        const double low = i - 5, high = i + order - 5;
        p[at(i)] = ((high - place) * p[at(i)] + (place - low) * p[at(i + 1)]) / order;
      }
    weights.push_back(p[0]);
  }
  return weights;
}

double wave_error(const std::vector<double>& weights, double place, double kappa) {
  std::complex<double> sum = -1;
  for (int i = 0; i < lagrange_points; ++i) sum += weights[at(i)] * std::polar(1.0, kappa * (i - 5 - place));
  return std::abs(sum);
}

/// The interpolant's value at place / factor behind node 0 of values f at the nodes -20 .. 40.
double interpolated(const LagrangeFilter& f, const std::vector<double>& values, int place) {
  const int shifted = place + 20 * f.factor, node = shifted / f.factor, phase = shifted % f.factor;
  double sum = 0;
  for (int i = 0; i < lagrange_points; ++i)
    sum += static_cast<double>(f.weights[at(phase * lagrange_points + i)]) * values[at(node + i - 5)];
  return sum;
}

/// The largest value of a formula over neighbouring places among values of size 1 at the nodes.
double reached(const LagrangeFilter& f, const std::vector<double>& formula) {
  const int half = static_cast<int>(formula.size()) / 2;
  double largest = 0;
  for (int place = 0; place < f.factor; ++place) {
    double sum = 0;
    for (int node = 0; node < 60; ++node) {
      std::vector<double> unit(60, 0.0);
      unit[at(node)] = 1;
      double response = 0;
      for (int k = -half; k <= half; ++k)
        response += formula[at(k + half)] * interpolated(f, unit, place + k);
      sum += std::abs(response);
    }
    largest = std::max(largest, sum);
  }
  return largest;
}

SupsByView some_sups(std::size_t views) {
  return {std::vector<double>(views, 0.7), std::vector<double>(views, 3.0), std::vector<double>(views, 2.0)};
}

FieldBounds bounds_of(const NodePath& path, double spacing = 0.125) {
  ParallelGeometry g;
  g.columns = 40;
  g.rows = 20;
  for (int k = 0; k < 30; ++k) g.theta_rad.push_back(pi * k / 30);
  return field_bounds(some_sups(30), 0, g, {spacing, spacing, spacing}, path);
}

}  // namespace

BOOST_AUTO_TEST_CASE(weights_are_lagranges) {
  for (const int factor : {1, 2, 4, 8, 16}) {
    const LagrangeFilter f = lagrange_filter(factor);
    BOOST_TEST(f.weights.size() == at(factor * lagrange_points));
    for (int phase = 0; phase < factor; ++phase) {
      const auto exact = weights_at(static_cast<double>(phase) / factor);
      for (int i = 0; i < lagrange_points; ++i) {
        const double weight = exact[at(i)];
        // Rounded once; a dozen operations in double precision before.
        BOOST_TEST(std::abs(static_cast<double>(f.weights[at(phase * lagrange_points + i)]) - weight) <=
                   tolerance::bound(tolerance::unit_roundoff * std::abs(weight) + 0x1p-45));
        if (phase == 0) BOOST_TEST(f.weights[at(i)] == (i == 5 ? 1.0f : 0.0f));
      }
    }
  }
}

// The constants of the method's text, worked out here in double precision.
BOOST_AUTO_TEST_CASE(no_wave_of_the_band_exceeds_the_error_and_one_comes_near) {
  // (11!!)^2 / 2^12 / 12! (pi / 4)^12
  double by_hand = 1;
  for (const int odd : {1, 3, 5, 7, 9, 11}) by_hand *= odd * odd / 4.0;
  for (int i = 1; i <= 12; ++i) by_hand *= pi / 4 / i;
  BOOST_TEST(std::abs(lagrange_error(pi / 4) - by_hand) <= 1e-9 * by_hand);
  BOOST_TEST(by_hand < 3.04e-6);
  BOOST_TEST(std::pow(1 + by_hand, 3) - 1 < 9.2e-6);
  for (const double band : {pi / 4, pi / 5, pi / 8}) {
    double largest = 0;
    for (int p = 0; p <= 64; ++p) {
      const double place = p / 64.0;
      const auto weights = weights_at(place);
      for (int w = 0; w <= 64; ++w) largest = std::max(largest, wave_error(weights, place, band * w / 64));
    }
    // 1e-14: roundings of the sums here.
    BOOST_TEST(largest <= lagrange_error(band) + 1e-14);
    BOOST_TEST(largest >= 0.7 * lagrange_error(band));
  }
}

BOOST_AUTO_TEST_CASE(errors_of_nodes_grow_by_the_norms_and_no_more) {
  const std::vector<double> second{1, -2, 1}, fourth{1, -4, 6, -4, 1},
      five{-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};
  for (const int factor : {1, 2, 4, 8}) {
    const LagrangeFilter f = lagrange_filter(factor);
    const auto near = [&](double norm, double found) {
      BOOST_TEST(found <= norm, "factor " << factor);
      BOOST_TEST(found >= norm * (1 - 1e-9), "factor " << factor);
    };
    near(f.norms.value, reached(f, {1}) * (1 - 1e-12));
    near(f.norms.second, reached(f, second) * (1 - 1e-12));
    near(f.norms.fourth, reached(f, fourth) * (1 - 1e-12));
    near(f.norms.curvature, std::max(reached(f, second), reached(f, five)) * (1 - 1e-12));
  }
  BOOST_TEST(lagrange_filter(2).norms.value < 1.624);
  // A wave at the edge of the band comes near the band's norms where steps are small.
  for (const double band : {0.05, 0.4, pi / 4, 3.0}) {
    const AxisNorms n = band_norms(band);
    const double square = 2 - 2 * std::cos(band);
    BOOST_TEST(square <= n.second);
    BOOST_TEST(square * square <= n.fourth);
    BOOST_TEST(square + square * square / 12 <= n.curvature);
    if (band < 0.5) BOOST_TEST(n.curvature < 1.05 * (square + square * square / 12));
  }
}

BOOST_AUTO_TEST_CASE(bounds_hold_the_growth_of_each_kind_of_error) {
  NodePath nodes;
  nodes.band = {pi / 4, pi / 4, pi / 4};
  nodes.terms = 20;
  nodes.gain = 3;
  nodes.reach = 40;
  const FieldBounds direct = bounds_of(nodes);
  NodePath fine = nodes;
  fine.across = 2;
  const FieldBounds made = bounds_of(fine);
  const double L = reached(lagrange_filter(2), {1}), S = 30 * 0.7;
  // All that nodes err grows by L along x and y, and what interpolation errs is added.
  BOOST_TEST(made.arithmetic >= L * L * direct.arithmetic + 2 * lagrange_error(pi / 4) * S);
  BOOST_TEST(made.arithmetic <= 1.05 * (L * L * direct.arithmetic + 2 * lagrange_error(pi / 4) * S) +
                                    26 * tolerance::unit_roundoff * (L * L + L) * S);
  // Back-projected nodes err each by itself across z.
  BOOST_TEST(direct.curved >= 8.0 / 12 * 2 * direct.arithmetic);
  BOOST_TEST(direct.curved <= 2 * direct.arithmetic);
  BOOST_TEST(direct.fourth[0][0] == 16 * direct.arithmetic, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(direct.fourth[0][1] == 16 * direct.arithmetic, boost::test_tools::tolerance(1e-12));
  // Rows are summed with the weights of the product along z.
  NodePath louder = nodes;
  louder.gain = 6;
  const double rounding = tolerance::unit_roundoff * (28 + 1.01 * (views_per_run + 2)) * S;
  BOOST_TEST(bounds_of(louder).arithmetic - direct.arithmetic >= 3 * rounding);
  // Heights err each by itself.
  NodePath heights = nodes;
  heights.rows = false;
  heights.gain = 1;
  BOOST_TEST(bounds_of(heights).curved == 2 * bounds_of(heights).arithmetic,
             boost::test_tools::tolerance(1e-12));
  NodePath between = heights;
  between.across = between.along = 2;
  BOOST_TEST(bounds_of(between).arithmetic >=
             L * L * L * bounds_of(heights).arithmetic + 3 * lagrange_error(pi / 4) * S);
}

BOOST_AUTO_TEST_CASE(rows_determine_every_height) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const std::int64_t rows : {1, 2, 3, 8, 33, 100}) {
    std::vector<double> a(at(rows));
    for (double& x : a) x = unit(random);
    const auto series = [&](double j) {
      double sum = 0;
      for (std::int64_t n = 0; n < rows; ++n)
        sum += a[at(n)] * std::cos(pi * static_cast<double>(n) * (j + 0.5) / static_cast<double>(rows));
      return sum;
    };
    for (const double j :
         {-0.5, -3.25, 0.0, 0.3, 0.5 * static_cast<double>(rows), static_cast<double>(rows) + 1.7}) {
      double sum = 0, gain = 0;
      for (std::int64_t r = 0; r < rows; ++r) {
        sum += row_weight(rows, j, r) * series(static_cast<double>(r));
        gain += std::abs(row_weight(rows, j, r));
      }
      // Sums of `rows` terms of at most `rows` in double precision, weights with a few roundings of `rows`.
      const auto n = static_cast<double>(rows);
      BOOST_TEST(std::abs(sum - series(j)) <= 0x1p-53 * 40 * n * n * n);
      BOOST_TEST(gain <= row_gain(rows));
    }
    // Below the Lebesgue constant of trigonometric interpolation; reached within what an eighth of a row
    // hides.
    BOOST_TEST(row_gain(rows) <= 1.02 * (2 / pi * std::log(2.0 * static_cast<double>(rows)) + 1.5));
    double largest = 0;
    for (int i = 0; i < 4000; ++i) {
      const double j = (0.5 * unit(random) + 0.5) * static_cast<double>(rows) - 0.5;
      double gain = 0;
      for (std::int64_t r = 0; r < rows; ++r) gain += std::abs(row_weight(rows, j, r));
      largest = std::max(largest, gain);
    }
    BOOST_TEST(largest <= row_gain(rows));
    BOOST_TEST(largest >= 0.95 * row_gain(rows));
  }
}
