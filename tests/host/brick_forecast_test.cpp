#define BOOST_TEST_MODULE brick_forecast
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "host/picture/refine/brick_forecast.hpp"
#include "host/volume/bricks.hpp"

using namespace vdvr;

namespace {

using Level = BrickForecast::Level;

// x^2 in cells in the middle brick along x, 0 before it and linear behind: second differences are 2.
Volume bent_along_x() {
  Volume v;
  v.grid.cells = {12, 12, 12};
  v.grid.spacing = {1, 1, 1};
  for (int z = 0; z <= 12; ++z)
    for (int y = 0; y <= 12; ++y)
      for (int x = 0; x <= 12; ++x)
        v.samples.push_back(x < 5 ? 0.0f : x < 7 ? static_cast<float>((x - 5) * (x - 5)) : 2.0f * x - 12.0f);
  return v;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_brick_is_refined_along_the_axis_that_turns_until_it_is_within) {
  const Volume v = bent_along_x();
  const BrickForecast forecast(v, {4, {}, Levels::anisotropic}, 8, 0);
  const auto brick = static_cast<std::size_t>(Bricks(v.grid, 4).number({1, 1, 1}));
  const double coarse = forecast.error(brick, Level{});
  BOOST_TEST(coarse > 0);
  BOOST_TEST((forecast.level(brick, coarse) == Level{}));
  BOOST_TEST(forecast.samples(Level{}) == 0u);
  // Each level quarters the error.
  BOOST_TEST((forecast.level(brick, 0.99 * coarse) == Level{1, 0, 0}));
  BOOST_TEST((forecast.level(brick, coarse / 4) == Level{1, 0, 0}));
  BOOST_TEST((forecast.level(brick, 0.99 * coarse / 4) == Level{2, 0, 0}));
  BOOST_TEST(forecast.samples(Level{1, 0, 0}) == 9u * 5 * 5);
  // At the gold rate nothing is left.
  BOOST_TEST((forecast.level(brick, 0) == Level{3, 0, 0}));
  // Elsewhere the field is linear.
  const auto corner = static_cast<std::size_t>(Bricks(v.grid, 4).number({2, 1, 1}));
  BOOST_TEST((forecast.level(corner, 0) == Level{}));
}

BOOST_AUTO_TEST_CASE(isotropic_levels_rise_along_all_axes) {
  const BrickForecast forecast(bent_along_x(), {4, {}, Levels::isotropic}, 8, 0);
  BOOST_TEST((forecast.level(13, 0.99 * forecast.error(13, Level{})) == Level{1, 1, 1}));
}

BOOST_AUTO_TEST_CASE(a_level_along_an_axis_spreads_across_it) {
  const Volume v = bent_along_x();
  const BrickForecast forecast(v, {4, {}, Levels::anisotropic}, 8, 0);
  std::vector<Level> own(27);
  own[13] = {2, 1, 0};
  const auto closed = forecast.closed(own);
  for (int i = 0; i < 27; ++i) {
    const bool beside_x = i % 3 == 1, beside_y = i / 3 % 3 == 1;
    BOOST_TEST((closed[static_cast<std::size_t>(i)] == Level{static_cast<std::uint8_t>(beside_x ? 2 : 0),
                                                             static_cast<std::uint8_t>(beside_y ? 1 : 0), 0}),
               "brick " << i);
  }
}

BOOST_AUTO_TEST_CASE(what_bricks_were_measured_to_err_scales_what_is_expected) {
  BrickForecast forecast(bent_along_x(), {4, {}, Levels::anisotropic}, 8, 1);
  const double slack = 1, expected = forecast.error(13, Level{}) - slack;
  BrickMeasure m;
  m.brick = 13;
  m.error = static_cast<float>(3 * expected);
  m.slack = 0.5f;
  m.rate = 8;
  forecast.compare({m});
  // The quotient is that of a float.
  BOOST_TEST(std::abs(forecast.error(13, Level{}) - (3 * expected + 0.5)) <= 0x1p-23 * 3 * expected);
}
