// The standard deviation of F: against its definition, against repeated scans; and what is found of a scan's
// noise, against what was put in.
#define BOOST_TEST_MODULE noise
#include "vdvr/expert/noise.hpp"

#include <boost/test/unit_test.hpp>

#include "host/field/noise/field_variance.hpp"
#include "host/field/noise/split_of_views.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "tests/reference/field_variance.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/device.hpp"
#include "tests/support/photons.hpp"
#include "tests/support/repeated_scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/extend_rows.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;

// `noise_test -- long`: as many as the method asks for, of all filters.
bool is_long() { return boost::unit_test::framework::master_test_suite().argc > 1; }

Agreement counted_often(const ProjectionSet& ideal, const FieldOptions& field, const Grid& grid, int scans,
                        double photons) {
  LineIntegralNoise noise;
  noise.photon = {static_cast<float>(1 / photons)};
  return repeated([&](unsigned seed) { return counted(ideal, photons, seed); }, ideal, noise, field, grid,
                  scans);
}

// How far sigma of one variance may be found from itself: four and a half standard errors. The median of n
// squares of normal variates has one of 1 / (2 f(m) m sqrt(n)) = 2.33 / sqrt(n), f the density of chi^2 with
// one degree of freedom at its median m; samples under one 3 x 3 stencil count once; sigma has half of it.
double told_within(const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  return 4.5 * 0.5 * 2.33 / std::sqrt(static_cast<double>((g.views() - 2) * g.rows * (g.columns - 2)) / 9);
}

}  // namespace

BOOST_AUTO_TEST_CASE(squared_kernel_of_ram_lak_sums_to_a_twelfth) {
  const SquaredFilter filter({});
  // g(t) = sinc(t) / 2 - sinc(t / 2)^2 / 4.
  const auto sinc = [](double t) { return t == 0 ? 1 : std::sin(pi * t) / (pi * t); };
  const auto squared = [&](double t) { return std::pow(sinc(t) / 2 - sinc(t / 2) * sinc(t / 2) / 4, 2); };
  for (std::int64_t m = 0; m <= 24; ++m)
    BOOST_TEST(std::abs(filter.at(m) - squared(0.5 * static_cast<double>(m))) <=
               tolerance::fp64_sum(1000, 1));
  // A row of many columns: one twelfth of a constant variance at columns and between them.
  const std::vector<double> even(4001, 1.0);
  const std::vector<double> blocks = SquaredFilter::blocks_of(even);
  // Beyond 12 columns at columns: 2 / (pi^4 t^4) / 2 summed; beyond 2000 between them: 1 / (2 pi^2 t^2).
  const double at_columns = 1 / (3 * std::pow(pi, 4) * std::pow(11.0, 3)), between = 1 / (2 * pi * pi * 2000);
  BOOST_TEST(std::abs(filter(even, blocks, 4000) - 1.0 / 12) <= at_columns);
  // A block of 8 at its middle: 6 / t^4 * 8^3 / 24 of 1 / (2 pi)^2, from 16 columns on, on both sides.
  double of_blocks = 0;
  for (double t = 16; t < 2000; t += 8) of_blocks += 2 * 128 / std::pow(t, 4) / (4 * pi * pi);
  BOOST_TEST(std::abs(filter(even, blocks, 4001) - 1.0 / 12) <= at_columns + 2 * between + of_blocks);
  // Far from a single pixel, between columns: 1 / (2 pi t)^2 but for a term of its square, to a block's
  // width.
  std::vector<double> one(401, 0.0);
  one[10] = 1;
  const double t = 200.5 - 10, far = filter(one, SquaredFilter::blocks_of(one), 401);
  // A block's width, and the term of g beside sinc / 2, whose square is left out: sinc(t / 2)^2 / 4 over
  // sinc(t) / 2 is 2 / (pi t) there, twice in the square.
  BOOST_TEST(std::abs(far / squared(t) - 1) <= 2 * 4 / t + 2 * 2 / (pi * t));
}

