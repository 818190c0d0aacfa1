#define BOOST_TEST_MODULE cosine_transform
#include "host/verify/witness/cosine_transform.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

constexpr std::int64_t together = CosineTransform::together;

// [m][series], one of which is a hundred times as large as the others.
std::vector<double> coefficients(std::int64_t terms, std::int64_t stride, std::int64_t largest) {
  std::mt19937 random(static_cast<unsigned>(terms + 1000 * largest));
  std::uniform_real_distribution<double> value(-1, 1);
  std::vector<double> a(static_cast<std::size_t>(terms * stride));
  for (std::int64_t m = 0; m < terms; ++m)
    for (std::int64_t s = 0; s < stride; ++s)
      a[static_cast<std::size_t>(m * stride + s)] = value(random) * (s == largest ? 1 : 0.01);
  return a;
}

struct Series {
  const std::vector<double>& a;
  std::int64_t terms, stride;

  [[nodiscard]] double at(std::int64_t m, std::int64_t series) const {
    return a[static_cast<std::size_t>(m * stride + series)];
  }
  /// At (n + 1/2) pi / places.
  [[nodiscard]] double value(std::int64_t series, std::int64_t n, std::int64_t places) const {
    long double sum = 0;
    for (std::int64_t m = 0; m < terms; ++m)
      sum += at(m, series) *
             std::cos(std::numbers::pi_v<long double> * static_cast<long double>((2 * n + 1) * m) /
                      static_cast<long double>(2 * places));
    return static_cast<double>(sum);
  }
  [[nodiscard]] double sup(std::int64_t places) const {
    double most = 0;
    for (std::int64_t s = 0; s < together; ++s)
      for (std::int64_t n = 0; n < places; ++n) most = std::max(most, std::abs(value(s, n, places)));
    return most;
  }
  /// Of both series that ride in one transform.
  [[nodiscard]] double magnitudes() const {
    double most = 0;
    for (std::int64_t s = 0; s < together / 2; ++s) {
      double sum = 0;
      for (std::int64_t m = 0; m < terms; ++m) sum += std::hypot(at(m, s), at(m, s + together / 2));
      most = std::max(most, sum);
    }
    return most;
  }
};

// Per stage, and where waves are put: a sum, a complex product (the root of five, Brent, Percival,
// Zimmermann) and its rounded factor, in magnitudes.
double rounding(const Series& f) {
  const double stages = std::ceil(std::log2(static_cast<double>(f.terms))) + 1;
  return 0x1p-53 * (2 + std::sqrt(5.0)) * stages * f.magnitudes();
}

}  // namespace

BOOST_AUTO_TEST_CASE(each_series_is_summed_at_each_of_its_places) {
  std::vector<double> work;
  for (const std::int64_t terms : {1, 2, 3, 11, 64, 171})
    for (const std::int64_t density : {1, 3, 12}) {
      const CosineTransform transform(terms, density);
      const std::int64_t places = transform.places(), stride = together + 3;
      BOOST_TEST(places >= density * terms);
      BOOST_TEST(places < (density + 2) * terms);
      for (std::int64_t large = 0; large<together; large += terms> 11 ? 5 : 1) {
        const auto a = coefficients(terms, stride, large);
        const Series f{a, terms, stride};
        BOOST_TEST(std::abs(transform.largest(a.data(), stride, work) - f.sup(places)) <=
                   tolerance::bound(rounding(f)));
        // Floats round once more; a unit that is a power of two rounds nothing.
        const std::int64_t out_stride = together + 1;
        std::vector<float> out(static_cast<std::size_t>(places * out_stride), -1.0f);
        transform.values(a.data(), stride, 0.25, out.data(), out_stride, work);
        std::int64_t wrong = 0;
        for (std::int64_t n = 0; n < places; ++n)
          for (std::int64_t s = 0; s < together; ++s) {
            const double value = 4 * f.value(s, n, places),
                         error = std::abs(
                             static_cast<double>(out[static_cast<std::size_t>(n * out_stride + s)]) - value);
            if (!(error <= tolerance::bound(4 * rounding(f) + 0x1.00001p-24 * std::abs(value)))) ++wrong;
          }
        BOOST_TEST(wrong == 0, terms << " terms, density " << density << ", series " << large);
      }
    }
}

BOOST_AUTO_TEST_CASE(no_series_rises_above_its_bound_and_some_rise_above_their_places) {
  std::vector<double> work;
  for (const std::int64_t terms : {5, 21, 85}) {
    const CosineTransform transform(terms, 3);
    double most = 0;
    for (std::int64_t large = 0; large < together; ++large) {
      const auto a = coefficients(terms, together, large);
      const double at_places = transform.largest(a.data(), together, work),
                   anywhere = Series{a, terms, together}.sup(64 * terms);
      BOOST_TEST(anywhere <= tolerance::bound(transform.rise() * at_places));
      most = std::max(most, anywhere / at_places);
    }
    BOOST_TEST(most > 1);
  }
  // One wave whose crests lie between the places where these are fewest: at 3 a term.
  const std::int64_t terms = 64;
  const CosineTransform transform(terms, 3);
  BOOST_TEST(transform.places() == 3 * terms);
  std::vector<double> wave(static_cast<std::size_t>(terms * together));
  for (std::int64_t s = 0; s < together; ++s) wave[static_cast<std::size_t>((terms - 1) * together + s)] = 1;
  const double at_places = transform.largest(wave.data(), together, work);
  BOOST_TEST(at_places < 1);
  BOOST_TEST(transform.rise() * at_places >= 1);
}
