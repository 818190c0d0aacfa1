// F at points in double precision: the sum of its definition in long double, of its own coefficients, and
// what the sum is said to round by.
#define BOOST_TEST_MODULE exact_field
#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/exact_field.hpp"

using namespace vdvr;
using vdvr::testing::ConeShape;
using vdvr::testing::noise_scan;
using vdvr::testing::noisy_cone;

namespace {

using Long = long double;
constexpr Long pi = std::numbers::pi_v<Long>;

Long series(const double* a, std::int64_t U, std::int64_t V, Long column, Long row) {
  Long sum = 0;
  for (std::int64_t m = 0; m < U; ++m)
    for (std::int64_t l = 0; l < V; ++l)
      sum += static_cast<Long>(a[m * V + l]) *
             std::cos(static_cast<Long>(m) * pi * (column + 0.5L) / static_cast<Long>(U)) *
             std::cos(static_cast<Long>(l) * pi * (row + 0.5L) / static_cast<Long>(V));
  return sum;
}

/// F by its definition, and the largest lambda^-2 there.
std::pair<Long, double> by_definition(const ExactField& field, const Vec3& p) {
  const ParallelGeometry& g = field.geometry();
  Long sum = 0;
  double weight = 1;
  for (std::size_t k = 0; k < at(g.views()); ++k) {
    const double* a = field.coefficients().data() + static_cast<std::int64_t>(k) * g.columns * g.rows;
    if (!field.views().empty()) {
      std::array<Long, 3> n{};
      for (std::size_t i = 0; i < 3; ++i) {
        n[i] = static_cast<Long>(field.views()[k][i][3]);
        for (std::size_t e = 0; e < 3; ++e)
          n[i] += static_cast<Long>(field.views()[k][i][e]) * static_cast<Long>(p[e]);
      }
      sum += series(a, g.columns, g.rows, n[0] / n[2], n[1] / n[2]) / (n[2] * n[2]);
      weight = std::max(weight, static_cast<double>(1 / (n[2] * n[2])));
      continue;
    }
    const Long theta = static_cast<Long>(g.theta_rad[k]),
               t = static_cast<Long>(p[0]) * std::cos(theta) + static_cast<Long>(p[1]) * std::sin(theta);
    sum += series(
        a, g.columns, g.rows, t / static_cast<Long>(g.pitch_u) + static_cast<Long>(g.center_of_view(k)),
        static_cast<Long>(p[2]) / static_cast<Long>(g.pitch_v) + 0.5L * static_cast<Long>(g.rows - 1));
  }
  return {sum, weight};
}

// Heights that points share and heights of one, more of both than are summed together.
std::vector<Vec3> some_points(double radius, double height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> in(-0.7, 0.7);
  std::vector<Vec3> out;
  for (int i = 0; i < 11; ++i) out.push_back({radius * in(random), radius * in(random), 0.25 * height});
  for (int i = 0; i < 10; ++i) out.push_back({radius * in(random), radius * in(random), height * in(random)});
  return out;
}

void compare(const ProjectionSet& scan, double height) {
  const ExactField field(scan, {});
  const std::vector<Vec3> points = some_points(0.5 * static_cast<double>(scan.geometry.columns), height, 3);
  const std::vector<double> values = field.at(points);
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [sum, weight] = by_definition(field, points[i]);
    const double error = std::abs(static_cast<double>(static_cast<Long>(values[i]) - sum));
    BOOST_TEST(error <= weight * field.rounding());
    // Below half a unit in the last place of fp32, of which a certificate counts dozens.
    BOOST_TEST(weight * field.rounding() < 0x1p-24 * largest);
  }
}

}  // namespace

// Numbers of columns and rows that no group divides.
BOOST_AUTO_TEST_CASE(parallel_beam_is_the_sum_of_its_series) {
  compare(noise_scan(7, 13, 27, 1, 180), 6);
  compare(noise_scan(3, 1, 130, 2, 180), 0.4);
  compare(noise_scan(2, 120, 5, 2, 180), 50);
}

BOOST_AUTO_TEST_CASE(cone_beam_is_the_sum_of_its_series) {
  compare(noisy_cone(ConeShape{.views = 9, .rows = 13, .columns = 27, .source_to_axis = 50}), 4);
  compare(noisy_cone(ConeShape{.views = 8, .rows = 21, .columns = 22, .source_to_axis = 70, .shift = 3}), 6);
}
