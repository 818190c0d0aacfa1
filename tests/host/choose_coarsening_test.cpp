// How coarse a base is chosen.
#define BOOST_TEST_MODULE choose_coarsening
#include "host/certify/choose_coarsening.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>

#include "tests/support/fields.hpp"

using namespace vdvr;

namespace {

LevelTriple chosen(const Volume& base, const CoarseningQuestion& question, bool covered = true) {
  const Index3 n = base.grid.samples();
  return choose_coarsening(
      base, std::vector<std::uint8_t>(static_cast<std::size_t>(n[0] * n[1]), covered ? 1 : 0), question);
}

CoarseningQuestion question(double tolerance) {
  CoarseningQuestion q;
  q.tolerance = tolerance;
  return q;
}

Volume field(const Index3& cells, const fields::Field& f) {
  return fields::uniform(fields::centred_grid(cells), f);
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_constant_takes_the_coarsest_base) {
  const Volume v = field({24, 16, 20}, [](double, double, double) { return 1.0; });
  BOOST_TEST((chosen(v, question(0.1)) == LevelTriple{2, 2, 2}));
}

BOOST_AUTO_TEST_CASE(axes_along_which_nothing_varies_are_coarse_and_the_others_are_not) {
  // Along x an error of 1 - cos(kappa / 2) between samples, half of which fitting leaves.
  const double kappa = 1.2, error = (1 - std::cos(kappa / 2)) / 2;
  const Volume along_x = field({24, 24, 24}, [&](double x, double, double) { return std::sin(kappa * x); });
  BOOST_TEST((chosen(along_x, question(1.5 * error)) == LevelTriple{2, 2, 0}));
  const Volume along_z = field({24, 24, 24}, [&](double, double, double z) { return std::sin(kappa * z); });
  BOOST_TEST((chosen(along_z, question(1.5 * error)) == LevelTriple{0, 2, 2}));
}

BOOST_AUTO_TEST_CASE(noise_above_the_tolerance_keeps_the_grid) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Volume v = field({24, 24, 24}, [&](double, double, double) { return normal(random); });
  BOOST_TEST((chosen(v, question(0.7)) == LevelTriple{0, 0, 0}));
  BOOST_TEST((chosen(v, question(20)) == LevelTriple{2, 2, 2}));
}

BOOST_AUTO_TEST_CASE(what_is_chosen_divides_cells_and_granularity_and_leaves_room_for_the_levels) {
  const auto constant = [](double, double, double) { return 1.0; };
  BOOST_TEST((chosen(field({24, 18, 15}, constant), question(1)) == LevelTriple{0, 1, 2}));
  CoarseningQuestion q = question(1);
  q.granularity = 2;
  BOOST_TEST((chosen(field({24, 24, 24}, constant), q) == LevelTriple{1, 1, 1}));
  q.granularity = 8;
  q.rate = 32;
  BOOST_TEST((chosen(field({24, 24, 24}, constant), q) == LevelTriple{1, 1, 1}));
  q.rate = 8;
  BOOST_TEST((chosen(field({24, 24, 24}, constant), q) == LevelTriple{3, 3, 3}));
}

BOOST_AUTO_TEST_CASE(a_volume_of_which_nothing_is_covered_or_no_brick_is_whole_keeps_the_grid) {
  const auto constant = [](double, double, double) { return 1.0; };
  BOOST_TEST((chosen(field({24, 24, 24}, constant), question(1), false) == LevelTriple{0, 0, 0}));
  BOOST_TEST((chosen(field({24, 24, 3}, constant), question(1)) == LevelTriple{0, 0, 0}));
}

BOOST_AUTO_TEST_CASE(the_base_has_every_so_manieth_sample) {
  const Volume v = field({8, 4, 4}, [](double x, double y, double z) { return x + 100 * y + 10000 * z; });
  const std::vector<float> base = take_base(v, {2, 0, 1});
  BOOST_REQUIRE(base.size() == 50u);
  std::size_t i = 0;
  for (const double z : {-2, 2})
    for (const double y : {-2, -1, 0, 1, 2})
      for (const double x : {-4, -2, 0, 2, 4})
        BOOST_TEST(static_cast<double>(base[i++]) == x + 100 * y + 10000 * z);
}
