#define BOOST_TEST_MODULE gold_reach
#include <boost/test/unit_test.hpp>

#include "host/certify/choose_coarsening.hpp"
#include "host/certify/gold/gold_source.hpp"

using namespace vdvr;

namespace {

GoldSettings settings_of(const Index3& cells, const Vec3& spacing) {
  GoldSettings s;
  s.grid.cells = cells;
  s.grid.spacing = spacing;
  return s;
}

}  // namespace

// A plan keeps gold before it knows how coarse the base will be, and a farther reach would make all of it
// anew: 25 of the 88 seconds of a cone-beam build of 254 x 254 x 211 cells.
BOOST_AUTO_TEST_CASE(gold_that_is_kept_reaches_as_far_as_any_base_that_may_be_chosen) {
  int possible = 0;
  for (const Index3& cells : {Index3{254, 254, 211}, {64, 64, 64}, {63, 64, 60}, {60, 61, 62}, {8, 2, 4}})
    for (const Vec3& spacing : {Vec3{1, 1, 1}, {0.5, 0.5, 2}, {0.25, 1, 1}}) {
      const GoldSettings s = settings_of(cells, spacing);
      const double reach = reach_of_all(s);
      LevelTriple c{};
      for (c[0] = 0; c[0] <= 2; ++c[0])
        for (c[1] = 0; c[1] <= 2; ++c[1])
          for (c[2] = 0; c[2] <= 2; ++c[2]) {
            if (!is_possible(c, s.grid, s.granularity, s.rate)) continue;
            ++possible;
            GoldSettings coarse = s;
            coarse.coarsening = c;
            BOOST_TEST(gold_reach(coarse) <= reach, "cells " << cells[0] << " x " << cells[1] << " x "
                                                             << cells[2] << ", base " << int{c[2]}
                                                             << int{c[1]} << int{c[0]});
          }
    }
  BOOST_TEST(possible > 100);
}

BOOST_AUTO_TEST_CASE(nothing_is_kept_for_a_base_that_no_grid_cell_divides_into) {
  const GoldSettings odd = settings_of({61, 63, 65}, {1, 1, 1});
  BOOST_TEST(reach_of_all(odd) == gold_reach(odd));
}
