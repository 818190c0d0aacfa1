#define BOOST_TEST_MODULE cosine_series
#include "host/field/fbp/cosine_series.hpp"

#include <boost/test/unit_test.hpp>
#include <random>

#include "tests/reference/cosine_series.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

const std::vector<std::int64_t> lengths{1, 2, 3, 7, 33, 64};

std::vector<double> noise(std::int64_t n) {
  std::mt19937 random(static_cast<unsigned>(n));
  std::uniform_real_distribution<double> value(-1, 1);
  std::vector<double> q(static_cast<std::size_t>(n));
  for (double& v : q) v = value(random);
  return q;
}

// Inside, on samples, on both edges, beyond them, and some periods away; all multiples of 1/8.
std::vector<double> positions(std::int64_t n) {
  const auto size = static_cast<double>(n);
  std::vector<double> x{-0.5,         0,     size - 1,       size - 0.5,      -0.625, -2.25,
                        size + 3.375, -size, 2 * size - 0.5, 5 * size + 0.125};
  for (int i = 0; i < 40; ++i) x.push_back(-1 + static_cast<double>(i * (n + 2) * 8 / 40) / 8);
  return x;
}

double apply(const std::vector<double>& matrix, std::size_t row, const std::vector<double>& q) {
  double sum = 0;
  for (std::size_t i = 0; i < q.size(); ++i) sum += matrix[row * q.size() + i] * q[i];
  return sum;
}

// Double-precision evaluation of n^2 terms no larger than (pi / pitch)^order; phases of up to 6 periods round
// too.
double rounding(std::int64_t n, int order, double pitch) {
  return tolerance::fp64_sum(64 * n, static_cast<double>(n) * std::pow(std::numbers::pi / pitch, order));
}

}  // namespace

BOOST_AUTO_TEST_CASE(resampling_matrix_gives_the_series_and_its_derivatives_anywhere) {
  for (const std::int64_t n : lengths)
    for (const int order : {0, 2, 4})
      for (const int lattice : {0, 8})
        for (const double pitch : {1.0, 0.1, 3.0}) {
          const auto q = noise(n), x = positions(n), a = reference::cosine_coefficients(q);
          const auto matrix = resampling_matrix(n, x, order, pitch, lattice);
          BOOST_REQUIRE(matrix.size() == x.size() * q.size());
          for (std::size_t p = 0; p < x.size(); ++p)
            BOOST_TEST(std::abs(apply(matrix, p, q) - reference::cosine_series(a, x[p], order, pitch)) <=
                           rounding(n, order, pitch),
                       "n " << n << " order " << order << " lattice " << lattice << " x " << x[p]);
        }
}

BOOST_AUTO_TEST_CASE(derivatives_of_single_cosines_are_the_analytic_ones) {
  constexpr double pitch = 0.7;
  for (const std::int64_t n : {5, 32})
    for (std::int64_t m = 0; m < n; ++m) {
      const double omega = std::numbers::pi * static_cast<double>(m) / static_cast<double>(n);
      std::vector<double> q;
      for (std::int64_t i = 0; i < n; ++i) q.push_back(std::cos(omega * (static_cast<double>(i) + 0.5)));
      const auto x = positions(n);
      for (const int order : {0, 2, 4}) {
        const auto matrix = resampling_matrix(n, x, order, pitch, 0);
        const double sign = order == 2 ? -1 : 1;
        for (std::size_t p = 0; p < x.size(); ++p)
          BOOST_TEST(std::abs(apply(matrix, p, q) -
                              sign * std::pow(omega / pitch, order) * std::cos(omega * (x[p] + 0.5))) <=
                     rounding(n, order, pitch));
      }
    }
}

BOOST_AUTO_TEST_CASE(positions_on_samples_give_the_samples) {
  for (const std::int64_t n : lengths) {
    std::vector<double> x;
    for (std::int64_t i = 0; i < n; ++i) x.push_back(static_cast<double>(i));
    const auto matrix = resampling_matrix(n, x, 0, 1, 1);
    for (std::size_t p = 0; p < x.size(); ++p)
      for (std::size_t i = 0; i < x.size(); ++i)
        BOOST_TEST(std::abs(matrix[p * x.size() + i] - (p == i ? 1.0 : 0.0)) <= rounding(n, 0, 1));
  }
}

BOOST_AUTO_TEST_CASE(series_is_mirrored_about_both_edges) {
  for (const std::int64_t n : lengths)
    for (const int order : {0, 2, 4}) {
      const auto q = noise(n);
      const double last = static_cast<double>(n) - 0.5;
      for (const double d : {0.125, 0.5, 1.25, 4.0}) {
        const std::vector<double> x{-0.5 - d, -0.5 + d, last - d, last + d};
        const auto matrix = resampling_matrix(n, x, order, 1, 0);
        BOOST_TEST(std::abs(apply(matrix, 0, q) - apply(matrix, 1, q)) <= rounding(n, order, 1));
        BOOST_TEST(std::abs(apply(matrix, 2, q) - apply(matrix, 3, q)) <= rounding(n, order, 1));
      }
    }
}

BOOST_AUTO_TEST_CASE(analysis_matrix_gives_the_cosine_coefficients) {
  for (const std::int64_t n : lengths) {
    const auto q = noise(n), a = reference::cosine_coefficients(q), matrix = analysis_matrix(n);
    for (std::size_t m = 0; m < q.size(); ++m)
      BOOST_TEST(std::abs(apply(matrix, m, q) - a[m]) <= rounding(n, 0, 1));
  }
}

BOOST_AUTO_TEST_CASE(upsampled_columns_reach_past_the_margin_by_a_cubic_stencil) {
  for (const std::int64_t n : lengths)
    for (const int rate : {1, 2, 8, 64})
      for (const double margin : {0.0, 0.3, 2.5}) {
        const UpsampledColumns c = upsampled_columns(n, rate, margin);
        const double below = c.column_of(-0.5 - margin),
                     above = c.column_of(static_cast<double>(n) - 0.5 + margin);
        BOOST_TEST(std::floor(below) - 1 >= 0);
        BOOST_TEST(std::floor(above) + 2 <= static_cast<double>(c.count - 1));
        for (std::int64_t j = 0; j < c.count; ++j)
          BOOST_TEST(std::abs(c.column_of(c.position(j)) - static_cast<double>(j)) <=
                     tolerance::fp64_sum(4, static_cast<double>(c.count)));
      }
}