BOOST_AUTO_TEST_CASE(sigma_of_parallel_beam_is_that_of_its_definition) {
  for (const ScanShape& s :
       {ScanShape{"odd", 37, 5, 41}, ScanShape{"two rows, off the middle", 30, 2, 40, 180, 3.3},
        ScanShape{"full turn, uneven", 50, 4, 33, 360, 0, 0.8}}) {
    const ProjectionSet scan = ideal_scan(s);
    LineIntegralNoise noise;
    noise.constant = 1e-5;
    noise.photon = {1e-4f};
    noise.read = {2e-6f};
    const double half_height = 0.5 * static_cast<double>(s.rows - 1);
    const Grid grid = some_places(0.4 * static_cast<double>(s.columns), -half_height, half_height - 0.3);
    const Volume sigma = noise_of_field(support::device(), scan, {}, noise, grid);
    const PixelVariance variance(noise);
    const std::vector<double> weights = view_weights(scan.geometry.theta_rad).weight;
    const Index3 n = grid.samples();
    for (std::int64_t i = 0; i < grid.sample_count(); ++i) {
      const Vec3 p = grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]});
      if (!is_covered(scan.geometry, scan.geometry.center, p)) continue;
      const double expected = std::sqrt(reference::field_variance(
          scan.geometry, weights, p, [&](std::int64_t k, std::int64_t r, std::int64_t c) {
            const std::int64_t pixel = r * scan.geometry.columns + c;
            return variance(static_cast<std::size_t>(pixel),
                            static_cast<double>(scan.data[static_cast<std::size_t>(
                                k * scan.geometry.rows * scan.geometry.columns + pixel)]));
          }));
      // Half columns are joined by lines, and edges of the detector filter as its middle does: an estimate.
      BOOST_TEST_INFO(s.name << " at " << p[0] << "," << p[1] << "," << p[2]);
      BOOST_TEST(std::abs(static_cast<double>(sigma.samples[static_cast<std::size_t>(i)]) / expected - 1) <=
                 promised);
    }
  }
}

BOOST_AUTO_TEST_CASE(sigma_is_that_of_repeated_scans) {
  const int scans = is_long() ? 200 : 60;
  std::vector<ScanShape> shapes{{"half turn", 40, 4, 41},
                                {"full turn, off the middle", 48, 2, 41, 360, -2.7}};
  if (is_long()) shapes.push_back({"uneven", 50, 4, 41, 180, 1.2, 0.8});
  for (const ScanShape& s : shapes) {
    const double half_height = 0.5 * static_cast<double>(s.rows - 1);
    for (const auto& [filter, name] : ramp_windows) {
      FieldOptions field;
      field.filter = filter;
      if (!is_long() && filter != RampWindow::ram_lak && filter != RampWindow::hann) continue;
      check(counted_often(ideal_scan(s), field,
                          some_places(0.4 * static_cast<double>(s.columns), -half_height, half_height - 0.4),
                          scans, 5000),
            scans, s.name);
    }
  }
}

BOOST_AUTO_TEST_CASE(sigma_of_cone_beam_is_that_of_repeated_scans) {
  const int scans = is_long() ? 200 : 60;
  for (const auto& [name, shape] : cone_orbits()) {
    ProjectionSet scan = noisy_cone(shape);
    // A smooth object's line integrals, as the rays of parallel beam see it: only v follows from them.
    const ParallelGeometry& g = scan.geometry;
    for (std::size_t i = 0; i < scan.data.size(); ++i) {
      const double u = static_cast<double>(static_cast<std::int64_t>(i) % g.columns) - g.center;
      scan.data[i] = static_cast<float>(1.5 * std::exp(-u * u / 100));
    }
    check(counted_often(scan, {}, some_places(10, -2, 2.3), scans, 20000), scans, name);
  }
}

BOOST_AUTO_TEST_CASE(sigma_keeps_its_value_in_every_unit) {
  const ScanShape s{"half turn", 40, 4, 41};
  const ProjectionSet scan = ideal_scan(s);
  LineIntegralNoise noise;
  noise.photon = {1e-4f};
  const Grid grid = some_places(15, -1.5, 1.2);
  const Volume sigma = noise_of_field(support::device(), scan, {}, noise, grid);
  for (const int exponent : {-30, 25}) {
    ProjectionSet other = scan;
    Grid there = grid;
    other.geometry.pitch_u = other.geometry.pitch_v = std::ldexp(1.0, exponent);
    for (std::size_t a = 0; a < 3; ++a) {
      there.origin[a] = std::ldexp(grid.origin[a], exponent);
      there.spacing[a] = std::ldexp(grid.spacing[a], exponent);
    }
    const Volume in_unit = noise_of_field(support::device(), other, {}, noise, there);
    for (std::size_t i = 0; i < sigma.samples.size(); ++i)
      BOOST_TEST(std::ldexp(in_unit.samples[i], exponent) == sigma.samples[i]);
  }
}

