// Samples that moved between views (docs/geometry.md, "Shifts by view"): F against the object and against
// itself, what is covered, common heights against a direct series and verify's own, certificates, and wrong
// shifts, which verify finds.
#define BOOST_TEST_MODULE shifts
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/scan/prepare/heights.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/smooth_balls.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/rows_to_verify.hpp"
#include "vdvr/expert/verify.hpp"

using namespace vdvr;
using support::device;
using vdvr::testing::noise_scan;
using vdvr::testing::off_by;
using vdvr::testing::smooth_balls;

namespace {

// Also where views share few heights.
void to_common_heights(ProjectionSet& scan) {
  Preparation wanted;
  wanted.heights = Heights::common;
  bring_to_heights(scan, wanted, 0, {});
}

std::vector<std::array<double, 2>> drawn(std::int64_t views, double along_u, double along_v,
                                         unsigned seed = 5) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-1, 1);
  std::vector<std::array<double, 2>> shifts;
  for (std::int64_t k = 0; k < views; ++k)
    shifts.push_back({along_u * share(random), along_v * share(random)});
  return shifts;
}

ProjectionSet simulated(const std::vector<std::array<double, 2>>& shifts, int views = 90) {
  SimulateOptions o;
  o.angles = views;
  o.columns = 57;
  o.rows = 25;
  o.shifts = shifts;
  ProjectionSet scan = simulate(smooth_balls(), o);
  to_common_heights(scan);
  return scan;
}

ProjectionSet shifted_noise(std::int64_t views, std::int64_t rows, std::int64_t columns, double u, double v,
                            unsigned seed = 3) {
  ProjectionSet scan = noise_scan(views, rows, columns, seed);
  for (const auto& [du, dv] : drawn(views, u, v, seed)) {
    if (u > 0) scan.geometry.column_shift.push_back(du);
    if (v > 0) scan.geometry.row_shift.push_back(dv);
  }
  return scan;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_object_comes_out_as_if_it_had_only_turned) {
  // What the feature promises of smooth parts.
  constexpr double promised = 0.01;
  const double still = off_by(simulated({})), moved = off_by(simulated(drawn(90, 4, 3)));
  BOOST_TEST(still < promised);
  BOOST_TEST(moved < promised);
  // What this would not see if it could not fail: the same data, taken to stand still.
  ProjectionSet wrong = simulated(drawn(90, 4, 0));
  wrong.geometry.column_shift.clear();
  BOOST_TEST(off_by(wrong) > 5 * promised);
}

BOOST_AUTO_TEST_CASE(covered_is_what_every_shifted_view_sees) {
  const ProjectionSet scan = shifted_noise(12, 2, 30, 4, 0);
  const ParallelGeometry& g = scan.geometry;
  const Coverage coverage(g);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-16, 16);
  int inside = 0;
  for (int i = 0; i < 4000; ++i) {
    const double x = place(random), y = place(random);
    double margin = INFINITY;
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
      const double column =
          x * std::cos(g.theta_rad[k]) + y * std::sin(g.theta_rad[k]) + g.center + g.column_shift[k];
      margin = std::min({margin, column + 0.5, static_cast<double>(g.columns) - 0.5 - column});
    }
    if (std::abs(margin) > 1e-6) BOOST_TEST((coverage.margin(x, y) >= 0) == (margin > 0));
    inside += margin > 0 ? 1 : 0;
  }
  BOOST_TEST(inside > 500);
}

BOOST_AUTO_TEST_CASE(device_and_definition_agree_on_shifted_views) {
  ProjectionSet scan = shifted_noise(40, 4, 41, 3, 1);
  to_common_heights(scan);
  GridOptions options;
  options.size = Index3{9, 9, 1};
  const Grid grid = make_grid(scan, options);
  const Volume volume = reconstruct(device(), scan, grid, {FieldOptions{}, 32, Interpolation::cubic});
  const ExactField exact(scan, {});
  const std::vector<Vec3> points = vdvr::testing::places_of(grid);
  const std::vector<double> F = exact.at(points);
  // Samples are at most 1/2 each, sums of the ramp half of that over pi radians; rows of common heights grow
  // by S_v's row sum, below 3.
  const double scale = std::numbers::pi * 0.5 * 3,
               most = 3.0 / 128 * std::pow(std::numbers::pi / 32, 4) * scale * 41 +
                      tolerance::fp32_sum(200, scale);
  for (std::size_t i = 0; i < points.size(); ++i)
    BOOST_TEST(std::abs(static_cast<double>(volume.samples[i]) - F[i]) <= most);
}

