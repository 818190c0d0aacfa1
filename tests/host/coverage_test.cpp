// Margins of the covered region against the least of all views' strips.
#define BOOST_TEST_MODULE coverage
#include "host/field/fbp/coverage.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

namespace vdvr {
namespace {

using std::numbers::pi;

ParallelGeometry geometry_of(std::int64_t columns, std::int64_t views, double arc, double center) {
  ParallelGeometry g;
  g.columns = columns;
  g.rows = 8;
  g.center = center;
  for (std::int64_t k = 0; k < views; ++k)
    g.theta_rad.push_back(arc * static_cast<double>(k) / static_cast<double>(views));
  return g;
}

// The least distance from the edges of any view's strip; shifts move the detector.
double least_of_all(const ParallelGeometry& g, double x, double y) {
  double least = INFINITY;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const double shift = g.column_shift.empty() ? 0 : g.column_shift[k],
                 t = x * std::cos(g.theta_rad[k]) + y * std::sin(g.theta_rad[k]),
                 column = t / g.pitch_u + g.center + shift;
    least = std::min({least, column + 0.5, static_cast<double>(g.columns) - 0.5 - column});
  }
  return least * g.pitch_u;
}

void compare(const ParallelGeometry& g) {
  const Coverage coverage(g);
  const double inner = coverage.inner_radius();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(0, 2 * pi), radius(1, 3);
  const auto look = [&](double r, double phi) {
    const double x = r * inner * std::cos(phi), y = r * inner * std::sin(phi), wanted = least_of_all(g, x, y);
    // Margins are a billionth of a pixel more; both round sums of two products and some columns.
    const double slack = 1e-9 * g.pitch_u,
                 rounding = 16 * 0x1p-53 * (r * inner + static_cast<double>(g.columns + 12) * g.pitch_u);
    BOOST_TEST(std::abs(coverage.margin(x, y) - slack - wanted) <= rounding);
    for (const double floor : {-0.3 * inner, -1e-3 * inner}) {
      const double above = coverage.margin_above(x, y, floor);
      if (wanted >= floor + 1e-6 * inner) BOOST_TEST(above == coverage.margin(x, y));
      else if (wanted < floor - 1e-6 * inner) BOOST_TEST(above < floor);
    }
  };
  for (int i = 0; i < 4000; ++i) look(radius(random), turn(random));
  // On the borders of sectors, at the inner radius and where sectors end.
  for (int i = 0; i < 4096; ++i)
    for (const double r : {1.0 + 1e-12, 1.03, 1.999999, 2.000001})
      look(r, 2 * pi * static_cast<double>(i) / 4096);
}

}  // namespace

BOOST_AUTO_TEST_CASE(margins_outside_are_the_least_of_all_views) {
  compare(geometry_of(65, 90, pi, 32));
  compare(geometry_of(65, 90, pi, 21.3));  // one side of the detector is longer
  compare(geometry_of(640, 1801, pi, 318.7));
}

BOOST_AUTO_TEST_CASE(few_views_and_short_arcs_leave_corners_far_out) {
  compare(geometry_of(33, 2, pi, 16));
  compare(geometry_of(33, 3, pi, 15));
  compare(geometry_of(65, 40, pi / 3, 30));
  compare(geometry_of(65, 1, pi, 32));
}

BOOST_AUTO_TEST_CASE(each_view_has_a_strip_of_its_own_where_the_sample_moved) {
  ParallelGeometry g = geometry_of(65, 180, 2 * pi, 32);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shift(-6, 6);
  for (std::int64_t k = 0; k < g.views(); ++k) g.column_shift.push_back(shift(random));
  compare(g);
}

}  // namespace vdvr
