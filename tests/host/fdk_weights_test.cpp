// Weights of rays that are measured twice add up to two, whatever the geometry.
#define BOOST_TEST_MODULE fdk_weights
#include "host/field/fdk/fdk_weights.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numeric>

#include "tests/support/cone_scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;
// A dozen operations of double precision, of values up to a few hundred.
const double same = tolerance::fp64_sum(50, 1000);

ConeShape short_scan() {
  ConeShape s;
  s.views = 240;
  // 180 degrees, the fan and a little more, without the gap after the last view.
  s.arc_deg = (180 + 2 * std::atan(12 / 60.0) * 180 / pi + 14) * 240 / 239;
  return s;
}

}  // namespace

BOOST_AUTO_TEST_CASE(views_of_a_turn_weigh_pi_together) {
  for (const std::int64_t views : {7, 24, 361}) {
    ConeShape s;
    s.views = views;
    const FdkWeights w(cone_of(s), s.columns, s.rows);
    double sum = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(views); ++k) sum += w.of_view(k);
    BOOST_TEST(std::abs(sum - pi) <= same);
    BOOST_TEST(w.redundancy(3, 5.0) == 1);
  }
}

BOOST_AUTO_TEST_CASE(the_cosine_is_that_of_the_closed_form) {
  const ConeShape s;
  const FdkWeights w(cone_of(s), s.columns, s.rows);
  for (const double u : {0.0, 7.5, 23.0})
    for (const double v : {0.0, 4.0, 19.0}) {
      const double a = u - 11.5, b = v - 9.5;
      BOOST_TEST(std::abs(w.cosine(5, u, v) - 60 / std::sqrt(3600 + a * a + b * b)) <= same);
    }
}

// The ray from b at the fan angle g comes back from b + pi - 2 g at -g.
BOOST_AUTO_TEST_CASE(a_ray_of_a_short_scan_and_its_opposite_weigh_two) {
  const ConeShape s = short_scan();
  const ConeGeometry cone = cone_of(s);
  BOOST_TEST((cone.redundancy == Redundancy::short_scan));
  const FdkWeights w(cone, s.columns, s.rows);
  const double step = s.arc_deg / static_cast<double>(s.views) * pi / 180,
               arc = step * static_cast<double>(s.views - 1);
  int twice = 0;
  for (std::int64_t k = 0; k < s.views; ++k)
    for (std::int64_t other = 0; other < s.views; ++other) {
      const double b = step * static_cast<double>(k), c = step * static_cast<double>(other),
                   fan = 0.5 * (b + pi - c);  // of the ray whose opposite is seen from c
      const double column = 60 * std::tan(fan) + 11.5, opposite = 60 * std::tan(-fan) + 11.5;
      if (column < 0 || column > 23) continue;
      ++twice;
      BOOST_TEST(std::abs(w.redundancy(static_cast<std::size_t>(k), column) +
                          w.redundancy(static_cast<std::size_t>(other), opposite) - 2) <= 1e-9);
    }
  BOOST_TEST(twice > 1000);
  // Both ends weigh nothing, so that what lies beyond them does not matter.
  for (const double column : {0.0, 11.5, 23.0}) {
    BOOST_TEST(w.redundancy(0, column) <= same);
    BOOST_TEST(w.redundancy(static_cast<std::size_t>(s.views - 1), column) <= 1e-9);
  }
  BOOST_TEST(arc > pi);
}

BOOST_AUTO_TEST_CASE(both_sides_of_a_displaced_detector_weigh_two) {
  for (const double shift : {6.0, -5.0}) {
    ConeShape s;
    s.shift = shift;
    const ConeGeometry cone = cone_of(s);
    BOOST_TEST((cone.redundancy == Redundancy::displaced));
    const FdkWeights w(cone, s.columns, s.rows);
    const double center = 11.5 - shift;
    for (double away = 0; away <= 11.5 + std::abs(shift); away += 0.25)
      BOOST_TEST(std::abs(w.redundancy(2, center + away) + w.redundancy(2, center - away) - 2) <= same);
    // Symmetric with its columns of zeros.
    const double wide = static_cast<double>(s.columns + w.pad_before() + w.pad_after());
    BOOST_TEST(std::abs(center + static_cast<double>(w.pad_before()) - 0.5 * (wide - 1)) <= 0.5 + same);
    BOOST_TEST((shift > 0 ? w.pad_before() : w.pad_after()) > 0);
  }
}

BOOST_AUTO_TEST_CASE(scans_that_lack_rays_are_refused) {
  ConeShape s = short_scan();
  s.arc_deg = 190;
  BOOST_CHECK_THROW(FdkWeights(cone_of(s), s.columns, s.rows), InputError);
  s = short_scan();
  s.shift = 6;
  ConeGeometry cone = cone_of(s);
  BOOST_CHECK_THROW(FdkWeights(cone, s.columns, s.rows), InputError);
  s = ConeShape{};
  s.shift = 20;
  BOOST_CHECK_THROW(FdkWeights(cone_of(s), s.columns, s.rows), InputError);
  s = ConeShape{};
  s.views = 1;
  BOOST_CHECK_THROW(FdkWeights(cone_of(s), s.columns, s.rows), InputError);
}