BOOST_AUTO_TEST_CASE(verify_brings_rows_to_the_same_heights) {
  std::mt19937 random(3);
  for (int i = 0; i < 30; ++i) {
    const auto rows = static_cast<std::int64_t>(2 + random() % 14);
    const ProjectionSet own =
        shifted_noise(5, rows, 14, 0, 0.45 * static_cast<double>(rows - 1), static_cast<unsigned>(random()));
    ProjectionSet scan = own;
    to_common_heights(scan);
    FieldOptions field;
    field.preparation = scan.report.preparation;
    const ProjectionSet again = rows_to_verify(own, field);
    BOOST_TEST((again.geometry == scan.geometry));
    BOOST_TEST((again.report.preparation == scan.report.preparation));
    BOOST_REQUIRE(again.data.size() == scan.data.size());
    // Both round sums of such rows once: they differ where a sum lies at the border of two floats.
    for (std::size_t s = 0; s < scan.data.size(); ++s)
      BOOST_TEST(std::abs(static_cast<double>(again.data[s]) - static_cast<double>(scan.data[s])) <=
                 2 * tolerance::unit_roundoff * std::abs(static_cast<double>(scan.data[s])) +
                     tolerance::fp64_sum(8 * rows, 2));
  }
}

BOOST_AUTO_TEST_CASE(whole_rows_are_taken_as_they_are) {
  ProjectionSet scan = noise_scan(3, 6, 8);
  const ProjectionSet own = scan;
  scan.geometry.row_shift = {2, 0, 1};
  to_common_heights(scan);
  BOOST_REQUIRE(scan.geometry.rows == 4);
  for (std::int64_t k = 0; k < 3; ++k)
    for (std::int64_t j = 0; j < 4; ++j)
      for (std::int64_t u = 0; u < 8; ++u)
        BOOST_TEST(scan.data[at((k * 4 + j) * 8 + u)] ==
                   own.data[at((k * 6 + j + std::array{2, 0, 1}[at(k)]) * 8 + u)]);
}

BOOST_AUTO_TEST_CASE(heights_that_no_view_shares_are_refused) {
  ProjectionSet scan = noise_scan(3, 6, 8);
  scan.geometry.row_shift = {0, 3, 6.5};
  BOOST_CHECK_THROW(to_common_heights(scan), InputError);
  scan.geometry.row_shift = {0, 1, 2};
  BOOST_CHECK_THROW(static_cast<void>(check_scan(scan.geometry)), InputError);  // rows as they were seen
  scan.geometry.row_shift.clear();
  scan.geometry.column_shift = {0, 1};
  BOOST_CHECK_THROW(static_cast<void>(check_scan(scan.geometry)), InputError);
}

BOOST_AUTO_TEST_CASE(the_centre_is_found_behind_random_shifts) {
  SimulateOptions o;
  o.angles = 120;
  o.columns = 57;
  o.rows = 5;
  o.detector_offset = 2.3;
  o.shifts = drawn(120, 3, 0);
  const auto found = find_center(simulate(smooth_balls(), o));
  BOOST_REQUIRE(found.has_value());
  BOOST_TEST(std::abs(found->center - (28 - 2.3)) < 0.25);
}

BOOST_AUTO_TEST_CASE(certificates_hold_for_shifts_that_verify_follows_itself) {
  for (const auto& [u, v] : {std::pair{4.0, 0.0}, {0.0, 1.2}, {3.0, 1.0}}) {
    const ProjectionSet measured = shifted_noise(24, 5, 30, u, v);
    ProjectionSet scan = measured;
    to_common_heights(scan);
    CertifyOptions options;
    options.grid.size = Index3{6, 6, 1};
    const BuildResult built = certify(device(), scan, Tolerance{.relative = 0.05}, options);
    const VerifyResult found = verify(device(), rows_to_verify(measured, built.certificate.field),
                                      built.volume, built.certificate, {.exhaustive = true});
    BOOST_TEST(found.holds, found.failure);
    ProjectionSet wrong = measured;
    if (u > 0) wrong.geometry.column_shift[3] += 0.5;
    else wrong.geometry.row_shift[3] += 0.3;
    BOOST_TEST(!verify(device(), rows_to_verify(wrong, built.certificate.field), built.volume,
                       built.certificate, {.exhaustive = true})
                    .holds);
  }
}
