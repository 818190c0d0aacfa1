// What averaged flats add to the variance of F, against its definition: an error of each column, the same in
// all views.
#define BOOST_TEST_MODULE ring_noise
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <numbers>

#include "tests/support/scans.hpp"
#include "vdvr/expert/noise.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;

double kernel(double t) {
  const auto sinc = [](double x) { return x == 0 ? 1 : std::sin(pi * x) / (pi * x); };
  return sinc(t) / 2 - sinc(t / 2) * sinc(t / 2) / 4;
}

// The variance at a point, by errors of variance 1 in each column, over F's by the same variance in each
// pixel.
double by_definition(const ProjectionSet& scan, double x, double y) {
  const ParallelGeometry& g = scan.geometry;
  double of_rings = 0, of_pixels = 0;
  const double weight = pi / static_cast<double>(g.views());
  for (std::int64_t i = 0; i < g.columns; ++i) {
    double sum = 0;
    for (const double theta : g.theta_rad) {
      const double h = kernel(x * std::cos(theta) + y * std::sin(theta) + g.center - static_cast<double>(i));
      sum += weight * h;
      of_pixels += weight * h * weight * h;
    }
    of_rings += sum * sum;
  }
  return of_rings / of_pixels;
}

// In the mean over places at that distance, and within half a column of it.
double on_circle(const ProjectionSet& scan, double r) {
  constexpr int around = 9, across = 4;
  double sum = 0;
  for (int a = 0; a < around; ++a)
    for (int d = 0; d < across; ++d) {
      const double phi = 2 * pi * (a + 0.3) / around, at = r + (d + 0.5) / across - 0.5;
      sum += by_definition(scan, at * std::cos(phi), at * std::sin(phi));
    }
  return sum / (around * across);
}

}  // namespace

BOOST_AUTO_TEST_CASE(rings_are_those_of_the_definition) {
  for (const double arc : {180.0, 360.0})
    for (const std::int64_t views : {180, 450}) {
      // Line integrals of 0: a view's pixel counts what a flat's does.
      const ProjectionSet scan = vdvr::testing::empty_scan(views, 1, 129, arc);
      const auto rings = ring_noise(scan, 1);
      BOOST_REQUIRE(rings.has_value());
      BOOST_TEST_CONTEXT(views << " views over " << arc) {
        // What is promised of sigma, 3 %, is 6 % of a variance.
        for (const double r : {6.0, 15.0, 35.0}) {
          BOOST_TEST_INFO("r " << r << ": " << on_circle(scan, r) << ", " << rings->at(r));
          BOOST_TEST(std::abs(rings->at(r) / on_circle(scan, r) - 1) < 0.06);
        }
        BOOST_TEST(std::abs(rings->at(0) / by_definition(scan, 0, 0) - 1) < 0.06);
      }
    }
}

BOOST_AUTO_TEST_CASE(more_flats_make_fainter_rings) {
  ProjectionSet scan = vdvr::testing::empty_scan(180, 1, 65);
  const RingNoise one = *ring_noise(scan, 1), ten = *ring_noise(scan, 10);
  BOOST_TEST(std::abs(ten.at_axis * 10 / one.at_axis - 1) < 1e-12);
  BOOST_TEST(std::abs(ten.radius() * 10 / one.radius() - 1) < 1e-12);
  // Where a view counts half of what a flat does its own noise is twice as large.
  for (float& p : scan.data) p = static_cast<float>(std::log(2.0));
  BOOST_TEST(std::abs(ring_noise(scan, 1)->at_axis * 2 / one.at_axis - 1) < 1e-6);
  BOOST_TEST(!ring_noise(scan, 0).has_value());
  scan.cone.emplace();
  BOOST_TEST(!ring_noise(scan, 10).has_value());
}
