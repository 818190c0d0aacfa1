// Certificates do not depend on the units of a scan: the same scan in other units, by powers of two, gives
// the same volume to the bit; what fp32 cannot hold is refused; what is no number is no bound.
#define BOOST_TEST_MODULE units
#include "host/volume/result_units.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/base/system/outward.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr {
namespace {

using attacks::device;
using testing::noise_scan;
using testing::simulated;

// The scan in other units: pitches and line integrals are numbers of 2^exponent times the size.
ProjectionSet in_other_units(ProjectionSet scan, const Units& units) {
  scan.geometry = to_world(scan.geometry, units);
  scale(scan.data, units.line);
  return scan;
}

Grid small_grid(const ProjectionSet& scan, const Index3& cells) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = {scan.geometry.pitch_u, scan.geometry.pitch_u, scan.geometry.pitch_v};
  for (std::size_t a = 0; a < 3; ++a) grid.origin[a] = -0.5 * grid.spacing[a] * static_cast<double>(cells[a]);
  return grid;
}

struct Built {
  Plan plan;
  BuildResult result;
};

Built built(const ProjectionSet& scan, const Grid& grid, double epsilon, const RateOptions& rates,
            const BuildOptions& options) {
  Plan plan = make_plan(device(), scan, grid, {}, rates, {epsilon, {}});
  BuildResult result = build(device(), scan, plan, options);
  return {std::move(plan), std::move(result)};
}

void check_same_terms(const Certificate& a, const Certificate& b, const Units& units) {
  const auto same = [&](double one, double other) { BOOST_TEST(to_world(one, units) == other); };
  BOOST_TEST(a.epsilon == b.epsilon);
  same(a.epsilon_abs, b.epsilon_abs);
  same(a.reference_range, b.reference_range);
  same(a.measured_max, b.measured_max);
  same(a.measured_total, b.measured_total);
  same(a.budget.gold.value, b.budget.gold.value);
  same(a.budget.projection.value, b.budget.projection.value);
  // Of doubles whose powers (std::pow) round otherwise at another scale, and beside which the samplers charge
  // underflow, which does not scale.
  const auto near = [&](double one, double other) {
    BOOST_TEST(std::abs(to_world(one, units) - other) <=
               tolerance::fp64_sum(16, other) + sampler_underflow(device().info()));
  };
  near(a.budget.arithmetic.value, b.budget.arithmetic.value);
  near(a.total_buffer, b.total_buffer);
  BOOST_TEST(a.holds_buffer == b.holds_buffer);
  for (std::size_t i = 0; i < 3; ++i) BOOST_TEST(to_world(a.worst_at, units)[i] == b.worst_at[i]);
}

void check_same_volume(const MixedVolume& a, const MixedVolume& b, const Units& units) {
  MixedVolume scaled = a;
  scale(scaled, units.density());
  BOOST_TEST((scaled.level == b.level));
  BOOST_TEST((scaled.tile == b.tile));
  BOOST_TEST(scaled.step == b.step);
  BOOST_TEST((scaled.base.f32 == b.base.f32));
  BOOST_TEST((scaled.base.u16 == b.base.u16));
  BOOST_TEST((scaled.base.u8 == b.base.u8));
  BOOST_REQUIRE(scaled.tiles.size() == b.tiles.size());
  for (const auto& [kind, block] : scaled.tiles) {
    const SampleBlock& other = b.tiles.at(kind);
    BOOST_TEST((block.f32 == other.f32));
    BOOST_TEST((block.u16 == other.u16));
    BOOST_TEST((block.u8 == other.u8));
    BOOST_TEST((block.offset == other.offset));
  }
}

const std::vector<Units> many_units{{-33, -33, 0}, {40, 40, 0},    {0, -40, 0},   {0, 40, 0},
                                    {0, 0, -100},  {0, 0, 100},    {-40, 0, 60},  {20, -20, -50},
                                    {-12, -9, 11}, {-40, 40, -80}, {-100, 100, 0}};

}  // namespace

