#define BOOST_TEST_MODULE plan_estimate
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/simulate.hpp"

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

// Sixth derivatives are small where sources are far, and grow with the eighth power of how near they are.
BOOST_AUTO_TEST_CASE(fourth_differences_are_sparse_where_that_costs_little_of_the_tolerance) {
  Device device;
  const auto differences = [&](double source, double tolerance, bool estimate = false) {
    SimulateOptions options;
    options.angles = 40;
    options.columns = options.rows = 24;
    options.arc_deg = 360;
    options.cone.emplace();
    options.cone->source_to_axis = options.cone->source_to_detector = source;
    CertifyOptions wanted;
    wanted.plan.estimate = estimate;
    return make_plan(device, simulate(sphere(8), options), {.relative = tolerance}, wanted).rates.differences;
  };
  BOOST_TEST(differences(300, 0.2) == sparse_differences);
  BOOST_TEST(differences(300, 0.2, true) == sparse_differences);
  BOOST_TEST(differences(30, 0.01) == dense_differences);
}

BOOST_AUTO_TEST_CASE(an_estimate_is_near_the_plan_and_cannot_be_built) {
  Device device;
  const ProjectionSet scan = large_scan();
  constexpr double asked = 1.0 / 20;  // of the plan, not of this test
  const Tolerance tolerance{.relative = asked};
  const Plan exact = make_plan(device, scan, tolerance, estimating(false)),
             estimate = make_plan(device, scan, tolerance, estimating(true));
  BOOST_TEST(!exact.estimated);
  BOOST_TEST(estimate.estimated);
  BOOST_TEST(!estimate.notes.empty());
  BOOST_TEST((estimate.rates == exact.rates));
  // The range is of the same samples, by four taps on columns at 4x in the one and by the rates' own taps in
  // the other: either end moves by what the two err at most.
  double cubic = 0;
  for (const Bound& b : exact.bounds)
    if (b.method == "curvature, cubic in u" && b.rate == 4) cubic = b.value;
  BOOST_TEST(cubic > 0);
  BOOST_TEST(std::abs(estimate.reference_range - exact.reference_range) <=
             2 * (cubic + exact.budget.projection.value + 2 * exact.budget.arithmetic.value));
  // All views of a sphere are alike, but for what rounding does to their sups: of the sum of these, which is
  // half of the range at least, no more than the rounding of F.
  const double arithmetic = exact.budget.arithmetic.value;
  BOOST_TEST(std::abs(estimate.budget.arithmetic.value - arithmetic) <=
             arithmetic * arithmetic / (0.5 * exact.reference_range));
  BOOST_CHECK_THROW(certify(device, scan, estimate, estimating(true)), InputError);
}
