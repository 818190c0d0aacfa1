#define BOOST_TEST_MODULE measure_tightness
#include "tests/support/measure_tightness.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "vdvr/expert/simulate.hpp"

using namespace vdvr;

// Marschner-Lobb on the paper's grid.
BOOST_AUTO_TEST_CASE(bounds_of_marschner_lobb_are_as_tight_as_documented) {
  Device device;
  SimulateOptions options;
  options.angles = 74;
  options.columns = options.rows = 65;
  const ProjectionSet scan = simulate(marschner_lobb(32 / std::sqrt(2.0)), options);
  GridOptions cells;
  cells.size = Index3{64, 64, 64};
  cells.spacing = std::sqrt(0.5);
  const support::Tightness t = support::measure_tightness(device, scan, make_grid(scan.geometry, cells), {},
                                                          {8, Interpolation::linear, 8});
  BOOST_TEST(t.bricks > 0);
  // A bound below its truth is no bound; above these ratios (docs/error-bounds.md) tolerance is wasted.
  BOOST_TEST(t.gold_error > 0);
  BOOST_TEST(t.gold_bound >= t.gold_error);
  BOOST_TEST(t.gold_bound <= 1.2 * t.gold_error);
  BOOST_TEST(t.projection_error > 0);
  BOOST_TEST(t.projection_bound >= t.projection_error - t.arithmetic);
  // A constant: 3.4 for what errors of kept nodes can grow to, and the views' sups as if all peaked together.
  BOOST_TEST(t.projection_bound <= 20 * t.projection_error);
}
