// Six weights between columns: their facts hold at every place, and are reached.
#define BOOST_TEST_MODULE six_taps
#include "host/certify/bounds/six_taps.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "shared/six_taps.h"
#include "tests/support/band_attack.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

std::vector<double> weights(double f) {
  const auto w = six_taps(f);
  return {w.begin(), w.end()};
}

BOOST_AUTO_TEST_CASE(no_wave_at_any_place_exceeds_the_error_and_one_reaches_it) {
  const SixTaps& six = six_tap_facts();
  double reached = 0;
  for (int w = 0; w <= 100; ++w) {
    const double kappa = six.band * w / 100, bound = six.error_at(kappa);
    double here = 0;
    for (int s = 0; s <= 777; ++s)
      here = std::max(here, wave_error(weights(s / 777.0), -2 - s / 777.0, 0, kappa));
    BOOST_TEST(here <= bound);
    BOOST_TEST(bound <= six.error);
    reached = std::max(reached, here);
  }
  BOOST_TEST(reached >= 0.95 * six.error);  // 1 % of the band, and between steps of f: little to lose
  BOOST_TEST(six.error < 6.3e-7);           // printed: 6.1e-7
}

BOOST_AUTO_TEST_CASE(the_flattest_functions_stay_below_the_sup_constant_and_come_near) {
  const SixTaps& six = six_tap_facts();
  double reached = 0;
  for (const double f : {0.0, 0.0113, 0.1, 0.24, 0.37, 0.5, 0.81})
    reached = std::max(reached, FlatAttack(weights(f), -2 - f, six.band).largest_quotient());
  BOOST_TEST_MESSAGE(reached << " of " << six.sup);
  BOOST_TEST(reached <= six.sup);
  BOOST_TEST(reached >= six.sup / 3);
}

BOOST_AUTO_TEST_CASE(norm_and_slope_hold_for_any_columns_and_are_reached) {
  const SixTaps& six = six_tap_facts();
  double norm = 0, slope = 0;
  for (int s = 0; s <= 1000; ++s) {
    const std::vector<double> w = weights(s / 1000.0);
    double sum = 0, magnitude = 0;
    for (const double x : w) {
      sum += x;
      magnitude += std::abs(x);
    }
    BOOST_TEST(std::abs(sum - 1) <= six.error);
    norm = std::max(norm, magnitude);
  }
  // Columns of all 64 patterns of rises and falls by 1; the slope between two near places.
  for (int pattern = 0; pattern < 32; ++pattern)
    for (int s = 0; s < 200; ++s) {
      const std::vector<double> a = weights(s / 200.0), b = weights((s + 1) / 200.0);
      double column = 0, largest = 0, rise = 0;
      for (int i = 0; i < 6; ++i) {
        rise += (b[static_cast<std::size_t>(i)] - a[static_cast<std::size_t>(i)]) * column;
        largest = std::max(largest, std::abs(column));
        if (i < 5) column += (pattern >> i) % 2 == 0 ? 1 : -1;
      }
      BOOST_TEST(std::abs(rise) * 200 <=
                 six.slope + six.slope_sum * largest + tolerance::fp64_sum(100, 2000));
      slope = std::max(slope, std::abs(rise) * 200);
    }
  BOOST_TEST(norm <= six.norm);
  BOOST_TEST(norm >= 0.99 * six.norm);  // printed: 1.3975
  BOOST_TEST(slope >= 0.95 * six.slope);
  BOOST_TEST(six.slope < 1.515);  // printed: 1.51
}

BOOST_AUTO_TEST_CASE(weights_in_fp32_err_by_their_rounding_and_mirror_each_other) {
  for (int s = 0; s <= 4096; ++s) {
    const float f = s % 2 == 0 ? static_cast<float>(s) / 4096 : std::sin(static_cast<float>(s)) * 0.5F + 0.5F;
    const float g = f - 0.5F, square = g * g;
    const auto exact = six_taps(f), mirrored = six_taps(1 - static_cast<double>(f));
    const std::array even{VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_A),
                          VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_B),
                          VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_EVEN_C)};
    const std::array odd{VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_A),
                         VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_B),
                         VDVR_SIX_POLYNOMIAL(square, VDVR_SIX_ODD_C)};
    double error = 0;
    for (std::size_t n = 0; n < 3; ++n) {
      const float left = even[n] + g * odd[n], right = even[n] - g * odd[n];
      error += std::abs(double{left} - exact[n]) + std::abs(double{right} - exact[5 - n]);
      BOOST_TEST(std::abs(exact[n] - mirrored[5 - n]) <= tolerance::fp64_sum(20, 2));
    }
    BOOST_TEST(error <= six_tap_facts().rounding);
  }
}

}  // namespace
}  // namespace vdvr
