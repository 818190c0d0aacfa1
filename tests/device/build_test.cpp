#define BOOST_TEST_MODULE build
#include "vdvr/expert/build.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <random>
#include <set>
#include <string>

#include "host/base/opencl/state.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using vdvr::testing::grid_of;
using vdvr::testing::noise_scan;
using vdvr::testing::simulated;

namespace {

struct Wanted {
  Grid grid;
  double epsilon = 0.05;
  RateOptions rates{};
  BuildOptions options{};
  std::uint64_t max_memory = 0;
  Comparison comparison{};
  bool isotropic = false;
  std::optional<LevelTriple> coarsening{};
  std::optional<double> epsilon_abs{};  // in place of epsilon
  int granularity = 4;
};

struct Built {
  Plan plan;
  BuildResult result;
};

Built build_of(const ProjectionSet& scan, const Wanted& wanted) {
  Device device("", wanted.max_memory);
  PlanSettings settings;
  settings.comparison = wanted.comparison;
  if (wanted.isotropic) settings.levels = Levels::isotropic;
  settings.granularity = wanted.granularity;
  settings.coarsening = wanted.coarsening;
  Tolerance tolerance{{}, wanted.epsilon_abs};
  if (!wanted.epsilon_abs) tolerance.relative = wanted.epsilon;
  Plan plan = make_plan(device, scan, wanted.grid, {}, wanted.rates, tolerance, settings);
  BuildResult result = build(device, scan, plan, wanted.options);
  if (wanted.max_memory > 0) BOOST_TEST(device.state().memory.peak_of_one() <= wanted.max_memory);
  return {std::move(plan), std::move(result)};
}

BuildOptions f32_storage() {
  BuildOptions options;
  options.storage = StorageChoice::f32;
  return options;
}

// Random points of a box on a few heights: many heights cost the reference much and show no more.
std::vector<Vec3> random_points(const Vec3& low, const Vec3& high, int heights, int per_height,
                                unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vec3> points;
  for (int h = 0; h < heights; ++h) {
    const double z = low[2] + unit(random) * (high[2] - low[2]);
    for (int i = 0; i < per_height; ++i)
      points.push_back(
          {low[0] + unit(random) * (high[0] - low[0]), low[1] + unit(random) * (high[1] - low[1]), z});
  }
  return points;
}

Vec3 end_of(const Grid& grid) { return grid.position(grid.cells); }

// The certificate against F in double precision, which shares nothing with the device: no slack at all.
// `applies` says for which values of F the certificate speaks.
template <class Applies>
void check_certificate(const ProjectionSet& scan, const Built& built, const std::vector<Vec3>& points,
                       Applies&& applies) {
  const Certificate& c = built.result.certificate;
  BOOST_TEST(c.holds_buffer);
  // Weights of 8 bits can be too coarse for a tolerance; then the certificate says so.
  BOOST_TEST(c.holds_image3d.value_or(true) == (c.total_image3d.value_or(0) <= c.epsilon_abs));
  static const bool exact_weights = probe_filters(support::device()).weighs_in_fp32();
  if (exact_weights) BOOST_TEST(c.holds_image3d.value_or(true));
  BOOST_TEST(c.total_buffer <= c.epsilon_abs);
  BOOST_TEST(c.measured_max <= c.measured_total);
  BOOST_TEST(c.measured_total <= c.total_buffer);
  const ExactField exact(scan, c.field);
  const auto F = exact.at(points);
  const std::vector<float> bounds = brick_bounds(c, false);
  const Index3 n = built.result.volume.bricks();
  double worst = 0;
  std::int64_t tested = 0, beyond = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!exact.covered(points[i]) || !applies(F[i])) continue;
    ++tested;
    const double error = std::abs(static_cast<double>(sample_at(built.result.volume, points[i])) - F[i]);
    worst = std::max(worst, error);
    const Index3 b = brick_at(built.result.volume, points[i]);
    if (!(error <= static_cast<double>(bounds[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])])))
      ++beyond;
  }
  BOOST_TEST(beyond == 0, beyond << " of " << tested << " points err by more than their brick's bound");
  BOOST_TEST(*std::max_element(c.brick_totals.begin(), c.brick_totals.end()) >=
             static_cast<float>(c.measured_total));
  BOOST_TEST(tested > 100);
  BOOST_TEST(worst <= tolerance::bound(c.total_buffer), "|V - F| reaches " << worst << ", certified "
                                                                           << c.total_buffer << " of epsilon "
                                                                           << c.epsilon_abs);
  BOOST_TEST_MESSAGE("|V - F| reaches " << worst << ", certified " << c.total_buffer << " of epsilon "
                                        << c.epsilon_abs << ", over " << tested << " points");
}
void check_certificate(const ProjectionSet& scan, const Built& built, const std::vector<Vec3>& points) {
  check_certificate(scan, built, points, [](double) { return true; });
}

