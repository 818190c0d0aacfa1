// Lagrange's polynomials as verify uses them, of twelve points and of 32: weights, what they err on a band,
// how errors of nodes grow.
#define BOOST_TEST_MODULE verify_lagrange
#include "host/verify/witness/lagrange.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "host/verify/witness/field_bounds.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

/// The weights in double precision, by Neville's scheme on unit vectors: another formula than the code's.
std::vector<double> weights_at(double place, int points) {
  std::vector<double> weights;
  const int before = points / 2 - 1;
  for (int unit = 0; unit < points; ++unit) {
    std::vector<double> p(at(points), 0.0);
    p[at(unit)] = 1;
    for (int order = 1; order < points; ++order)
      for (int i = 0; i + order < points; ++i) {
        const double low = i - before, high = i + order - before;
        p[at(i)] = ((high - place) * p[at(i)] + (place - low) * p[at(i + 1)]) / order;
      }
    weights.push_back(p[0]);
  }
  return weights;
}

double wave_error(const std::vector<double>& weights, double place, double kappa) {
  std::complex<double> sum = -1;
  const int points = static_cast<int>(weights.size()), before = points / 2 - 1;
  for (int i = 0; i < points; ++i) sum += weights[at(i)] * std::polar(1.0, kappa * (i - before - place));
  return std::abs(sum);
}

constexpr int nodes_before = 40, all_nodes = 100;

/// The interpolant's value at place / factor behind node 0 of values f at the nodes -40 .. 59.
double interpolated(const LagrangeFilter& f, const std::vector<double>& values, int place) {
  const BetweenNodes& b = f.between;
  const int shifted = place + nodes_before * b.factor, node = shifted / b.factor, phase = shifted % b.factor;
  double sum = 0;
  for (int i = 0; i < b.points; ++i)
    sum +=
        static_cast<double>(f.weights[at(phase * b.points + i)]) * values[at(node + i - (b.points / 2 - 1))];
  return sum;
}

/// The largest value of a formula over neighbouring places among values of size 1 at the nodes.
double reached(const LagrangeFilter& f, const std::vector<double>& formula) {
  const int half = static_cast<int>(formula.size()) / 2;
  double largest = 0;
  for (int place = 0; place < f.between.factor; ++place) {
    double sum = 0;
    for (int node = 0; node < all_nodes; ++node) {
      std::vector<double> unit(at(all_nodes), 0.0);
      unit[at(node)] = 1;
      double response = 0;
      for (int k = -half; k <= half; ++k)
        response += formula[at(k + half)] * interpolated(f, unit, place + k * f.between.by);
      sum += std::abs(response);
    }
    largest = std::max(largest, sum);
  }
  return largest;
}