BOOST_AUTO_TEST_CASE(the_same_scan_in_other_units_has_the_same_certificate) {
  ProjectionSet scan = simulated(sphere(6, 1), 17, 9, 32);
  const ProjectionSet noise = noise_scan(32, 9, 17);
  for (std::size_t i = 0; i < scan.data.size(); ++i) scan.data[i] += 0.3f * noise.data[i];
  const Grid grid = small_grid(scan, {8, 8, 4});
  BuildOptions options;
  options.roi = {-3, -4, -2, 4, 3, 1};
  const Built reference = built(scan, grid, 0.05, {}, options);
  BOOST_TEST(reference.result.certificate.holds_buffer);
  VerifyOptions exhaustive;
  exhaustive.exhaustive = true;
  const VerifyResult verified =
      verify(device(), scan, reference.result.volume, reference.result.certificate, exhaustive);
  BOOST_TEST(verified.holds);
  for (const Units& units : many_units) {
    BOOST_TEST_CONTEXT("units " << units.across << ", " << units.along << ", " << units.line) {
      BuildOptions other = options;
      other.roi = to_world(*options.roi, units);
      const Built b = built(in_other_units(scan, units), to_world(grid, units), 0.05, {}, other);
      check_same_volume(reference.result.volume, b.result.volume, units);
      check_same_terms(reference.result.certificate, b.result.certificate, units);
      BOOST_TEST((b.result.volume.grid.spacing == to_world(grid.spacing, units)));
      const VerifyResult v =
          verify(device(), in_other_units(scan, units), b.result.volume, b.result.certificate, exhaustive);
      BOOST_TEST(v.holds, v.failure);
      BOOST_TEST(v.cells_tested == verified.cells_tested);
      // Sups of derivatives are products of up to 16 doubles, powers among them.
      const double total = to_world(verified.measured_total, units);
      BOOST_TEST(std::abs(v.measured_total - total) <= tolerance::fp64_sum(16, total));
      BOOST_TEST(to_world(reference.plan.budget.grid.value, units) == b.plan.budget.grid.value);
    }
  }
}

BOOST_AUTO_TEST_CASE(absolute_tolerances_and_windows_are_in_the_units_of_the_user) {
  const ProjectionSet scan = noise_scan(24, 5, 15);
  const Grid grid = small_grid(scan, {6, 6, 4});
  const Plan plan = make_plan(device(), scan, grid, {}, {8, Interpolation::cubic, 4}, {{}, 0.05});
  BuildOptions options;
  options.window = {0.0, 0.2};
  const BuildResult reference = build(device(), scan, plan, options);
  const Units units{-30, -20, 10};
  const double density = std::ldexp(1.0, units.density());
  const ProjectionSet other = in_other_units(scan, units);
  const Plan other_plan = make_plan(device(), other, to_world(grid, units), {}, {8, Interpolation::cubic, 4},
                                    {{}, 0.05 * density});
  options.window = {0.0, 0.2 * density};
  const BuildResult b = build(device(), other, other_plan, options);
  check_same_volume(reference.volume, b.volume, units);
  check_same_terms(reference.certificate, b.certificate, units);
  BOOST_TEST((b.certificate.window == options.window));
}

BOOST_AUTO_TEST_CASE(reconstructions_scale_with_the_units) {
  const ProjectionSet scan = noise_scan(24, 5, 15);
  const Grid grid = small_grid(scan, {9, 8, 5});
  for (const int upsampling : {1, 4}) {
    ReconstructOptions options;
    options.upsampling = upsampling;
    const Volume reference = reconstruct(device(), scan, grid, options);
    for (const Units& units : many_units) {
      Volume scaled = reference;
      scale(scaled.samples, units.density());
      const Volume v = reconstruct(device(), in_other_units(scan, units), to_world(grid, units), options);
      BOOST_TEST((v.samples == scaled.samples));
      BOOST_TEST((v.grid.origin == to_world(grid.origin, units)));
    }
  }
}