bool verifies(const ProjectionSet& scan, const MixedVolume& volume, const Certificate& certificate,
              bool exhaustive = true) {
  Device device;
  const VerifyResult v = verify(device, scan, volume, certificate, {exhaustive, 0.1, 3});
  BOOST_TEST(v.holds == v.failure.empty());
  if (v.holds) BOOST_TEST(v.total <= tolerance::bound(v.epsilon_abs));
  return v.holds;
}

// Bricks that both store a sample at a point store the same bits.
void check_shared_bits(const MixedVolume& v) {
  const Index3 n = v.bricks();
  std::int64_t different = 0;
  for (std::int64_t i = 0; i < v.brick_count(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
      Index3 q = p;
      if (++q[axis] >= n[axis]) continue;
      const LevelTriple lp = v.level[static_cast<std::size_t>(i)],
                        lq = v.level[static_cast<std::size_t>((q[2] * n[1] + q[1]) * n[0] + q[0])];
      Index3 count{};  // steps of the coarser lattice along the face
      for (std::size_t a = 0; a < 3; ++a)
        count[a] = a == axis ? 0
                             : std::min<std::int64_t>(v.granularity, v.grid.cells[a] - p[a] * v.granularity)
                                       << std::min(lp[2 - a], lq[2 - a]) >>
                                   v.coarsening[2 - a];
      for (std::int64_t z = 0; z <= count[2]; ++z)
        for (std::int64_t y = 0; y <= count[1]; ++y)
          for (std::int64_t x = 0; x <= count[0]; ++x) {
            const Index3 step{x, y, z};
            Index3 ip{}, iq{};
            for (std::size_t a = 0; a < 3; ++a) {
              const int coarse = std::min(lp[2 - a], lq[2 - a]);
              ip[a] = a == axis ? v.tile_shape(lp)[2 - a] - 1 : step[a] << (lp[2 - a] - coarse);
              iq[a] = a == axis ? 0 : step[a] << (lq[2 - a] - coarse);
            }
            if (reference::stored_sample(v, p, ip) != reference::stored_sample(v, q, iq)) ++different;
          }
    }
  BOOST_TEST(different == 0);
}

void check_all(const ProjectionSet& scan, const Wanted& wanted, unsigned seed) {
  const Built built = build_of(scan, wanted);
  check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 40, 150, seed));
  check_shared_bits(built.result.volume);
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate, false));
}

}  // namespace

BOOST_AUTO_TEST_CASE(certificate_of_noise_holds_at_several_tolerances) {
  const ProjectionSet scan = noise_scan(19, 9, 33);
  for (const double epsilon : {0.2, 0.08, 0.03})
    check_all(scan, {grid_of(scan, {12, 10, 8}, 0.9), epsilon}, 1);
}

// Noise at tolerances near its range and far below: half a step of 8 bits is then a small or the larger part.
BOOST_AUTO_TEST_CASE(certificate_of_noise_holds_with_every_storage) {
  const ProjectionSet scan = noise_scan(19, 9, 33, 3);
  for (const StorageChoice storage : {StorageChoice::u8, StorageChoice::u16, StorageChoice::automatic})
    for (const double epsilon : {0.2, 0.05}) {
      Wanted wanted{grid_of(scan, {11, 10, 7}, 0.9), epsilon};
      wanted.options.storage = storage;
      const Built built = build_of(scan, wanted);
      check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 40, 150, 3));
      check_shared_bits(built.result.volume);
      BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
      const SampleType base = built.result.volume.base.type;
      if (storage == StorageChoice::u8) BOOST_TEST((base == SampleType::u8));
      if (storage == StorageChoice::u16) BOOST_TEST((base == SampleType::u16));
    }
}

