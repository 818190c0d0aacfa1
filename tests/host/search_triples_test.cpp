// Which level triples are tried, and in which order.
#define BOOST_TEST_MODULE search_triples
#include "host/certify/gold/search_triples.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <random>

namespace vdvr {
namespace {

constexpr int top = 3;

// Bricks of 4 cells, gold at 2^levels.
GoldSettings settings_of(int levels, bool anisotropic, bool fitted, const LevelTriple& coarsening = {}) {
  GoldSettings s;
  s.grid.cells = {8, 8, 8};
  s.rate = 1 << levels;
  s.anisotropic = anisotropic;
  s.midrange = fitted;
  s.coarsening = coarsening;
  return s;
}

// Interpolation of a field of constant curvature errs by a quarter at half the spacing.
TripleSearch::Brick curved(float x, float y, float z) {
  TripleSearch::Brick b;
  const std::array<float, 3> axis{x, y, z};
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t l = 0; l < top; ++l)
      b.errors.of[a][l] = {std::max(axis[a], 0.0f) / static_cast<float>(1 << 2 * l),
                           std::max(-axis[a], 0.0f) / static_cast<float>(1 << 2 * l)};
  return b;
}

std::vector<LevelTriple> tried(const TripleSearch& search, TripleSearch::Brick brick, float tolerance) {
  std::vector<LevelTriple> out;
  while (const auto level = search.next(brick, tolerance)) {
    out.push_back(*level);
    search.fail(brick, *level, 2 * tolerance);
  }
  return out;
}

double samples_of(const LevelTriple& l) {
  double n = 1;
  for (const std::uint8_t level : l) n *= (4 << level) + 1;
  return n;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_axis_that_errs_is_refined_alone) {
  const TripleSearch search(settings_of(top, true, false));
  BOOST_TEST((search.next(curved(3, 0, 0), 1.0f) == LevelTriple{0, 0, 1}));
  BOOST_TEST((search.next(curved(0, 3, 0), 1.0f) == LevelTriple{0, 1, 0}));
  BOOST_TEST((search.next(curved(0, 0, -3), 1.0f) == LevelTriple{1, 0, 0}));
  BOOST_TEST((search.next(curved(0, 0, 12), 1.0f) == LevelTriple{2, 0, 0}));
  BOOST_TEST((search.next(curved(3, 3, 0), 1.5f) == LevelTriple{0, 1, 1}));
}

BOOST_AUTO_TEST_CASE(a_coarse_base_is_refined_along_the_axes_that_err) {
  // Two levels below the grid along every axis: what errs there is 16 times what errs on the grid.
  const TripleSearch search(settings_of(1, true, false, {2, 2, 2}));
  BOOST_TEST((search.next(curved(3, 0, 0), 1.0f) == LevelTriple{0, 0, 1}));
  BOOST_TEST((search.next(curved(48, 0, 0), 1.0f) == LevelTriple{0, 0, 3}));
  BOOST_TEST((search.next(curved(0, 3, 12), 2.0f) == LevelTriple{2, 1, 0}));
}

BOOST_AUTO_TEST_CASE(after_four_failures_only_equal_densities_are_tried) {
  const TripleSearch search(settings_of(2, true, false, {2, 0, 1}));
  TripleSearch::Brick brick = curved(1, 1, 1);
  for (int i = 0; i < 4; ++i) brick.failed.push_back({0, 0, 1});
  BOOST_TEST((search.next(brick, 1e-6f) == LevelTriple{2, 0, 1}));
  search.fail(brick, {2, 0, 1}, 1);
  BOOST_TEST((search.next(brick, 1e-6f) == LevelTriple{3, 1, 2}));
  search.fail(brick, {3, 1, 2}, 1);
  BOOST_TEST(!search.next(brick, 1e-6f));
}

BOOST_AUTO_TEST_CASE(errors_of_opposite_signs_do_not_add) {
  const TripleSearch search(settings_of(top, true, false));
  const auto same = search.next(curved(1, 1, 1), 1.1f), opposite = search.next(curved(1, -1, 0.05f), 1.1f);
  BOOST_REQUIRE((same && opposite));
  BOOST_TEST(samples_of(*opposite) < samples_of(*same));
}

BOOST_AUTO_TEST_CASE(isotropic_levels_come_in_turn_and_end_below_gold) {
  const TripleSearch search(settings_of(top, false, true));
  BOOST_TEST((tried(search, curved(1, 1, 1), 1e-6f) == std::vector<LevelTriple>{{1, 1, 1}, {2, 2, 2}}));
  BOOST_TEST((!TripleSearch(settings_of(1, false, true)).next(curved(1, 1, 1), 1.0f)));
  BOOST_TEST((!TripleSearch(settings_of(0, true, true)).next(curved(1, 1, 1), 1.0f)));
}

// Coarse gold of a base on the grid: of a level whose samples are its nodes it does not show the error.
BOOST_AUTO_TEST_CASE(what_is_proposed_has_samples_two_nodes_apart_along_every_axis) {
  const TripleSearch proposing(settings_of(2, true, true), true), all(settings_of(2, true, true));
  // Two axes at gold's own spacing are foreseen to pass, none is not.
  BOOST_TEST((all.next(curved(4, 4, 4), 0.6f) != std::nullopt));
  BOOST_TEST((proposing.next(curved(4, 4, 4), 0.6f) == std::nullopt));
  for (const TripleSearch* search : {&proposing, &all})
    BOOST_TEST((search->next(curved(4, 4, 4), 1.5f) == LevelTriple{1, 1, 1}));
}

BOOST_AUTO_TEST_CASE(every_search_ends_and_nothing_coarser_than_a_failure_is_tried) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> error(-4, 4);
  for (const bool fitted : {false, true}) {
    const TripleSearch search(settings_of(top, true, fitted));
    for (int trial = 0; trial < 100; ++trial) {
      const auto levels = tried(search, curved(error(random), error(random), error(random)), 1.0f);
      BOOST_TEST(levels.size() <= 4u + top - 1);
      for (std::size_t i = 0; i < levels.size(); ++i) {
        BOOST_TEST((levels[i] != LevelTriple{0, 0, 0} && levels[i] != LevelTriple{top, top, top}));
        for (std::size_t j = 0; j < i; ++j)
          BOOST_TEST(!(levels[i][0] <= levels[j][0] && levels[i][1] <= levels[j][1] &&
                       levels[i][2] <= levels[j][2]));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(a_failure_corrects_what_is_foreseen) {
  const TripleSearch search(settings_of(top, true, false));
  TripleSearch::Brick hopeful = curved(3, 0, 0);
  const auto first = search.next(hopeful, 1.0f);
  search.fail(hopeful, *first, 1.5f);  // twice what was foreseen
  BOOST_TEST((search.next(hopeful, 1.0f) == LevelTriple{0, 0, 2}));
}

}  // namespace vdvr
