#define BOOST_TEST_MODULE plan_estimate
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "vdvr/certify.hpp"
#include "vdvr/error.hpp"
#include "vdvr/simulate.hpp"

using namespace vdvr;

namespace {

// More multiply-adds for sups than a plan that may estimate puts up with.
ProjectionSet large_scan() {
  SimulateOptions options;
  options.angles = 300;
  options.columns = 128;
  options.rows = 64;
  return simulate(sphere(24), options);
}

CertifyOptions estimating(bool estimate) {
  CertifyOptions options;
  options.grid.size = Index3{32, 32, 32};
  options.plan.estimate = estimate;
  return options;
}

}  // namespace

BOOST_AUTO_TEST_CASE(an_estimate_is_near_the_plan_and_cannot_be_built) {
  Device device;
  const ProjectionSet scan = large_scan();
  const Tolerance tolerance{.relative = 0.05};
  const Plan exact = make_plan(device, scan, tolerance, estimating(false)),
             estimate = make_plan(device, scan, tolerance, estimating(true));
  BOOST_TEST(!exact.estimated);
  BOOST_TEST(estimate.estimated);
  BOOST_TEST(!estimate.notes.empty());
  BOOST_TEST((estimate.rates == exact.rates));
  // The range is of the same samples, by another interpolation, whose bound is some per cent of the
  // tolerance.
  BOOST_TEST(std::abs(estimate.epsilon_abs - exact.epsilon_abs) <= 0.01 * exact.epsilon_abs);
  // All views of a sphere are alike.
  BOOST_TEST(std::abs(estimate.budget.arithmetic.value - exact.budget.arithmetic.value) <=
             0.05 * exact.budget.arithmetic.value);
  BOOST_CHECK_THROW(certify(device, scan, estimate, estimating(true)), InputError);
}