BOOST_AUTO_TEST_CASE(eight_bits_that_leave_no_room_are_refused_and_auto_takes_more) {
  const ProjectionSet scan = noise_scan(19, 9, 33, 3);
  Wanted wanted{grid_of(scan, {8, 8, 7}, 0.9), 0.004, {32, Interpolation::cubic, 16}};
  wanted.options.storage = StorageChoice::u8;  // half a step is about the whole tolerance
  BOOST_CHECK_EXCEPTION(build_of(scan, wanted), ToleranceError, [](const ToleranceError& e) {
    const std::string text = e.what();
    return text.find("integer samples round") != std::string::npos &&
           text.find("`storage`") != std::string::npos && text.find("interpolating") == std::string::npos;
  });
  wanted.options.storage = StorageChoice::automatic;
  const Built built = build_of(scan, wanted);
  check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 20, 100, 3));
  BOOST_TEST((built.result.volume.base.type != SampleType::u8));
}

BOOST_AUTO_TEST_CASE(certificate_of_noise_holds_with_the_paper_closing) {
  const ProjectionSet scan = noise_scan(19, 9, 33, 4);
  for (const StorageChoice storage : {StorageChoice::f32, StorageChoice::u8}) {
    Wanted wanted{grid_of(scan, {11, 10, 7}, 0.9), 0.15};
    wanted.comparison = {Coefficients::sampled, Terms::all, Closing::paper};
    wanted.options.storage = storage;
    const Built built = build_of(scan, wanted);
    check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 40, 150, 3));
    check_shared_bits(built.result.volume);
    BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
  }
}

// Closing `paper` raises bricks that coarse gold decided to levels that coarse gold does not resolve.
BOOST_AUTO_TEST_CASE(certificate_holds_where_the_paper_closing_raises_easy_bricks) {
  ProjectionSet scan = simulated(sphere(2.8), 17, 9, 24);
  Wanted wanted{make_grid(scan.geometry, {}), 0.03, {{}, {}, 8}};
  wanted.comparison = {Coefficients::sampled, Terms::all, Closing::paper};
  wanted.isotropic = true;
  const Built built = build_of(scan, wanted);
  check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 20, 150, 3));
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
}

BOOST_AUTO_TEST_CASE(certificate_of_noise_holds_for_every_u_filter_and_granularity) {
  const ProjectionSet scan = noise_scan(17, 7, 29, 5);
  const Grid grid = grid_of(scan, {9, 7, 6}, 0.8);
  for (const int granularity : {1, 2, 4})
    for (const Interpolation filter : {Interpolation::linear, Interpolation::cubic})
      check_all(scan, {grid, 0.15, {16, filter, 8}, {}, 0, {}, false, {}, {}, granularity}, 2);
}

BOOST_AUTO_TEST_CASE(certificate_holds_to_the_edge_of_the_covered_region) {
  const ProjectionSet scan = noise_scan(15, 5, 24, 6);
  const Grid grid = make_grid(scan.geometry, {});
  const Built built = build_of(scan, {grid, 0.1});
  BOOST_TEST(built.result.certificate.not_covered_count > 0);
  // A ring around the covered radius.
  auto points = random_points(grid.origin, end_of(grid), 40, 200, 4);
  for (std::size_t i = 0; i < points.size(); i += 2) {
    const double radius = std::hypot(points[i][0], points[i][1]),
                 wanted = 11.2 + 0.8 * (static_cast<double>(i % 97) / 97);
    for (std::size_t a = 0; a < 2; ++a) points[i][a] *= wanted / radius;
  }
  check_certificate(scan, built, points);
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
}

BOOST_AUTO_TEST_CASE(bricks_are_at_most_twice_as_thick_as_their_grid) {
  const ProjectionSet scan = noise_scan(14, 3, 25, 7);
  Wanted wanted{grid_of(scan, {8, 8, 1}, 1.0, Vec3{-4, -4, -0.5}), 0.1};
  for (const int granularity : {1, 2, 4}) {
    wanted.granularity = granularity;
    const Built built = build_of(scan, wanted);
    BOOST_TEST(built.result.volume.granularity == std::min(granularity, 2));
    check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 20, 200, 3));
    BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
  }
}

