#define BOOST_TEST_MODULE cosine_spectrum
#include "vdvr/expert/cosine_spectrum.hpp"

#include <boost/test/unit_test.hpp>
#include <random>

#include "tests/reference/cosine_series.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

using support::device;

// Axis by axis with the direct sums of the reference.
std::vector<double> direct(const std::vector<float>& values, const Index3& n) {
  std::vector<double> out(values.begin(), values.end());
  std::size_t stride = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto length = static_cast<std::size_t>(n[a]);
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (i / stride % length != 0) continue;
      std::vector<double> line;
      for (std::size_t j = 0; j < length; ++j) line.push_back(out[i + j * stride]);
      const auto coefficients = reference::cosine_coefficients(line);
      for (std::size_t j = 0; j < length; ++j) out[i + j * stride] = coefficients[j];
    }
    stride *= length;
  }
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(coefficients_match_direct_sums) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (const Index3& n : {Index3{1, 1, 1}, {67, 1, 1}, {65, 3, 1}, {5, 70, 1}, {17, 9, 33}, {2, 1, 129}}) {
    std::vector<float> values(static_cast<std::size_t>(n[0] * n[1] * n[2]));
    for (float& v : values) v = unit(random);
    const auto expected = direct(values, n);
    cosine_spectrum(device(), values, n);
    // Per axis entries of up to 2 / n in magnitude meet sums of up to n values: magnitudes grow by 2 an axis.
    const double rounding = tolerance::fp32_sum(n[0] + n[1] + n[2] + 3, 8);
    for (std::size_t i = 0; i < values.size(); ++i)
      BOOST_TEST(std::abs(static_cast<double>(values[i]) - expected[i]) <= rounding);
  }
}

BOOST_AUTO_TEST_CASE(a_wave_of_the_mirror_extension_has_one_coefficient) {
  constexpr std::size_t U = 24, V = 10;
  std::vector<float> values;
  for (std::size_t v = 0; v < V; ++v)
    for (std::size_t u = 0; u < U; ++u)
      values.push_back(
          static_cast<float>(3 * std::cos(reference::frequency(5, U) * (static_cast<double>(u) + 0.5)) *
                             std::cos(reference::frequency(2, V) * (static_cast<double>(v) + 0.5))));
  cosine_spectrum(device(), values, {U, V, 1});
  for (std::size_t i = 0; i < values.size(); ++i)
    BOOST_TEST(std::abs(static_cast<double>(values[i]) - (i == 2 * U + 5 ? 3.0 : 0.0)) <=
               tolerance::fp32_sum(U + V + 2, 12));
}

BOOST_AUTO_TEST_CASE(sizes_that_do_not_fit_the_samples_are_refused) {
  std::vector<float> values(6);
  BOOST_CHECK_THROW(cosine_spectrum(device(), values, {2, 2, 2}), InputError);
  BOOST_CHECK_THROW(cosine_spectrum(device(), values, {0, 3, 2}), InputError);
}