BOOST_AUTO_TEST_CASE(what_float32_cannot_hold_is_refused) {
  const ProjectionSet scan = noise_scan(24, 5, 15);
  const auto says = [](const char* what) {
    return [what](const InputError& e) { return std::string(e.what()).find(what) != std::string::npos; };
  };
  const auto plan_of = [&](const Units& units) {
    const ProjectionSet other = in_other_units(scan, units);
    make_plan(device(), other, small_grid(other, {4, 4, 4}), {}, {}, {0.1, {}});
  };
  BOOST_CHECK_EXCEPTION(plan_of({-130, 0, 0}), InputError, says("the densities reach"));
  BOOST_CHECK_EXCEPTION(plan_of({130, 0, 0}), InputError, says("the densities reach"));
  BOOST_CHECK_EXCEPTION(plan_of({-4, 0, 127}), InputError, says("the densities reach"));
  BOOST_CHECK_EXCEPTION(plan_of({0, 0, -130}), InputError, says("the line integrals reach"));
  BOOST_CHECK_NO_THROW(plan_of({-110, 0, 0}));
}

// The sup of a derivative that overflows is no number to go on with: it once made R 0.
BOOST_AUTO_TEST_CASE(derivatives_beyond_float32_are_refused) {
  ProjectionSet scan = noise_scan(2, 1, 12);
  scan.geometry.pitch_u = 1e-25;  // second derivatives go with its third power
  const FilteredScan filtered = filter_projections(device().state(), scan, {});
  Upsampler upsampler(device().state(), filtered);
  BOOST_CHECK_THROW(field_sups(device().state(), upsampler, filtered), InputError);
}

// A slack that is no number was once taken for "not tested".
BOOST_AUTO_TEST_CASE(slack_that_is_no_number_is_infinite) {
  const ProjectionSet scan = noise_scan(12, 5, 13);
  attacks::Chain chain(scan);
  chain.sups.value = std::numeric_limits<double>::quiet_NaN();  // of which rounding is made
  const Grid grid = small_grid(scan, {4, 4, 4});
  const GoldSettings settings{grid, 2, 4, 8, Interpolation::cubic, {}};
  GoldStream stream(device().state(), chain.filtered, chain.sups, settings);
  const Volume base =
      reconstruct_field(device().state(), chain.filtered, chain.upsampler, grid, 8, Interpolation::cubic, {});
  const DeviceField field(device().state(), as_mixed(base, 2));
  const std::vector<std::uint8_t> near = stream.bricks_near_coverage();
  const opencl::DeviceArray<std::uint8_t> selected(device().state(), std::span<const std::uint8_t>(near),
                                                   "bricks");
  std::size_t tested = 0;
  stream.run(
      near,
      [&](GoldStream::Batch& batch) {
        for (const BrickMeasure& m : batch.measure(field, 0.1f, selected, true)) {
          BOOST_TEST(std::isinf(m.total));
          BOOST_TEST(m.violated != 0u);
          ++tested;
        }
      },
      {}, "test");
  BOOST_TEST(tested == near.size());
}

BOOST_AUTO_TEST_CASE(rounding_up_never_goes_below) {
  using limits = std::numeric_limits<float>;
  for (const double x : {0.0, 1e-60, 1e-40, 1.0, 1 / 3.0, 1e30, 3.4e38}) {
    BOOST_TEST(static_cast<double>(round_up(x)) >= x);
    BOOST_TEST(round_up(x) >= limits::min());
  }
  BOOST_TEST(round_up(0.5) == 0.5f);
  for (const double x :
       {1e39, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    BOOST_TEST(std::isinf(round_up(x)));
}

// Without units of their own, heights made the covered region thousands of rows high at such a ratio.
BOOST_AUTO_TEST_CASE(the_covered_region_ends_at_the_first_and_last_row_at_any_ratio_of_pitches) {
  for (const double ratio : {1e-12, 1e-6, 1.0, 1e6, 1e12}) {
    ParallelGeometry g = noise_scan(12, 5, 13).geometry;
    g.pitch_v = ratio;
    BOOST_TEST(is_covered(g, g.center, {0, 0, 2 * ratio}));
    BOOST_TEST(!is_covered(g, g.center, {0, 0, 2.001 * ratio}));
  }
}

}  // namespace vdvr