BOOST_AUTO_TEST_CASE(region_of_interest_is_certified_and_the_rest_left_at_level_0) {
  const ProjectionSet scan = noise_scan(15, 9, 33, 8);
  const std::array<double, 6> roi{-3, -2, -2, 1, 3, 1};
  Wanted wanted{grid_of(scan, {16, 16, 8}, 1.0), 0.05};
  wanted.options.roi = roi;
  wanted.granularity = 2;
  const Built built = build_of(scan, wanted);
  check_certificate(scan, built,
                    random_points({roi[0], roi[1], roi[2]}, {roi[3], roi[4], roi[5]}, 40, 150, 5));
  const MixedVolume& v = built.result.volume;
  BOOST_TEST((v.level.front() == LevelTriple{0, 0, 0}));
  BOOST_TEST((v.level.back() == LevelTriple{0, 0, 0}));
  BOOST_TEST((built.result.certificate.roi == roi));
  BOOST_TEST(verifies(scan, v, built.result.certificate));
}

// A coordinate in fp32 can end in the next brick, beyond the region's face: it is certified as well.
BOOST_AUTO_TEST_CASE(points_one_rounding_below_a_face_of_the_region_are_certified) {
  const ProjectionSet scan = noise_scan(15, 9, 33, 8);
  const Grid grid = grid_of(scan, {16, 16, 8}, 1.0);
  // Faces of bricks of two cells, approached from inside and left out by one rounding of a double.
  const double below = std::nextafter(2.0, -1.0);
  const std::array<double, 6> roi{-4, -4, -2, below, below, below};
  Wanted wanted{grid, 0.05};
  wanted.options.roi = roi;
  wanted.granularity = 2;
  const Built built = build_of(scan, wanted);
  std::vector<Vec3> points = random_points({-4, -4, -2}, {2, 2, 2}, 10, 150, 5);
  for (std::size_t i = 0; i < points.size(); ++i) points[i][i % 3] = below;
  const MixedVolume& v = built.result.volume;
  const std::vector<float> bounds = brick_bounds(built.result.certificate, false);
  const Index3 n = v.bricks();
  std::int64_t over_the_face = 0;
  for (const Vec3& p : points) {
    const Index3 b = brick_at(v, p);
    over_the_face += b[0] == 5 || b[1] == 5 || b[2] == 3;
    BOOST_TEST(std::isfinite(bounds[static_cast<std::size_t>((b[2] * n[1] + b[1]) * n[0] + b[0])]));
  }
  BOOST_TEST(over_the_face > 0);
  check_certificate(scan, built, points);
  BOOST_TEST(verifies(scan, v, built.result.certificate));
}

// What a plan refuses cannot be built; whether the rest can, build finds out.
BOOST_AUTO_TEST_CASE(plan_refuses_what_cannot_do_and_no_more) {
  const ProjectionSet scan = noise_scan(15, 7, 29, 9);
  Device device;
  const Grid grid = grid_of(scan, {8, 8, 6}, 0.9);
  const RateOptions rates{16, Interpolation::cubic, 4};
  const auto plan_at = [&](double epsilon_abs) {
    return make_plan(device, scan, grid, {}, rates, {{}, epsilon_abs});
  };
  const Plan wide = plan_at(10);
  const double slack = wide.epsilon_abs - wide.budget.grid.value - wide.budget.arithmetic.value;
  BOOST_REQUIRE(slack > 10 * wide.budget.arithmetic.value);
  BOOST_CHECK_NO_THROW(plan_at(1.05 * slack + 3 * wide.budget.arithmetic.value));
  BOOST_CHECK_THROW(plan_at(0.99 * slack), ToleranceError);
}

BOOST_AUTO_TEST_CASE(notes_of_the_scan_reach_the_certificate) {
  ProjectionSet scan = noise_scan(12, 5, 15, 8);
  scan.report.notes.push_back("the scan holds float64");
  const Built built = build_of(scan, {grid_of(scan, {4, 4, 4}, 0.9), 0.3});
  const auto& notes = built.result.certificate.notes;
  BOOST_TEST(std::count(notes.begin(), notes.end(), scan.report.notes.front()) == 1);
}

