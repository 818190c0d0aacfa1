#define BOOST_TEST_MODULE quantise
#include "host/volume/choose_lattice.hpp"

#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <random>

#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

std::vector<float> random_base(double lo, double hi, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(lo, hi);
  std::vector<float> base(1000);
  for (float& s : base) s = static_cast<float>(value(random));
  base[0] = static_cast<float>(lo);
  base[1] = static_cast<float>(hi);
  return base;
}

}  // namespace

BOOST_AUTO_TEST_CASE(rounding_errs_by_half_a_step_and_decodes_exactly) {
  for (const auto& [lo, hi] : {std::pair{0.0, 1.0},
                               {-3.7, 1e-3},
                               {999.0, 1001.0},
                               {-1e-30, 1e-30},
                               {5.0, 5.0},
                               {0.0, 0.0},
                               {-1e36, 2e36},
                               {1e-44, 3e-44}})
    for (const StorageChoice choice : {StorageChoice::u8, StorageChoice::u16}) {
      std::vector<float> base = random_base(lo, hi, 3);
      const std::vector<float> exact = base;
      const IntegerLattice lattice = choose_lattice(base, choice, 0);
      BOOST_TEST((lattice.base == (choice == StorageChoice::u8 ? SampleType::u8 : SampleType::u16)));
      round_base(base, lattice);
      const SampleBlock block = pack_base(base, lattice);
      const std::vector<float> back = decoded(block, lattice.step);
      for (std::size_t i = 0; i < base.size(); ++i) {
        BOOST_REQUIRE(back[i] == base[i]);
        BOOST_REQUIRE(!std::signbit(base[i]) == (base[i] >= 0));  // no -0
        BOOST_REQUIRE(std::abs(static_cast<double>(base[i]) - static_cast<double>(exact[i])) <=
                      tolerance::bound(lattice.base_step() / 2));
      }
      BOOST_TEST(block.offset[0] % (1 << block.shift[0]) == 0);
    }
}

BOOST_AUTO_TEST_CASE(auto_takes_the_smallest_type_whose_half_step_is_allowed) {
  const std::vector<float> base = random_base(0, 1, 5);
  // 1.125 / 255 lies between 2^-8 and 2^-7: half a step of 8 bits is 2^-8.
  BOOST_TEST((choose_lattice(base, StorageChoice::automatic, 0x1p-8).base == SampleType::u8));
  BOOST_TEST(choose_lattice(base, StorageChoice::automatic, 0.1).base_step() == 0x1p-7);
  const IntegerLattice wide = choose_lattice(base, StorageChoice::automatic, 0x1.fp-9);
  BOOST_TEST((wide.base == SampleType::u16));
  BOOST_TEST((wide.least == SampleType::u8));
  BOOST_TEST(wide.base_step() == 0x1p-8);  // the coarsest of which half is allowed
  // 1.125 / 65535 lies between 2^-16 and 2^-15.
  BOOST_TEST((choose_lattice(base, StorageChoice::automatic, 0x1p-16).base == SampleType::u16));
  BOOST_TEST(choose_lattice(base, StorageChoice::automatic, 0x1.fp-17).step == 0.0);
  BOOST_TEST(choose_lattice(base, StorageChoice::f32, 1).step == 0.0);
}

BOOST_AUTO_TEST_CASE(auto_takes_no_type_whose_filter_errs_by_more_than_rounding_may) {
  const std::vector<float> base = random_base(0, 1, 5);
  const auto chosen = [&](double rounding, const FilterErrors& filters) {
    return choose_lattice(base, StorageChoice::automatic, rounding, 0, filters);
  };
  // All that 8 bits of step 2^-7 hold is 255 / 128.
  const double rounding = 0x1p-8, limit = rounding / (255 * 0x1p-7);
  BOOST_TEST((chosen(rounding, {limit, 0}).base == SampleType::u8));
  const IntegerLattice badly = chosen(rounding, {1.01 * limit, 0});
  BOOST_TEST((badly.base == SampleType::u16));
  BOOST_TEST((badly.least == SampleType::u16));  // nor do tiles take it
  BOOST_TEST(badly.base_step() == 0x1p-7);       // the coarsest of which half is allowed
  BOOST_TEST(chosen(rounding, {1, 1}).step == 0.0);
  // What is asked for by name is taken.
  BOOST_TEST((choose_lattice(base, StorageChoice::u8, rounding, 0, {1, 1}).base == SampleType::u8));
}

BOOST_AUTO_TEST_CASE(a_tile_takes_the_finest_step_that_fits_and_none_coarser_than_the_base) {
  const std::vector<float> base = random_base(0, 1, 5);
  const IntegerLattice l = choose_lattice(base, StorageChoice::u8, 0);
  const auto fits = [&](float lo, float hi, SampleType type) {
    return fitting_shift(lo, hi, l, type, l.base_shift);
  };
  const int finest = l.finest_shift;
  const double unit = std::ldexp(l.step, finest);
  BOOST_TEST(finest >= 10);
  BOOST_TEST(unit == l.base_step() / 4);
  BOOST_TEST(fits(0.5f, 0.5f, SampleType::u8).value() == finest);
  BOOST_TEST(fits(0, static_cast<float>(255 * unit), SampleType::u8).value() == finest);
  BOOST_TEST(fits(0, static_cast<float>(257 * unit), SampleType::u8).value() == finest + 1);
  BOOST_TEST(fits(0, static_cast<float>(257 * unit), SampleType::u16).value() == finest);
  BOOST_TEST(fits(0, 1, SampleType::u8).value() <= l.base_shift);
  BOOST_TEST(!fits(-2, 2, SampleType::u8).has_value());  // 512 steps of the base
  BOOST_TEST(!fits(0, 8, SampleType::u16).has_value());  // 2^24 steps and more: not exact in fp32
}

BOOST_AUTO_TEST_CASE(no_tile_has_a_step_finer_than_a_quarter_of_the_bases) {
  for (const double far : {0.0, 7.0, 1e6})  // from 0: a base whose own step is the file's has nothing finer
    for (const StorageChoice choice : {StorageChoice::u8, StorageChoice::u16}) {
      const IntegerLattice l = choose_lattice(random_base(far, far + 1, 5), choice, 0);
      const auto at = static_cast<float>(far + 0.5);
      BOOST_TEST(fitting_shift(at, at, l, SampleType::u16, l.base_shift).value() ==
                 std::max(l.base_shift - 2, 0));
    }
}

BOOST_AUTO_TEST_CASE(a_base_holds_every_value_within_its_limits) {
  std::vector<float> base = random_base(-0.3, 1, 7);
  for (const StorageChoice choice : {StorageChoice::u8, StorageChoice::u16}) {
    const IntegerLattice l = choose_lattice(base, choice, 0);
    std::vector<float> moved = base;
    round_base(moved, l);
    const auto [lo, hi] = base_limits(moved, l);
    BOOST_TEST(lo <= *std::min_element(moved.begin(), moved.end()));
    moved[5] = lo;
    moved[6] = hi;
    const std::vector<float> back = decoded(pack_base(moved, l), l.step);
    BOOST_TEST(back == moved, boost::test_tools::per_element());
  }
}