BOOST_AUTO_TEST_CASE(photons_are_found_from_projections_alone) {
  const ProjectionSet ideal = ideal_scan({"smooth", 128, 6, 128});
  for (const double photons : {500.0, 5000.0, 50000.0}) {
    std::string why;
    const auto found = scan_noise(counted(ideal, photons, 5), {}, {}, &why);
    BOOST_TEST_REQUIRE(found.has_value(), why);
    BOOST_TEST_INFO(found->words);
    // The method's promise for smooth objects.
    BOOST_TEST(std::abs(found->model.photons / photons - 1) <= 0.1);
    BOOST_TEST_INFO(found->words);
    BOOST_TEST(found->agreed);
  }
}

BOOST_AUTO_TEST_CASE(noise_is_not_invented) {
  std::string why;
  // Constant data differ nowhere.
  ProjectionSet still = empty_scan(40, 4, 40);
  BOOST_TEST(!scan_noise(still, {}, {}, &why).has_value());
  // Two views tell nothing.
  ProjectionSet two = noise_scan(2, 4, 40);
  BOOST_TEST(!scan_noise(two, {}, {}, &why).has_value());
  BOOST_TEST(why.find("too few") != std::string::npos);
  // A few counts a pixel.
  const auto few = scan_noise(counted(ideal_scan({"smooth", 64, 4, 64}), 12, 5), {}, {}, &why);
  BOOST_TEST(!few.has_value());
  BOOST_TEST(why.find("counted fewer than") != std::string::npos);
  BOOST_CHECK_THROW(scan_noise(still, {.photons = -3}), InputError);
  BOOST_CHECK_THROW(scan_noise(still, {.photons = 1000, .sigma_p = 0.1}), InputError);
  BOOST_TEST(scan_noise(still, {.photons = 1000})->model.photons == 1000);
}

BOOST_AUTO_TEST_CASE(splitting_the_views_finds_the_same_sigma) {
  const ProjectionSet ideal = ideal_scan({"smooth", 400, 4, 65});
  const double photons = 3000;
  const ProjectionSet scan = counted(ideal, photons, 9);
  const auto noise = scan_noise(scan, {.photons = photons});
  const auto split = split_of_views(support::device(), scan, {}, noise->model);
  BOOST_TEST_REQUIRE(split.has_value());
  BOOST_TEST(split->resolved);
  // Within 1.5 % for alternating signs, and four standard errors of a mean over that many samples.
  BOOST_TEST(std::abs(split->ratio() - 1) <=
             0.015 + 4 / std::sqrt(2.0 * static_cast<double>(split->samples)) + promised);
  // Opposite views have one sign.
  const ProjectionSet turn = ideal_scan({"turn", 60, 2, 33, 360});
  const std::vector<int> signs = alternating_signs(turn);
  for (std::size_t k = 0; k < 30; ++k) BOOST_TEST(signs[k] == signs[k + 30]);
  BOOST_TEST(signs[0] != signs[1]);
}

BOOST_AUTO_TEST_CASE(integrals_that_are_no_logarithms_have_one_variance) {
  const ProjectionSet ideal = ideal_scan({"smooth", 128, 6, 128});
  for (const double scale : {1e-9, 2e5}) {
    constexpr double sigma = 0.02;
    ProjectionSet scan = ideal;
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, sigma);
    for (float& p : scan.data) p = static_cast<float>(scale * (static_cast<double>(p) + normal(random)));
    std::string why;
    const auto found = scan_noise(scan, {}, {}, &why);
    BOOST_TEST_REQUIRE(found.has_value(), why);
    BOOST_TEST_INFO(found->words);
    BOOST_TEST(std::abs(std::sqrt(found->model.constant) / (scale * sigma) - 1) <= told_within(scan));
    BOOST_TEST(found->agreed);
    BOOST_TEST(found->model.photons == 0);
    for (std::size_t i = 0; i < scan.data.size(); ++i)
      scan.data[i] = static_cast<float>(scale * static_cast<double>(ideal.data[i]));
    BOOST_TEST(!scan_noise(scan, {}, {}, &why).has_value());
    BOOST_TEST(why.find("no noise") != std::string::npos);
  }
}