BOOST_AUTO_TEST_CASE(window_certifies_what_lies_in_it_with_fewer_tiles) {
  const ProjectionSet scan = noise_scan(15, 7, 29, 9);
  Wanted wanted{grid_of(scan, {12, 12, 6}, 0.9), 0.05};
  wanted.granularity = 1;
  const Built whole = build_of(scan, wanted);
  const double middle = 0.3 * whole.plan.reference_range, half = 0.15 * whole.plan.reference_range;
  wanted.options.window = {middle - half, middle + half};
  const Built built = build_of(scan, wanted);
  const double inner = half - built.plan.epsilon_abs;  // such F lie in gold cells that meet the window
  check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 40, 300, 6),
                    [&](double F) { return std::abs(F - middle) <= inner; });
  BOOST_TEST(storage_of(built.result.volume, false).samples_ratio <
             storage_of(whole.result.volume, false).samples_ratio);
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
}

BOOST_AUTO_TEST_CASE(levels_per_axis_and_per_brick_are_certified_and_continuous) {
  // Hardly varies along z, so that there is something to gain.
  ProjectionSet scan = noise_scan(17, 8, 21, 6);
  const std::int64_t columns = scan.geometry.columns, view = columns * scan.geometry.rows;
  for (std::int64_t i = 0; i < scan.size(); ++i) {
    const float first_row = scan.data[static_cast<std::size_t>(i / view * view + i % columns)];
    float& p = scan.data[static_cast<std::size_t>(i)];
    p = first_row + 0.01f * p;
  }
  for (const bool isotropic : {false, true}) {
    Wanted wanted{grid_of(scan, {10, 9, 6}, 0.8), 0.1};
    wanted.isotropic = isotropic;
    wanted.granularity = 2;
    const Built built = build_of(scan, wanted);
    const MixedVolume& v = built.result.volume;
    const bool triples = std::any_of(v.level.begin(), v.level.end(),
                                     [](const LevelTriple& l) { return l[0] != l[1] || l[1] != l[2]; });
    BOOST_TEST(triples == !isotropic);
    check_shared_bits(v);
    check_certificate(scan, built, random_points(wanted.grid.origin, end_of(wanted.grid), 20, 200, 8));
    BOOST_TEST(verifies(scan, v, built.result.certificate));
  }
}

BOOST_AUTO_TEST_CASE(bases_coarser_than_the_grid_are_certified_and_continuous) {
  const ProjectionSet scan = noise_scan(19, 9, 33);
  for (const bool sampled : {false, true})
    for (const LevelTriple& coarsening : {LevelTriple{2, 0, 0}, {0, 1, 2}, {2, 2, 1}, {1, 1, 1}}) {
      Wanted wanted{grid_of(scan, {12, 12, 8}, 0.9), 0.2};
      if (sampled) wanted.comparison.coefficients = Coefficients::sampled;
      wanted.coarsening = coarsening;
      check_all(scan, wanted, 3);
      BOOST_TEST((build_of(scan, wanted).result.volume.coarsening == coarsening));
    }
}

BOOST_AUTO_TEST_CASE(what_hardly_varies_along_an_axis_takes_a_coarser_base_there_and_fewer_samples) {
  // Every row of the detector sees the same.
  ProjectionSet scan = noise_scan(17, 17, 21, 6);
  const std::int64_t columns = scan.geometry.columns, view = columns * scan.geometry.rows;
  for (std::int64_t i = 0; i < scan.size(); ++i)
    scan.data[static_cast<std::size_t>(i)] =
        scan.data[static_cast<std::size_t>(i / view * view + i % columns)];
  Wanted wanted{grid_of(scan, {12, 12, 16}, 0.8), 0.2};
  wanted.coarsening = LevelTriple{0, 0, 0};
  const double plain = storage_of(build_of(scan, wanted).result.volume, false).samples_ratio;
  wanted.coarsening.reset();
  const Built built = build_of(scan, wanted);
  BOOST_TEST(built.result.volume.coarsening[0] == 2);
  BOOST_TEST(storage_of(built.result.volume, false).samples_ratio < plain);
  BOOST_TEST(verifies(scan, built.result.volume, built.result.certificate));
}

BOOST_AUTO_TEST_CASE(a_base_that_does_not_divide_is_refused) {
  const ProjectionSet scan = noise_scan(9, 5, 11);
  Wanted wanted{grid_of(scan, {6, 6, 4}, 1.0), 0.3};
  wanted.coarsening = LevelTriple{0, 0, 2};
  BOOST_CHECK_THROW(build_of(scan, wanted), InputError);
}

