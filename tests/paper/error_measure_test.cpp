// The measures of the paper's figures against values worked out by hand.
#define BOOST_TEST_MODULE error_measure
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include "apps/paper/error_measure.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using namespace vdvr::paper;

namespace {
// Sums in double over a handful of fp32 values of size 10: what is left to round.
const double kRounding = tolerance::fp64_sum(16, 100);
}  // namespace

BOOST_AUTO_TEST_CASE(errors_of_one_and_three_have_the_known_measures) {
  const std::vector<float> truth{0, 0, 2, 2}, values{1, 0, 2, 5};
  const ErrorMeasure m = measure_error(values, truth);
  BOOST_TEST(m.count == 4);
  BOOST_TEST(std::abs(m.rms - std::sqrt(10.0 / 4)) <= kRounding);
  BOOST_TEST(m.max == 3);
  BOOST_TEST(std::abs(m.mean_error - 1) <= kRounding);
}

BOOST_AUTO_TEST_CASE(offset_and_gain_do_not_count_once_normalised) {
  std::vector<float> truth, values;
  for (int i = 0; i < 8; ++i) {
    truth.push_back(static_cast<float>(i));
    values.push_back(static_cast<float>(2 * i) + 3);
  }
  const ErrorMeasure m = measure_error(values, truth);
  BOOST_TEST(m.rms_normalised <= kRounding);
  BOOST_TEST(std::abs(m.deviation_ratio - 2) <= kRounding);
  BOOST_TEST(m.rms > 6);
}

BOOST_AUTO_TEST_CASE(ninety_nine_of_a_hundred_values_lie_within_the_percentile) {
  std::vector<float> truth(200, 0), values(200);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = -static_cast<float>(i);
  BOOST_TEST(measure_error(values, truth).p99 == 197);  // 198 of 200 are at most 197
  BOOST_TEST(measure_error(values, truth).max == 199);
}

BOOST_AUTO_TEST_CASE(a_constant_is_normalised_by_its_mean_alone) {
  const std::vector<float> truth{1, 3}, values{5, 5};
  const ErrorMeasure m = measure_error(values, truth);
  BOOST_TEST(std::abs(m.rms_normalised - 1) <= kRounding);
}

BOOST_AUTO_TEST_CASE(nan_is_not_hidden) {
  const std::vector<float> truth{0, 0}, values{std::numeric_limits<float>::quiet_NaN(), 0};
  const ErrorMeasure m = measure_error(values, truth);
  BOOST_TEST(std::isnan(m.rms));
  BOOST_TEST(std::isnan(m.max));
  BOOST_TEST(std::isnan(m.p99));
}

BOOST_AUTO_TEST_CASE(lengths_that_differ_are_refused) {
  const std::vector<float> two{0, 0}, none, one{0};
  BOOST_CHECK_THROW(measure_error(two, one), InputError);
  BOOST_CHECK_THROW(measure_error(none, none), InputError);
}