// Noise of one variance where p goes to 12, e^p to 160,000: as counts the sources differ by far more
// than 1.5.
BOOST_AUTO_TEST_CASE(noise_that_does_not_grow_with_the_integral_is_none_of_counts) {
  ProjectionSet scan = ideal_scan({"smooth", 128, 6, 128});
  const float largest = *std::max_element(scan.data.begin(), scan.data.end());
  constexpr double sigma = 0.05;
  std::mt19937 random(6);
  std::normal_distribution<double> normal(0, sigma);
  for (float& p : scan.data) p = static_cast<float>(12 * static_cast<double>(p / largest) + normal(random));
  const auto found = scan_noise(scan);
  BOOST_TEST_REQUIRE(found.has_value());
  BOOST_TEST_INFO(found->words);
  BOOST_TEST(found->agreed);
  BOOST_TEST(std::abs(std::sqrt(found->model.constant) / sigma - 1) <= told_within(scan));
  BOOST_TEST(found->model.photon.empty());
  // And counts stay counts.
  const auto of_counts = scan_noise(counted(ideal_scan({"smooth", 128, 6, 128}), 3000, 4));
  BOOST_TEST_REQUIRE(of_counts.has_value());
  BOOST_TEST(of_counts->model.photons > 0);
}

// Weights multiply variances by their squares; padded samples, copies of others, are left out.
BOOST_AUTO_TEST_CASE(sigma_of_longer_rows_is_the_spread_of_repeated_scans) {
  constexpr double photons = 5000;
  constexpr int scans = 60;
  for (const auto& [name, half, padding] : {std::tuple{"half acquisition", true, Padding::none},
                                            {"half acquisition, padded", true, Padding::edge},
                                            {"padded", false, Padding::mirror}}) {
    SimulateOptions o;
    o.angles = 49;
    o.arc_deg = 360;
    o.rows = 2;
    o.columns = 40;
    o.detector_offset = half ? 10 : 0;
    o.band_limited = false;
    const ProjectionSet measured = simulate(smooth_object(half ? 28 : 40), o);
    const auto longer = [half = half, padding = padding](ProjectionSet scan) {
      static_cast<void>(extend_rows(scan, testing::wanted(half, padding)));
      return scan;
    };
    LineIntegralNoise noise;
    noise.photon = {static_cast<float>(1 / photons)};
    const Agreement found =
        repeated([&](unsigned seed) { return longer(counted(measured, photons, seed)); }, longer(measured),
                 noise, {}, some_places(half ? 26 : 16, -0.5, 0.5), scans);
    check(found, scans, name);
  }
}

BOOST_AUTO_TEST_CASE(noise_of_longer_rows_is_that_of_what_was_measured) {
  SimulateOptions o;
  o.angles = 180;
  o.arc_deg = 360;
  o.rows = 8;
  o.columns = 64;
  o.detector_offset = 16;
  o.band_limited = false;
  const ProjectionSet measured = counted(simulate(smooth_object(46), o), 5000, 3);
  ProjectionSet longer = measured;
  static_cast<void>(extend_rows(longer, testing::wanted({}, Padding::edge)));
  const auto own = scan_noise(measured, {}), found = scan_noise(longer, {});
  BOOST_REQUIRE(own.has_value());
  BOOST_REQUIRE(found.has_value());
  // Rows come back within two roundings of float32. A second difference of samples, whose weights add to 4 in
  // magnitude, is off by eight of them, and has sqrt(6) times the noise of a sample, at least 1 / sqrt(5000);
  // the median of squares is off by twice that share.
  double largest = 0;
  for (const float p : measured.data) largest = std::max(largest, std::abs(static_cast<double>(p)));
  const double off = 2 * 8 * 0x1p-24 * largest / std::sqrt(6.0 / 5000);
  BOOST_TEST_INFO(found->model.photons / own->model.photons - 1);
  BOOST_TEST(std::abs(found->model.photons / own->model.photons - 1) <= off);
}