BOOST_AUTO_TEST_CASE(altered_tile_sample_is_noticed) {
  const ProjectionSet scan = noise_scan(19, 9, 33, 10);
  const Built built = build_of(scan, {grid_of(scan, {8, 8, 8}, 0.9), 0.05, {}, f32_storage()});
  const Certificate& c = built.result.certificate;
  BOOST_REQUIRE(verifies(scan, built.result.volume, c));
  BOOST_REQUIRE(!built.result.volume.tiles.empty());
  for (const auto& [triple, tiles] : built.result.volume.tiles) {
    MixedVolume altered = built.result.volume;
    // The middle of a tile lies in its brick's inside.
    altered.tiles.at(triple).f32[static_cast<std::size_t>(altered.tile_size(triple) / 2)] +=
        static_cast<float>(1.5 * c.epsilon_abs);
    BOOST_TEST(!verifies(scan, altered, c));
  }
}

BOOST_AUTO_TEST_CASE(altered_base_sample_and_foreign_scan_are_noticed) {
  const ProjectionSet scan = simulated(sphere(10, 1), 33, 17, 30);  // smooth enough for bricks of level 0
  const Built built = build_of(scan, {grid_of(scan, {16, 16, 8}, 1.0), 0.3, {}, f32_storage()});
  // The first sample inside a brick that reads the base.
  MixedVolume altered = built.result.volume;
  const auto coarse = std::find(altered.level.begin(), altered.level.end(), LevelTriple{0, 0, 0});
  BOOST_REQUIRE((coarse != altered.level.end()));
  const Index3 n = altered.bricks(), samples = altered.grid.samples();
  const std::int64_t i = coarse - altered.level.begin(), g = altered.granularity;
  const Index3 inside{i % n[0] * g + 1, i / n[0] % n[1] * g + 1, i / n[0] / n[1] * g + 1};
  altered.base.f32[static_cast<std::size_t>((inside[2] * samples[1] + inside[1]) * samples[0] + inside[0])] +=
      static_cast<float>(2.5 * built.plan.epsilon_abs);
  BOOST_TEST(!verifies(scan, altered, built.result.certificate));
  BOOST_TEST(!verifies(noise_scan(30, 17, 33, 12), built.result.volume, built.result.certificate));
}

BOOST_AUTO_TEST_CASE(absurd_tolerance_is_out_of_reach) {
  constexpr double whole_range = 1;
  const ProjectionSet scan = noise_scan(13, 5, 25);
  Device device;
  const Grid grid = grid_of(scan, {6, 6, 4}, 1.0);
  // No value computed in fp32 is known better than to half a unit of its last place.
  constexpr double unreachable = tolerance::unit_roundoff;
  BOOST_CHECK_THROW(make_plan(device, scan, grid, {}, {}, {unreachable, {}}), ToleranceError);
  // What gold and projections may err by at these rates is no tolerance: nothing is left for the volume. A
  // plan that does not count them foresees how much that is.
  const RateOptions coarse{2, Interpolation::linear, 2};
  PlanSettings comparison;
  comparison.comparison.terms = Terms::grid;
  const ErrorBudget budget = make_plan(device, scan, grid, {}, coarse, {whole_range, {}}, comparison).budget;
  const double taken = std::max(budget.gold.value, budget.projection.value);
  BOOST_TEST(taken > 0);
  BOOST_CHECK_THROW(make_plan(device, scan, grid, {}, coarse, {{}, taken}), ToleranceError);
  BOOST_CHECK_THROW(make_plan(device, scan, grid, {}, {}, {-whole_range, {}}), InputError);
  BOOST_CHECK_THROW(make_plan(device, scan, grid, {}, {}, {std::nan(""), {}}), InputError);
  // A plan made for another tolerance: build finds out by itself.
  Plan plan = make_plan(device, scan, grid, {}, {}, {whole_range, {}});
  plan.epsilon_abs = unreachable * plan.reference_range;
  BOOST_CHECK_THROW(build(device, scan, plan, {}), ToleranceError);
}

