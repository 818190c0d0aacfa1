// Rates are chosen for what each brick may err by, not for the smallest of all.
#define BOOST_TEST_MODULE rates_by_brick
#include <algorithm>
#include <boost/test/unit_test.hpp>

#include "host/volume/bricks.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"

using namespace vdvr;

namespace {

Plan planned(Device& device, const ProjectionSet& scan, double epsilon, std::vector<float> by_brick = {}) {
  CertifyOptions options;
  options.plan.forecast = false;
  options.plan.by_brick = std::move(by_brick);
  return make_plan(device, scan, Tolerance{{}, epsilon}, options);
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_slack_counts_against_its_own_bricks_tolerance) {
  Device device;
  const ProjectionSet scan = testing::noise_scan(33, 17, 51, 1);
  // Loose enough for the coarsest gold, of which it says what that errs.
  const Plan loose = planned(device, scan, 1e3);
  BOOST_TEST_REQUIRE(loose.rates.gold == 8);
  const double slack = loose.budget.gold.value + loose.budget.projection.value, epsilon = 1.2 * slack;
  const Plan strict = planned(device, scan, epsilon);
  BOOST_TEST(strict.rates.gold > 8);

  const auto bricks = static_cast<std::size_t>(Bricks(loose.grid, loose.layout.granularity).size());
  const auto tolerance = static_cast<float>(epsilon);
  const auto all = [&](float one) { return std::vector<float>(bricks, one); };
  const Plan alike = planned(device, scan, epsilon, all(tolerance));
  BOOST_TEST((alike.rates == strict.rates));
  BOOST_TEST(alike.settings.by_brick.empty());
  // The strict one is a corner of the grid, where nothing is covered.
  std::vector<float> few = all(4 * tolerance);
  few.front() = tolerance;
  BOOST_TEST(planned(device, scan, epsilon, few).rates.gold == 8);
  // Strict where the trial looks: in the middle.
  std::vector<float> middle = all(4 * tolerance);
  const Bricks of(loose.grid, loose.layout.granularity);
  const Index3 n = of.along();
  for (std::int64_t z = n[2] / 4; z < n[2] - n[2] / 4; ++z)
    for (std::int64_t y = n[1] / 4; y < n[1] - n[1] / 4; ++y)
      for (std::int64_t x = n[0] / 4; x < n[0] - n[0] / 4; ++x)
        middle[static_cast<std::size_t>(of.number({x, y, z}))] = tolerance;
  BOOST_TEST(planned(device, scan, epsilon, middle).rates.gold > 8);
}

BOOST_AUTO_TEST_CASE(tolerances_of_other_bricks_or_below_the_plans_are_refused) {
  Device device;
  const ProjectionSet scan = testing::noise_scan(33, 17, 51, 1);
  const Plan loose = planned(device, scan, 1);
  const auto bricks = static_cast<std::size_t>(Bricks(loose.grid, loose.layout.granularity).size());
  BOOST_CHECK_THROW(planned(device, scan, 1, std::vector<float>(bricks + 1, 1.0f)), InputError);
  BOOST_CHECK_THROW(planned(device, scan, 1, std::vector<float>(bricks, 0.5f)), InputError);
}
