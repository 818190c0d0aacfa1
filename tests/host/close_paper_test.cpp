// The paper's closing, and none.
#define BOOST_TEST_MODULE close_paper
#include <algorithm>
#include <boost/test/unit_test.hpp>

#include "host/certify/closing/close_boundaries.hpp"
#include "host/volume/brick_layout.hpp"
#include "tests/support/open_bricks.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using support::anisotropic;
using support::isotropic;
using support::largest_sample;
using support::random_bricks;

BOOST_AUTO_TEST_CASE(the_paper_feeds_the_low_side_with_gold_on_shared_parts_and_interpolates_inside) {
  OpenBricks open = random_bricks({{6, 2, 2}, 2, 4, {{2, 2, 2}}, 1.0, 9});
  for (const std::size_t low : {0u, 1u}) {  // levels 0, 0, 2 along x
    open.level[low] = {0, 0, 0};
    open.samples.drop(low);
  }
  const MixedVolume v = close_boundaries(open, Closing::paper);
  BOOST_TEST((v.level == std::vector<LevelTriple>{{0, 0, 0}, {2, 2, 2}, {2, 2, 2}}));
  const BrickSamples low(v, {1, 0, 0}), high(v, {2, 0, 0});
  for (std::int64_t z = 0; z <= 8; ++z)
    for (std::int64_t y = 0; y <= 8; ++y) {
      const float gold = open.samples[2][static_cast<std::size_t>((z * 9 + y) * 9)];
      if (y % 4 != 0 || z % 4 != 0) {
        BOOST_TEST(low(8, y, z) == gold);
        BOOST_TEST(high(0, y, z) == gold);
      }
      // Half way inside the cell beside the border: between the interpolated column and the fed one.
      const double between = (static_cast<double>(low(4, y, z)) + static_cast<double>(low(8, y, z))) / 2;
      if (y % 4 == 0 && z % 4 == 0)
        BOOST_TEST(std::abs(static_cast<double>(low(6, y, z)) - between) <=
                   tolerance::fp32_sum(8, largest_sample(v)));
    }
}

BOOST_AUTO_TEST_CASE(the_paper_closing_refuses_what_it_is_not_defined_for) {
  OpenBricks open = random_bricks({{4, 4, 4}, 2, 4, anisotropic, 1.0, 9});
  BOOST_CHECK_THROW(close_boundaries(open, Closing::paper), InputError);
  OpenBricks fitted = random_bricks({{4, 4, 4}, 2, 4, isotropic, 1.0, 9});
  fitted.sampled = false;
  BOOST_CHECK_THROW(close_boundaries(fitted, Closing::paper), InputError);
}

BOOST_AUTO_TEST_CASE(without_closing_bricks_keep_their_own_samples) {
  const OpenBricks open = random_bricks({{10, 7, 6}, 4, 4, isotropic, 1.0, 4});
  const MixedVolume v = close_boundaries(open, Closing::none);
  for (std::size_t i = 0; i < open.level.size(); ++i) {
    if (open.samples[i].empty()) continue;
    const SampleBlock& tiles = v.tiles.at(v.level[i]);
    const auto first = tiles.f32.begin() + static_cast<std::ptrdiff_t>(v.tile[i] * open.samples[i].size());
    BOOST_TEST(std::equal(open.samples[i].begin(), open.samples[i].end(), first));
  }
}