BOOST_AUTO_TEST_CASE(small_memory_gives_a_certificate_that_holds) {
  const ProjectionSet scan = noise_scan(24, 33, 33, 13);
  const Grid grid = grid_of(scan, {12, 12, 24}, 0.9);
  std::set<std::string> contents;
  for (const std::uint64_t mebibytes : {48, 96, 512}) {
    const Wanted wanted{grid, 0.2, {8, Interpolation::cubic, 8}, {}, mebibytes << 20};
    const Built built = build_of(scan, wanted);
    check_certificate(scan, built, random_points(grid.origin, end_of(grid), 40, 100, 7));
    check_shared_bits(built.result.volume);
    contents.insert(content_sha256(built.result.volume));
  }
  // Smaller blocks, and shorter runs of rows, make the same volume.
  BOOST_TEST(contents.size() == 1u);
}

BOOST_AUTO_TEST_CASE(tiles_in_scratch_make_the_volume_of_those_in_memory) {
  const ProjectionSet scan = simulated(marschner_lobb(32 / std::sqrt(2.0)), 65, 65, 74);
  Wanted wanted{grid_of(scan, {32, 32, 32}, 0.70710678), 0.01};
  const Built in_memory = build_of(scan, wanted);
  wanted.options.in_memory_bytes = 0;
  wanted.options.scratch = ".";
  const Built in_scratch = build_of(scan, wanted);
  const MixedVolume& v = in_scratch.result.volume;
  BOOST_TEST(!v.tiles.empty());
  for (const auto& [kind, block] : v.tiles)
    BOOST_TEST((block.f32.scratch() || block.u16.scratch() || block.u8.scratch()));
  BOOST_TEST(in_scratch.result.certificate.measured_total == in_memory.result.certificate.measured_total);
  BOOST_TEST(content_sha256(v) == content_sha256(in_memory.result.volume));
}

BOOST_AUTO_TEST_CASE(sphere_is_certified) {
  const ProjectionSet scan = simulated(sphere(10, 1), 33, 33, 60);
  check_all(scan, {grid_of(scan, {16, 16, 16}, 1.0, Vec3{-2, -2, -2}), 0.03}, 8);
}

BOOST_AUTO_TEST_CASE(marschner_lobb_is_certified) {
  const ProjectionSet scan = simulated(marschner_lobb(32 / std::sqrt(2.0)), 65, 65, 74);
  check_all(scan, {grid_of(scan, {32, 32, 16}, 0.70710678), 0.03}, 9);
}

// The tolerance of the node test, as build() has it: what arithmetic and the samplers leave.
double node_tolerance_of(const Built& built) {
  Device device;
  const Plan& plan = built.plan;
  const SamplerProbe probe = probe_filters(device);
  const SamplerTerms t = sampler_terms(field_slopes(as_mixed(plan.base)), plan.grid, probe,
                                       longest_atlas(device.info()), plan.epsilon_abs, plan.rates.gold);
  // Of coarse weights nothing is reserved: bricks are raised for them.
  const double image3d = t.image3d && probe.weighs_in_fp32() ? t.image3d->value : 0.0;
  return plan.epsilon_abs - built.result.certificate.budget.arithmetic.value -
         1.25 * std::max(t.buffer.value, image3d);
}

// Here a neighbour that is raised for a brick's sake rounds to the samples it had, so that the brick is not
// measured again.
BOOST_AUTO_TEST_CASE(repair_leaves_no_brick_over_the_tolerance) {
  const ProjectionSet scan = simulated(marschner_lobb(32 / std::sqrt(2.0)), 65, 65, 74);
  Wanted wanted{grid_of(scan, {64, 64, 64}, 0.70710678)};
  wanted.epsilon_abs = 0.01;
  wanted.options.storage = StorageChoice::u8;
  wanted.options.roi = {-12, 5, 5, -2, 15, 23};
  const Built built = build_of(scan, wanted);
  // The test compares in fp32, and the certificate adds 2^-21 for the sum's own rounding.
  BOOST_TEST(built.result.certificate.measured_total <=
             node_tolerance_of(built) * (1 + tolerance::unit_roundoff) * (1 + 0x1p-21));
}

BOOST_AUTO_TEST_CASE(shepp_logan_is_certified) {
  const ProjectionSet scan = simulated(shepp_logan(20), 41, 41, 64);
  check_all(scan, {grid_of(scan, {16, 16, 12}, 1.0, Vec3{-8, -3, -6}), 0.05}, 10);
}
