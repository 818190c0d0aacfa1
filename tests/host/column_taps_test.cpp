// Six and eight weights between columns: their facts hold at every place, and are reached.
#define BOOST_TEST_MODULE column_taps
#include "host/certify/bounds/column_taps.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "shared/column_taps.h"
#include "tests/support/band_attack.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

std::vector<double> weights(const ColumnTaps& facts, double f) {
  return facts.taps == 6 ? six_taps(f) : eight_taps(f);
}

// From the first tap to a place f between the two in the middle.
double first(const ColumnTaps& facts, double f) { return 1 - 0.5 * facts.taps - f; }

const std::array<const ColumnTaps*, 2> both{&six_tap_facts(), &eight_tap_facts()};

BOOST_AUTO_TEST_CASE(no_wave_at_any_place_exceeds_the_error_and_one_reaches_it) {
  for (const ColumnTaps* facts : both) {
    double reached = 0;
    for (int w = 0; w <= 100; ++w) {
      const double kappa = facts->band * w / 100, bound = facts->error_at(kappa);
      double here = 0;
      for (int s = 0; s <= 777; ++s)
        here = std::max(here, wave_error(weights(*facts, s / 777.0), first(*facts, s / 777.0), 0, kappa));
      BOOST_TEST(here <= bound);
      BOOST_TEST(bound <= facts->error);
      reached = std::max(reached, here);
    }
    BOOST_TEST_MESSAGE(facts->taps << " taps: " << reached << " of " << facts->error);
    // 1 % of the band, and between steps of f: little to lose.
    BOOST_TEST(reached >= 0.95 * facts->error);
  }
  BOOST_TEST(six_tap_facts().error < 6.3e-7);    // printed: 6.1e-7
  BOOST_TEST(eight_tap_facts().error < 6.3e-8);  // a tenth
}

BOOST_AUTO_TEST_CASE(the_flattest_functions_stay_below_the_sup_constant_and_come_near) {
  for (const ColumnTaps* facts : both) {
    double reached = 0;
    for (const double f : {0.0, 0.0113, 0.1, 0.24, 0.37, 0.5, 0.81})
      reached =
          std::max(reached, FlatAttack(weights(*facts, f), first(*facts, f), facts->band).largest_quotient());
    BOOST_TEST_MESSAGE(facts->taps << " taps: " << reached << " of " << facts->sup);
    BOOST_TEST(reached <= facts->sup);
    BOOST_TEST(reached >= facts->sup / 3);
  }
}

BOOST_AUTO_TEST_CASE(norm_and_slope_hold_for_any_columns_and_are_reached) {
  for (const ColumnTaps* facts : both) {
    double norm = 0, slope = 0;
    for (int s = 0; s <= 1000; ++s) {
      const std::vector<double> w = weights(*facts, s / 1000.0);
      double sum = 0, magnitude = 0;
      for (const double x : w) {
        sum += x;
        magnitude += std::abs(x);
      }
      BOOST_TEST(std::abs(sum - 1) <= facts->error);
      norm = std::max(norm, magnitude);
    }
    // Columns of all patterns of rises and falls by 1; the slope between two near places.
    const int rises = facts->taps - 1;
    for (int pattern = 0; pattern < 1 << rises; ++pattern)
      for (int s = 0; s < 200; ++s) {
        const std::vector<double> a = weights(*facts, s / 200.0), b = weights(*facts, (s + 1) / 200.0);
        double column = 0, largest = 0, rise = 0;
        for (int i = 0; i <= rises; ++i) {
          rise += (b[static_cast<std::size_t>(i)] - a[static_cast<std::size_t>(i)]) * column;
          largest = std::max(largest, std::abs(column));
          if (i < rises) column += (pattern >> i) % 2 == 0 ? 1 : -1;
        }
        BOOST_TEST(std::abs(rise) * 200 <=
                   facts->slope + facts->slope_sum * largest + tolerance::fp64_sum(100, 2000));
        slope = std::max(slope, std::abs(rise) * 200);
      }
    BOOST_TEST(norm <= facts->norm);
    BOOST_TEST(norm >= 0.99 * facts->norm);
    BOOST_TEST(slope >= 0.95 * facts->slope);
  }
  BOOST_TEST(six_tap_facts().norm < 1.398);   // printed: 1.3975
  BOOST_TEST(six_tap_facts().slope < 1.515);  // printed: 1.51
}

// Coefficients of a pair of taps, evaluated as devices do.
// Sum of weights times h at the taps, less h(0), at a place f.
template <class Of>
std::complex<double> error_at_place(const ColumnTaps& facts, double f, const Of& h) {
  std::complex<double> sum = -h(0.0);
  const std::vector<double> w = weights(facts, f);
  for (std::size_t i = 0; i < w.size(); ++i) sum += w[i] * h(first(facts, f) + static_cast<double>(i));
  return sum;
}