/// From 12 points to a power of two, and from sparse nodes.
std::vector<BetweenNodes> ways() {
  return {{1, 1, 12}, {2, 1, 12}, {4, 1, 12}, {8, 1, 12}, {16, 1, 12}, {4, 3, 32}, {8, 3, 32}, {16, 5, 32}};
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
  for (const BetweenNodes& b : ways()) {
    const LagrangeFilter f = lagrange_filter(b);
    BOOST_TEST(f.weights.size() == at(b.factor * b.points));
    for (int phase = 0; phase < b.factor; ++phase) {
      const auto exact = weights_at(static_cast<double>(phase) / b.factor, b.points);
      for (int i = 0; i < b.points; ++i) {
        const double weight = exact[at(i)];
        // Rounded once; in double precision before, of numbers up to 2^points in the reference.
        BOOST_TEST(std::abs(static_cast<double>(f.weights[at(phase * b.points + i)]) - weight) <=
                   tolerance::bound(tolerance::unit_roundoff * std::abs(weight) + 0x1p-42));
        if (phase == 0) BOOST_TEST(f.weights[at(i)] == (i == b.before() ? 1.0f : 0.0f));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(rates_share_no_divisor) {
  const auto is = [](const BetweenNodes& b, int factor, int by) {
    BOOST_TEST(b.factor == factor);
    BOOST_TEST(b.by == by);
  };
  is(between_nodes(8, 8, 12), 1, 1);
  is(between_nodes(16, 4, 12), 4, 1);
  is(between_nodes(4, 3, 32), 4, 3);
  is(between_nodes(16, 6, 32), 8, 3);
  is(between_nodes(4, 8, 12), 1, 2);
  BOOST_TEST(!between_nodes(4, 8, 12).made());
  BOOST_TEST(between_nodes(8, 3, 32).values_to_a_node() == 8.0 / 3);
}

// The constants of the method's text, worked out here in double precision.
BOOST_AUTO_TEST_CASE(no_wave_of_the_band_exceeds_the_error_and_one_comes_near) {
  // (11!!)^2 / 2^12 / 12! (pi / 4)^12
  double by_hand = 1;
  for (const int odd : {1, 3, 5, 7, 9, 11}) by_hand *= odd * odd / 4.0;
  for (int i = 1; i <= 12; ++i) by_hand *= pi / 4 / i;
  BOOST_TEST(std::abs(lagrange_error(pi / 4, 12) - by_hand) <= 1e-9 * by_hand);
  BOOST_TEST(by_hand < 3.04e-6);
  BOOST_TEST(std::pow(1 + by_hand, 3) - 1 < 9.2e-6);
  for (const auto& [points, band] :
       std::vector<std::pair<int, double>>{{12, pi / 4}, {12, pi / 5}, {12, pi / 8}, {32, 1.4}, {32, 1.6}}) {
    double largest = 0;
    for (int p = 0; p <= 64; ++p) {
      const double place = p / 64.0;
      const auto weights = weights_at(place, points);
      for (int w = 0; w <= 64; ++w) largest = std::max(largest, wave_error(weights, place, band * w / 64));
    }
    // Roundings of the sums here, of weights that are made of numbers up to 2^points.
    BOOST_TEST(largest <= lagrange_error(band, points) + (points == 12 ? 1e-14 : 1e-12));
    // Differences of a wave are 2 sin(band / 2) where its derivatives are the band.
    BOOST_TEST(largest >= 0.9 * lagrange_error(2 * std::sin(band / 2), points));
  }
}

BOOST_AUTO_TEST_CASE(errors_of_nodes_grow_by_the_norms_and_no_more) {
  const std::vector<double> second{1, -2, 1}, fourth{1, -4, 6, -4, 1},
      five{-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};
  for (const BetweenNodes& b : ways()) {
    const LagrangeFilter f = lagrange_filter(b);
    const auto near = [&](double norm, double found) {
      BOOST_TEST(found <= norm, b.factor << " values to " << b.by << " nodes");
      BOOST_TEST(found >= norm * (1 - 1e-9), b.factor << " values to " << b.by << " nodes");
    };
    near(f.norms.value, reached(f, {1}) * (1 - 1e-12));
    near(f.norms.second, reached(f, second) * (1 - 1e-12));
    near(f.norms.fourth, reached(f, fourth) * (1 - 1e-12));
    near(f.norms.curvature, std::max(reached(f, second), reached(f, five)) * (1 - 1e-12));
  }
  BOOST_TEST(lagrange_filter({2, 1, 12}).norms.value < 1.624);
  BOOST_TEST(lagrange_filter({4, 3, 32}).norms.value < 1.944);
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
  fine.across.factor = 2;
  const FieldBounds made = bounds_of(fine);
  const double L = reached(lagrange_filter({2, 1, 12}), {1}), S = 30 * 0.7;
  // All that nodes err grows by L along x and y, and what interpolation errs is added.
  BOOST_TEST(made.arithmetic >= L * L * direct.arithmetic + 2 * lagrange_error(pi / 4, 12) * S);
  BOOST_TEST(made.arithmetic <= 1.05 * (L * L * direct.arithmetic + 2 * lagrange_error(pi / 4, 12) * S) +
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
  between.across.factor = between.along.factor = 2;
  BOOST_TEST(bounds_of(between).arithmetic >=
             L * L * L * bounds_of(heights).arithmetic + 3 * lagrange_error(pi / 4, 12) * S);
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
