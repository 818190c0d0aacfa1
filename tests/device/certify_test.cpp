// What a program over the library is promised: certify() completes and refuses, verify_file() holds a file to
// its projections.
#define BOOST_TEST_MODULE certify
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <functional>
#include <string>

#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/verify_file.hpp"

using namespace vdvr;
using support::device;
using vdvr::testing::simulated;

namespace {

const ProjectionSet& scan() {
  static const ProjectionSet made = simulated(sphere(4), 21, 7, 24);
  return made;
}

Tolerance part_of_range(double fraction) { return {fraction, {}}; }

const BuildResult& certified() {
  static const BuildResult made = certify(device(), scan(), part_of_range(0.2));
  return made;
}

std::string refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

bool names(const std::string& message, const std::string& what) {
  return message.find(what) != std::string::npos;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_certificate_is_complete) {
  const Certificate& c = certified().certificate;
  BOOST_TEST(c.holds_buffer);
  BOOST_TEST(c.content_sha256 == content_sha256(certified().volume));
  BOOST_TEST(contradiction(c) == "");
  const auto noted = noted_geometry(c);
  BOOST_REQUIRE(noted.has_value());
  const ParallelGeometry* geometry = &noted->geometry;
  const ParallelGeometry& wanted = scan().geometry;
  BOOST_TEST(geometry->columns == wanted.columns);
  BOOST_TEST(geometry->rows == wanted.rows);
  BOOST_TEST(geometry->pitch_u == wanted.pitch_u);
  BOOST_TEST(geometry->center == wanted.center);
  BOOST_TEST(geometry->theta_rad == wanted.theta_rad, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(planned_before_or_at_once_it_is_the_same_volume) {
  const Plan plan = make_plan(device(), scan(), part_of_range(0.2));
  const BuildResult again = certify(device(), scan(), plan);
  BOOST_TEST(again.certificate.content_sha256 == certified().certificate.content_sha256);
  BOOST_TEST(again.certificate.options_json == certified().certificate.options_json);
}

// Without a size the grid is the region's: the same samples of F, the same bricks, and a range of its own.
BOOST_AUTO_TEST_CASE(a_region_of_interest_makes_the_default_grid_as_large_as_it) {
  CertifyOptions options;
  options.build.roi = {-5.5, -2, -1, 1, 6.25, 2};
  constexpr double asked = 1.0 / 20;  // of the certificate, not of this test
  const Tolerance tolerance{{}, asked};
  const BuildResult part = certify(device(), scan(), tolerance, options);
  const Plan whole = make_plan(device(), scan(), tolerance),
             planned = make_plan(device(), scan(), tolerance, options);
  const Grid &grid = part.volume.grid, &all = whole.grid;
  BOOST_TEST(grid.sample_count() < all.sample_count() / 2);
  BOOST_TEST(part.certificate.holds_buffer);
  BOOST_TEST((part.certificate.roi == options.build.roi));
  const VerifyResult verified = verify(device(), scan(), part.volume, part.certificate, {.exhaustive = true});
  BOOST_TEST(verified.holds, verified.failure);
  const std::vector<std::string>& notes = part.certificate.notes;
  BOOST_TEST(std::any_of(notes.begin(), notes.end(), [](const auto& n) { return names(n, "`roi`"); }));

  // Samples of both plans, place by place: what rounding may move either by.
  const double rounding = whole.budget.arithmetic.value + planned.budget.arithmetic.value;
  Index3 first{};
  for (std::size_t a = 0; a < 3; ++a)
    first[a] = static_cast<std::int64_t>(std::round((grid.origin[a] - all.origin[a]) / all.spacing[a]));
  const Index3 n = grid.samples(), m = all.samples();
  double largest = 0, least = INFINITY, most = -INFINITY;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const auto v =
            static_cast<double>(planned.base.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]);
        const std::int64_t in_all = ((z + first[2]) * m[1] + y + first[1]) * m[0] + x + first[0];
        largest = std::max(
            largest, std::abs(v - static_cast<double>(whole.base.samples[static_cast<std::size_t>(in_all)])));
        if (!is_covered(scan().geometry, scan().geometry.center, grid.position({x, y, z}))) continue;
        least = std::min(least, v);
        most = std::max(most, v);
      }
  BOOST_TEST(largest <= rounding);
  // A fraction of what is there.
  BOOST_TEST(part.certificate.reference_range == most - least);
  BOOST_TEST(part.certificate.reference_range <= whole.reference_range + 2 * rounding);
  CertifyOptions beside;  // the sphere, where the field does not jump
  beside.build.roi = {8.5, -0.5, -0.5, 9, 0.5, 0.5};
  BOOST_TEST(make_plan(device(), scan(), tolerance, beside).reference_range < 0.75 * whole.reference_range);

  // A grid that was asked for stays whole.
  options.grid.size = all.cells;
  BOOST_TEST((make_plan(device(), scan(), tolerance, options).grid.cells == all.cells));
}

BOOST_AUTO_TEST_CASE(a_region_of_interest_beyond_the_scan_is_refused) {
  const auto refused = [](const std::array<double, 6>& roi, const std::string& why) {
    CertifyOptions options;
    options.build.roi = roi;
    options.grid.spacing = 0.25;
    const std::string said = refusal([&] { make_plan(device(), scan(), part_of_range(0.2), options); });
    BOOST_TEST(names(said, why), "'" << said << "'");
  };
  refused({30, 0, -1, 40, 1, 1}, "meets no brick");
  refused({0, 0, 10, 1, 1, 20}, "along z");
  // In a corner of the default grid, which the scan does not cover.
  refused({9.6, 9.6, -1, 10, 10, 1}, "what the scan covers");
}

BOOST_AUTO_TEST_CASE(a_tolerance_out_of_reach_is_refused) {
  BOOST_CHECK_THROW(certify(device(), scan(), part_of_range(tolerance::unit_roundoff)), ToleranceError);
  BOOST_CHECK_THROW(certify(device(), scan(), part_of_range(0)), InputError);
}

BOOST_AUTO_TEST_CASE(a_window_that_no_value_meets_promises_nothing_and_is_refused) {
  CertifyOptions options;
  options.build.window = {100, 200};
  const std::string why = refusal([&] { certify(device(), scan(), part_of_range(0.2), options); });
  BOOST_TEST(names(why, "nothing would be certified"));
}

// All that a single row covers may lie between the samples of one layer of cells; beside it nothing is
// covered.
BOOST_AUTO_TEST_CASE(a_layer_of_cells_beside_what_is_covered_is_refused) {
  const ProjectionSet row = simulated(sphere(4), 21, 1, 24);
  CertifyOptions options;
  options.grid.size = Index3{8, 8, 1};
  options.grid.origin = Vec3{-4, -4, -0.75};
  options.grid.spacing_z = 1.5;
  BOOST_TEST(certify(device(), row, part_of_range(0.2), options).certificate.holds_buffer);
  for (const Vec3& origin : {Vec3{-4, -4, 0.7}, Vec3{-4, -4, -2.3}, Vec3{30, -4, -0.75}}) {
    options.grid.origin = origin;
    const std::string why = refusal([&] { make_plan(device(), row, part_of_range(0.2), options); });
    BOOST_TEST(names(why, "no sample of the grid is covered"), "'" << why << "'");
  }
}

// Each names the field, not an option of the program.
BOOST_AUTO_TEST_CASE(options_that_exclude_each_other_are_refused_by_name) {
  const auto refused = [](const std::string& field, const std::function<void(CertifyOptions&)>& change) {
    CertifyOptions options;
    change(options);
    const std::string why = refusal([&] { make_plan(device(), scan(), part_of_range(0.2), options); });
    BOOST_TEST(names(why, field), "'" << why << "' does not name " << field);
    BOOST_TEST(!names(why, "--"), why);
  };
  refused("window", [](CertifyOptions& o) { o.build.window = {2, 1}; });
  refused("roi", [](CertifyOptions& o) { o.build.roi = {0, 0, 0, 1, -1, 1}; });
  refused("coarsening", [](CertifyOptions& o) {
    o.plan.levels = Levels::isotropic;
    o.plan.coarsening = LevelTriple{1, 0, 0};
  });
  refused("coefficients", [](CertifyOptions& o) { o.plan.comparison.closing = Closing::paper; });
}

BOOST_AUTO_TEST_CASE(a_file_holds_against_its_projections_and_no_others) {
  const support::TemporaryFolder folder;
  const auto path = folder / "v.vdvr";
  write_vdvr(path, certified().volume, certified().certificate);
  const FileVerification verified = verify_file(device(), path, scan());
  BOOST_TEST(verified.holds, verified.failure);
  BOOST_TEST(verified.content_matches);
  BOOST_TEST(!verified.exhaustive);
  BOOST_TEST(read_certified(path).certificate.content_sha256 == certified().certificate.content_sha256);

  ProjectionSet other = scan();
  other.report.sha256 = std::string(64, '0');
  const std::string why = refusal([&] { verify_file(device(), path, other); });
  BOOST_TEST(names(why, "other projections"), why);
}

BOOST_AUTO_TEST_CASE(altered_samples_are_measured_everywhere_and_do_not_hold) {
  VdvrFile file;
  file.volume = certified().volume;
  file.certificate = certified().certificate;
  file.altered = "the samples were changed";
  const FileVerification verified = verify_file(device(), file, scan());
  BOOST_TEST(!verified.holds);
  BOOST_TEST(verified.exhaustive);
  BOOST_TEST(verified.measured.holds);
  BOOST_TEST(names(verified.failure, "still within epsilon"), verified.failure);
}

BOOST_AUTO_TEST_CASE(what_promises_nothing_cannot_be_verified) {
  const support::TemporaryFolder folder;
  CertifyOptions options;
  options.plan.comparison.terms = Terms::grid;
  const BuildResult compared = certify(device(), scan(), part_of_range(0.2), options);
  BOOST_TEST(compared.certificate.comparison);
  write_vdvr(folder / "c.vdvr", compared.volume, compared.certificate);
  BOOST_CHECK_THROW(read_to_verify(folder / "c.vdvr"), MismatchError);

  Certificate wrong = certified().certificate;
  wrong.total_buffer *= 0.5;
  write_vdvr(folder / "w.vdvr", certified().volume, wrong);
  const std::string why = refusal([&] { read_certified(folder / "w.vdvr"); });
  BOOST_TEST(names(why, "w.vdvr: the certificate contradicts itself"), why);
}
