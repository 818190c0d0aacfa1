// Builds that are asked for tolerances brick by brick: what was asked holds, by F itself, and costs only
// where it was asked.
#define BOOST_TEST_MODULE brick_refinement
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/scans.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/probe_sampler.hpp"

using namespace vdvr;
namespace support = vdvr::testing;

namespace {

constexpr float anything = std::numeric_limits<float>::infinity();
constexpr double finest = 0.02, everywhere = 0.3;  // of the range

struct Case {
  Device device{"", 0};
  ProjectionSet scan;
  Plan plan;

  explicit Case(double pitch = 1) {
    scan = support::simulated(shepp_logan(12), 33, 17, 40);
    scan.geometry.pitch_u = scan.geometry.pitch_v = pitch;
    PlanSettings settings;
    settings.forecast = false;
    plan = make_plan(device, scan, make_grid(scan.geometry, {}), {}, {}, {finest, {}}, settings);
  }
  [[nodiscard]] double range() const { return plan.reference_range; }
  BuildResult built(std::optional<Refinement> refinement) {
    BuildOptions options;
    options.refinement = std::move(refinement);
    return build(device, scan, plan, options);
  }
};

// Half of the bricks along x must be good; of the others nothing is asked.
std::vector<float> half_of(const MixedVolume& volume, double bound) {
  const Index3 n = volume.bricks();
  std::vector<float> asked(volume.level.size(), anything);
  for (std::size_t i = 0; i < asked.size(); ++i)
    if (static_cast<std::int64_t>(i) % n[0] < n[0] / 2) asked[i] = static_cast<float>(bound);
  return asked;
}

void check_by_exact_field(const Case& c, const BuildResult& result) {
  const ExactField exact(c.scan, {});
  const std::vector<float> bounds = brick_bounds(result.certificate, false);
  const MixedVolume& v = result.volume;
  const Index3 n = v.bricks();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Vec3> points;
  for (int k = 0; k < 40; ++k) {
    const double z =
        v.grid.origin[2] + part(random) * static_cast<double>(v.grid.cells[2]) * v.grid.spacing[2];
    for (int i = 0; i < 100; ++i) {
      const Vec3 p{v.grid.origin[0] + part(random) * static_cast<double>(v.grid.cells[0]) * v.grid.spacing[0],
                   v.grid.origin[1] + part(random) * static_cast<double>(v.grid.cells[1]) * v.grid.spacing[1],
                   z};
      if (exact.covered(p)) points.push_back(p);
    }
  }
  const std::vector<double> f = exact.at(points);
  BOOST_REQUIRE(points.size() > 1000u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Index3 b = brick_at(v, points[i]);
    const auto bound =
        static_cast<double>(bounds[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])]);
    BOOST_TEST(std::abs(static_cast<double>(sample_at(v, points[i])) - f[i]) <= bound);
  }
}

std::uint64_t samples_of(const MixedVolume& v) {
  std::uint64_t sum = v.base.size();
  for (const auto& [kind, block] : v.tiles) sum += block.size();
  return sum;
}

}  // namespace

BOOST_AUTO_TEST_CASE(bricks_are_brought_within_what_is_asked_and_no_others) {
  // A pitch that computes in units of its own, too.
  for (const double pitch : {1.0, 1e-4}) {
    Case c(pitch);
    const double bound = 1.5 * finest * c.range();
    int calls = 0;
    std::vector<float> first;
    const BuildResult result =
        c.built(Refinement{everywhere * c.range(),
                           {},
                           [&](const MixedVolume& volume, const Certificate& certificate) {
                             ++calls;
                             const auto bounds = brick_bounds(certificate, false);
                             if (calls == 1) first = bounds;
                             return calls == 1 ? half_of(volume, bound) : std::vector<float>{};
                           },
                           "half"});
    BOOST_TEST(calls == 2);
    const Certificate& certificate = result.certificate;
    BOOST_TEST(certificate.epsilon_abs == everywhere * c.range());
    BOOST_TEST(certificate.holds_buffer);
    const std::vector<float> asked = half_of(result.volume, bound), bounds = brick_bounds(certificate, false);
    double coarsest = 0;
    std::size_t refined = 0;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (!std::isfinite(bounds[i])) continue;
      coarsest = std::max(coarsest, static_cast<double>(bounds[i]));
      if (!std::isfinite(asked[i])) continue;
      BOOST_TEST(bounds[i] <= asked[i]);
      refined += first[i] > asked[i];
    }
    BOOST_TEST(refined > 0u);
    BOOST_TEST(coarsest > 2 * bound);  // the other half was left alone
    check_by_exact_field(c, result);
    BOOST_TEST(samples_of(result.volume) < samples_of(c.built({}).volume));
  }
}

BOOST_AUTO_TEST_CASE(what_is_asked_twice_or_beyond_the_plan_s_epsilon_ends) {
  Case c;
  int calls = 0;
  const BuildResult result = c.built(Refinement{everywhere * c.range(),
                                                {},
                                                [&](const MixedVolume& volume, const Certificate&) {
                                                  ++calls;
                                                  return half_of(volume, 1e-3 * finest * c.range());
                                                },
                                                "too much"});
  // Asked again it wants what it has, as far as the plan goes.
  BOOST_TEST(calls == 2);
  const std::vector<float> asked = half_of(result.volume, finest * c.range()),
                           bounds = brick_bounds(result.certificate, false);
  // Where little was reserved (for the buffer alone), the buffer may take more of the refined volume: as far
  // as the plan goes is short of that.
  const double more =
      probe_filters(c.device).weighs_in_fp32() ? 0 : result.certificate.budget.sampler.buffer.value;
  for (std::size_t i = 0; i < asked.size(); ++i)
    if (std::isfinite(bounds[i]))
      BOOST_TEST(static_cast<double>(bounds[i]) <= static_cast<double>(asked[i]) + more);
}

BOOST_AUTO_TEST_CASE(a_refinement_of_other_bricks_is_refused) {
  Case c;
  const auto wrong = [](const MixedVolume&, const Certificate&) { return std::vector<float>(3, 1.0f); };
  BOOST_CHECK_THROW(c.built(Refinement{everywhere * c.range(), {}, wrong, "wrong"}), InputError);
}