BOOST_AUTO_TEST_CASE(moments_of_waves_stay_below_theirs) {
  for (const ColumnTaps* facts : both) {
    std::array<double, 2> reached{};
    for (int k = 0; k <= 100; ++k)
      for (int s = 0; s <= 200; ++s)
        for (int n = 1; n <= 2; ++n) {
          const auto h = [&](double y) {
            return std::pow(y, n) * std::polar(1.0, facts->band * k / 100 * y);
          };
          double& most = reached[static_cast<std::size_t>(n - 1)];
          most = std::max(most, std::abs(error_at_place(*facts, s / 200.0, h)));
        }
    for (std::size_t n = 0; n < 2; ++n) {
      BOOST_TEST_MESSAGE(facts->taps << " taps, moment " << n + 1 << ": " << reached[n] << " of "
                                     << facts->moments()[n]);
      BOOST_TEST(reached[n] <= facts->moments()[n]);
      BOOST_TEST(facts->moments()[n] < 0.02);  // magnitudes alone give .9 and more
    }
  }
}

BOOST_AUTO_TEST_CASE(waves_whose_scale_changes_err_no_more_than_is_charged) {
  for (const ColumnTaps* facts : both)
    for (const double tau : {1e-7, 1e-5, 1e-3, 0.01, 0.05})
      for (const double sign : {1.0, -1.0}) {
        double more = 0;
        for (int k = 0; k <= 50; ++k)
          for (int s = 0; s <= 100; ++s) {
            const double kappa = facts->band * k / 50, t = sign * tau;
            const auto still = [&](double y) { return std::polar(1.0, kappa * y); };
            const auto moving = [&](double y) {
              return std::polar(1 / ((1 + t * y) * (1 + t * y)), kappa * y / (1 + t * y));
            };
            more = std::max(more, std::abs(error_at_place(*facts, s / 100.0, moving) -
                                           error_at_place(*facts, s / 100.0, still)));
          }
        BOOST_TEST_MESSAGE(facts->taps << " taps, tau " << sign * tau << ": " << more << " of "
                                       << facts->error_of_wedge(sign * tau));
        BOOST_TEST(more <= facts->error_of_wedge(sign * tau) + tolerance::fp64_sum(10, 2));
      }
  BOOST_TEST(eight_tap_facts().error_of_wedge(0) == 0);
  BOOST_TEST(std::isinf(eight_tap_facts().error_of_wedge(0.2)));
}

template <std::size_t N>
void check_rounding(const ColumnTaps& facts, const std::array<std::array<float, 3>, N>& even,
                    const std::array<std::array<float, 3>, N>& odd) {
  const auto horner = [](float x, const std::array<float, 3>& c) {
    return VDVR_TAPS_HORNER(x, c[0], c[1], c[2]);
  };
  for (int s = 0; s <= 4096; ++s) {
    const float f = s % 2 == 0 ? static_cast<float>(s) / 4096 : std::sin(static_cast<float>(s)) * 0.5F + 0.5F;
    const float g = f - 0.5F, square = g * g;
    const std::vector<double> exact = weights(facts, f),
                              mirrored = weights(facts, 1 - static_cast<double>(f));
    double error = 0;
    for (std::size_t n = 0; n < N; ++n) {
      const float whole = horner(square, even[n]), slanted = g * horner(square, odd[n]);
      const float left = whole + slanted, right = whole - slanted;
      error += std::abs(double{left} - exact[n]) + std::abs(double{right} - exact[2 * N - 1 - n]);
      BOOST_TEST(std::abs(exact[n] - mirrored[2 * N - 1 - n]) <= tolerance::fp64_sum(20, 2));
    }
    BOOST_TEST(error <= facts.rounding);
  }
}

BOOST_AUTO_TEST_CASE(weights_in_fp32_err_by_their_rounding_and_mirror_each_other) {
  check_rounding<3>(six_tap_facts(), {{{VDVR_SIX_EVEN_A}, {VDVR_SIX_EVEN_B}, {VDVR_SIX_EVEN_C}}},
                    {{{VDVR_SIX_ODD_A}, {VDVR_SIX_ODD_B}, {VDVR_SIX_ODD_C}}});
  check_rounding<4>(eight_tap_facts(),
                    {{{VDVR_EIGHT_EVEN_A}, {VDVR_EIGHT_EVEN_B}, {VDVR_EIGHT_EVEN_C}, {VDVR_EIGHT_EVEN_D}}},
                    {{{VDVR_EIGHT_ODD_A}, {VDVR_EIGHT_ODD_B}, {VDVR_EIGHT_ODD_C}, {VDVR_EIGHT_ODD_D}}});
}

}  // namespace
}  // namespace vdvr
