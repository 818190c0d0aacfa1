// Which levels rise where a closed brick violates the node test.
#define BOOST_TEST_MODULE raise_levels
#include "host/certify/closing/raise_levels.hpp"

#include <boost/test/unit_test.hpp>

namespace vdvr {
namespace {

constexpr int top = 3;
const AxisErrors unknown;

// Two bricks side by side along x.
OpenBricks pair_of(const LevelTriple& left, const LevelTriple& right) {
  OpenBricks b;
  b.grid.cells = {8, 4, 4};
  b.grid.spacing = {1, 1, 1};
  b.level = {left, right};
  b.involved = {1, 1};
  b.samples.resize(2);
  return b;
}

constexpr std::uint32_t bit(int x, int y, int z) { return 1u << (9 * z + 3 * y + x); }
constexpr std::uint32_t inside = bit(1, 1, 1), low_x = bit(0, 1, 1), high_x = bit(2, 1, 1);

std::vector<LevelTriple> raised(const OpenBricks& b, std::int64_t brick, std::uint32_t violated,
                                const AxisErrors& along = {}, bool anisotropic = true) {
  std::vector<LevelTriple> to = b.level;
  BOOST_TEST(raise_levels(b, brick, violated, anisotropic ? &along : nullptr, to));
  return to;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_face_raises_the_missing_axes_in_it_and_no_others) {
  // The right one is coarser along y and z, of which x is across the face.
  BOOST_TEST(
      (raised(pair_of({1, 2, 2}, {1, 0, 0}), 0, high_x) == std::vector<LevelTriple>{{1, 2, 2}, {1, 1, 0}}));
  BOOST_TEST(
      (raised(pair_of({2, 2, 0}, {1, 0, 3}), 0, high_x) == std::vector<LevelTriple>{{2, 2, 0}, {2, 1, 3}}));
}

BOOST_AUTO_TEST_CASE(isotropic_levels_rise_as_one) {
  BOOST_TEST((raised(pair_of({2, 2, 2}, {0, 0, 0}), 0, high_x, {}, false) ==
              std::vector<LevelTriple>{{2, 2, 2}, {1, 1, 1}}));
  BOOST_TEST((raised(pair_of({1, 1, 1}, {1, 1, 1}), 1, inside, {}, false) ==
              std::vector<LevelTriple>{{1, 1, 1}, {2, 2, 2}}));
}

BOOST_AUTO_TEST_CASE(isotropic_levels_end_at_gold_along_every_axis_where_the_base_is_coarser) {
  OpenBricks b = pair_of({4, 3, 4}, {3, 3, 3});
  b.coarsening = {1, 0, 1};
  BOOST_TEST((raised(b, 0, high_x, {}, false) == std::vector<LevelTriple>{{4, 3, 4}, {4, 3, 4}}));
}

BOOST_AUTO_TEST_CASE(a_brick_without_coarser_neighbours_rises_along_the_axis_that_errs_most) {
  AxisErrors along;
  along.of[0] = {{{1, 0}, {0.25f, 0}, {0.06f, 0}}};
  along.of[1] = {{{0, 2}, {0, 0.5f}, {0, 0.1f}}};
  BOOST_TEST((raised(pair_of({0, 0, 0}, {0, 0, 0}), 0, inside, along)[0] == LevelTriple{0, 1, 0}));
  BOOST_TEST((raised(pair_of({0, 1, 0}, {0, 1, 0}), 0, low_x, along)[0] == LevelTriple{0, 1, 1}));
  // Where nothing is known, along the coarsest.
  BOOST_TEST((raised(pair_of({0, 1, 1}, {0, 1, 1}), 0, inside)[0] == LevelTriple{1, 1, 1}));
}

// Once, bricks at an edge along y rose to gold along x and z, whose errors were small, since twice the
// samples along y did not err less: thrice the samples of the whole volume.
BOOST_AUTO_TEST_CASE(an_axis_whose_error_falls_late_still_rises_first) {
  AxisErrors along;
  along.of[0] = {{{0.2f, 0}, {0.05f, 0}, {0.01f, 0}}};
  along.of[1] = {{{1, 0}, {0, 1}, {0.3f, 0}}};
  BOOST_TEST((raised(pair_of({0, 0, 0}, {0, 0, 0}), 0, inside, along)[0] == LevelTriple{0, 1, 0}));
  BOOST_TEST((raised(pair_of({0, 1, 0}, {0, 1, 0}), 0, inside, along)[0] == LevelTriple{0, 2, 0}));
  BOOST_TEST((raised(pair_of({0, 3, 0}, {0, 3, 0}), 0, inside, along)[0] == LevelTriple{0, 3, 1}));
}

// What a corner holds is what the coarsest brick there stores: once, four bricks of a real scan rose to gold
// for a base sample that none of them stored.
BOOST_AUTO_TEST_CASE(a_corner_raises_the_coarsest_that_meet_there) {
  AxisErrors along;
  along.of[1] = {{{0, 2}, {0, 0.5f}, {0, 0.1f}}};
  BOOST_TEST((raised(pair_of({1, 1, 1}, {0, 0, 0}), 0, bit(2, 2, 2), along) ==
              std::vector<LevelTriple>{{1, 1, 1}, {0, 1, 0}}));
  // Its own.
  BOOST_TEST((raised(pair_of({0, 1, 0}, {1, 1, 1}), 0, bit(2, 2, 2), along) ==
              std::vector<LevelTriple>{{0, 2, 0}, {1, 1, 1}}));
  // Nobody else meets this one.
  BOOST_TEST((raised(pair_of({1, 1, 1}, {0, 0, 0}), 0, bit(0, 2, 2), along) ==
              std::vector<LevelTriple>{{1, 2, 1}, {0, 0, 0}}));
}

BOOST_AUTO_TEST_CASE(inside_waits_for_a_border_that_raises_others) {
  BOOST_TEST((raised(pair_of({1, 2, 2}, {1, 0, 0}), 0, high_x | inside) ==
              std::vector<LevelTriple>{{1, 2, 2}, {1, 1, 0}}));
  BOOST_TEST((raised(pair_of({1, 2, 2}, {1, 0, 0}), 0, inside)[0] == LevelTriple{2, 2, 2}));
}

// What a looser brick fitted lies beside F by what it is allowed: finer samples of the strict one do not mend
// it.
BOOST_AUTO_TEST_CASE(a_part_whose_samples_a_looser_brick_gives_raises_that_one) {
  OpenBricks b = pair_of({1, 1, 1}, {1, 1, 0});
  b.tolerance = {0.008f, 0.0105f};  // nearly alike: the coarser owns the face
  BOOST_TEST((raised(b, 0, high_x)[0] == LevelTriple{1, 1, 1}));
  BOOST_TEST((raised(b, 0, high_x)[1] == LevelTriple{1, 1, 1}));
  // The strict one owns it.
  b.tolerance = {0.008f, 0.2f};
  BOOST_TEST((raised(b, 0, high_x)[0] == LevelTriple{2, 2, 2}));
  BOOST_TEST((raised(b, 0, high_x)[1] == LevelTriple{1, 1, 0}));
  // Whoever reads the base keeps it from that.
  b.level = {{0, 0, 2}, {0, 0, 0}};
  BOOST_TEST((raised(b, 0, high_x)[0] == LevelTriple{0, 0, 2}));
  BOOST_TEST((raised(b, 0, high_x)[1] == LevelTriple{1, 1, 1}));
}

BOOST_AUTO_TEST_CASE(a_face_waits_for_its_edges_where_bricks_have_tolerances) {
  // Four bricks around an edge along z; the one across it is coarser along z.
  OpenBricks b;
  b.grid.cells = {8, 8, 4};
  b.grid.spacing = {1, 1, 1};
  b.level = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {0, 1, 1}};
  b.involved = {1, 1, 1, 1};
  b.samples.resize(4);
  const std::uint32_t edge = bit(2, 2, 1);
  BOOST_TEST((raised(b, 0, edge | high_x)[0] == LevelTriple{2, 2, 2}));
  b.tolerance = {0.01f, 0.01f, 0.01f, 0.2f};
  const auto to = raised(b, 0, edge | high_x);
  BOOST_TEST((to[0] == LevelTriple{1, 1, 1}));
  BOOST_TEST((to[3] == LevelTriple{1, 1, 1}));
}

BOOST_AUTO_TEST_CASE(at_the_gold_rate_the_others_rise_until_all_are_there) {
  const LevelTriple gold{top, top, top};
  BOOST_TEST((raised(pair_of(gold, {3, 3, 1}), 0, high_x) == std::vector<LevelTriple>{gold, {3, 3, 2}}));
  const OpenBricks all = pair_of(gold, gold);
  std::vector<LevelTriple> to = all.level;
  BOOST_TEST(!raise_levels(all, 0, high_x, &unknown, to));
  BOOST_TEST((to == all.level));
}

BOOST_AUTO_TEST_CASE(repairs_end_whatever_is_violated) {
  for (const LevelTriple& left : {LevelTriple{0, 0, 0}, LevelTriple{0, 2, 1}, LevelTriple{3, 0, 0}}) {
    OpenBricks b = pair_of(left, {1, 0, 2});
    int rounds = 0;
    for (bool any = true; any; ++rounds) {
      BOOST_REQUIRE(rounds < 20);
      std::vector<LevelTriple> to = b.level;
      any = false;
      for (std::int64_t i = 0; i < 2; ++i) any = raise_levels(b, i, (1u << 27) - 1, &unknown, to) || any;
      any = any && to != b.level;
      for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t a = 0; a < 3; ++a) {
          BOOST_TEST(to[i][a] >= b.level[i][a]);
          BOOST_TEST(to[i][a] <= std::min(b.level[i][a] + 1, top));
        }
      b.level = to;
    }
    BOOST_TEST((b.level == std::vector<LevelTriple>(2, LevelTriple{top, top, top})));
  }
}

}  // namespace vdvr
