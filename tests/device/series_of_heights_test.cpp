// Stands of a sample that is taller than the detector, and helices (docs/geometry.md, "Series of heights"): F
// against the object, rows against those of a tall detector and verify's own, weights, sigma against repeated
// scans, certificates, and wrong shifts, which verify finds.
#define BOOST_TEST_MODULE series_of_heights
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "host/scan/geometry/views_of_rows.hpp"
#include "host/scan/geometry/weights_by_height.hpp"
#include "host/scan/prepare/heights.hpp"
#include "host/scan/prepare/series_of_heights.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/smooth_balls.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/find_center.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/rows_to_verify.hpp"
#include "vdvr/expert/verify.hpp"

using namespace vdvr;
using support::device;
using vdvr::testing::noise_scan;
using vdvr::testing::off_by;
using vdvr::testing::smooth_balls;

namespace {

constexpr double pi = std::numbers::pi;
// What the feature promises of smooth parts.
constexpr double promised = 0.01;

struct Motion {
  std::string name;
  std::vector<double> theta, shift;
};

// So many stands of `views` over `arc`, `step` rows apart; each begins `turned` of a view's step later than
// the one before.
Motion stands(int count, int views, double arc, double step, double turned = 0) {
  Motion m{"stands", {}, {}};
  for (int s = 0; s < count; ++s)
    for (int k = 0; k < views; ++k) {
      m.theta.push_back(arc * (k + turned * s) / views);
      m.shift.push_back(step * (s - 0.5 * (count - 1)));
    }
  return m;
}

Motion helix(int views, double turns, double rows_a_turn, double jitter = 0) {
  Motion m{"helix", {}, {}};
  std::mt19937 random(7);
  for (int k = 0; k < views; ++k) {
    const double late = jitter * (static_cast<double>(random()) / 4294967296.0 - 0.5);
    m.theta.push_back(2 * pi * turns * (k + late) / views);
    m.shift.push_back(turns * rows_a_turn * (static_cast<double>(k) / views - 0.5));
  }
  return m;
}

ProjectionSet like(const Motion& m, std::int64_t rows, std::int64_t columns) {
  ProjectionSet scan;
  scan.geometry.rows = rows;
  scan.geometry.columns = columns;
  scan.geometry.center = 0.5 * static_cast<double>(columns - 1);
  scan.geometry.theta_rad = m.theta;
  scan.geometry.row_shift = m.shift;
  return scan;
}

// `beside`: columns by which the axis is off the middle.
ProjectionSet of_balls(const Motion& m, std::int64_t rows, std::int64_t columns = 57, double beside = 0) {
  ProjectionSet scan = like(m, rows, columns);
  ParallelGeometry& g = scan.geometry;
  g.center -= beside;
  const Phantom balls = smooth_balls();
  for (std::size_t k = 0; k < m.theta.size(); ++k)
    for (std::int64_t v = 0; v < rows; ++v)
      for (std::int64_t i = 0; i < columns; ++i)
        scan.data.push_back(static_cast<float>(
            balls.line_integral(m.theta[k], static_cast<double>(i) - g.center,
                                static_cast<double>(v) - 0.5 * static_cast<double>(rows - 1) - m.shift[k])));
  return scan;
}

ProjectionSet put_together(ProjectionSet scan, const Preparation& wanted = {}) {
  bring_to_heights(scan, wanted, 0, {});
  return scan;
}

// Where the middle of the scan's rows lies along z of the object.
double middle_of(const ProjectionSet& scan) {
  const HeightSeries& s = scan.geometry.series;
  return static_cast<double>(s.first) + 0.5 * static_cast<double>(scan.geometry.rows - s.rows) -
         s.row_shift.front();
}

Preparation wanting(Heights heights) {
  Preparation wanted;
  wanted.heights = heights;
  return wanted;
}

ProjectionSet noise_of(const Motion& m, std::int64_t rows, std::int64_t columns, unsigned seed) {
  ProjectionSet scan = noise_scan(std::ssize(m.theta), rows, columns, seed);
  scan.geometry.theta_rad = m.theta;
  scan.geometry.row_shift = m.shift;
  return scan;
}

const std::vector<Motion>& motions() {
  static const std::vector<Motion> all{stands(3, 60, pi, 7),        stands(3, 60, 2 * pi, 7.3),
                                       stands(3, 60, pi, 6.4, 0.5), stands(2, 61, 2 * pi, 8.5, 0.31),
                                       helix(240, 3, 12),           helix(241, 2.5, 7.7, 0.3),
                                       helix(400, 5, 3.1)};
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_object_comes_out_right_however_it_moved) {
  for (const Motion& m : motions()) {
    const ProjectionSet scan = put_together(of_balls(m, 11));
    BOOST_TEST_REQUIRE(!scan.geometry.series.none());
    BOOST_TEST_REQUIRE(scan.geometry.rows >= 13);
    const double off = off_by(scan, middle_of(scan), 6);
    BOOST_TEST_CONTEXT(m.name << " of " << m.theta.size() << " views, " << scan.geometry.rows << " heights")
    BOOST_TEST(off <= promised);
  }
}

BOOST_AUTO_TEST_CASE(rows_seen_once_are_as_measured_and_those_seen_twice_are_a_tall_detector_s) {
  const Motion m = stands(3, 20, pi, 7);
  const ProjectionSet scan = put_together(of_balls(m, 11));
  BOOST_TEST_REQUIRE(scan.geometry.rows == 25);
  BOOST_TEST_REQUIRE(scan.geometry.views() == 20);
  Motion still = stands(1, 20, pi, 0);
  const ProjectionSet tall = of_balls(still, 25);
  for (std::size_t i = 0; i < scan.data.size(); ++i)
    BOOST_TEST(std::abs(static_cast<double>(scan.data[i]) - static_cast<double>(tall.data[i])) <=
               2 * tolerance::unit_roundoff * std::abs(static_cast<double>(tall.data[i])));
}

// Of a height that is covered weights are those of a rule for sums over directions.
BOOST_AUTO_TEST_CASE(weights_add_to_the_period_and_follow_functions_of_the_direction) {
  for (const Motion& m : motions()) {
    const HeightSeries series = series_of(like(m, 11, 20).geometry, false);
    const WeightsByHeight weights(series);
    BOOST_TEST_REQUIRE(weights.covered().size() == 1U);
    const auto w = view_weights(weights.theta_rad()).weight;
    const auto [first, count] = weights.covered().front();
    for (std::int64_t n = first; n < first + count; ++n) {
      double sum = 0, wave = 0;
      for (std::int64_t view = 0; view < std::ssize(w); ++view)
        for (const std::int64_t k : weights.measured(view)) {
          const double W = weights.share(k, n) * w[at(view)];
          BOOST_TEST(W >= 0);
          sum += W;
          wave += W * std::pow(std::cos(m.theta[at(k)]), 2);
        }
      BOOST_TEST(std::abs(sum - pi) < 1e-9);
      // The trapezoid rule of gaps up to h errs by h^2 / 12 times the variation of the slope, 4 here; gaps
      // are up to four times as wide as half of the heights have them, which is 40 directions or more.
      BOOST_TEST(std::abs(wave - pi / 2) < std::pow(4 * pi / 40, 2) / 12 * 4);
    }
  }
}

BOOST_AUTO_TEST_CASE(verify_puts_the_same_rows_together) {
  std::mt19937 random(3);
  const auto share = [&] { return static_cast<double>(random()) / 4294967296.0; };
  int several = 0;
  for (int i = 0; i < 40; ++i) {
    const auto rows = static_cast<std::int64_t>(1 + random() % 14);
    const double step = (0.4 + 0.5 * share()) * static_cast<double>(rows), turns = 1 + 2 * share();
    const bool whole = random() % 2 == 0, half = i % 4 == 3;
    Motion m = i % 2 == 0 ? stands(3, 14, half ? 2 * pi : pi, whole ? std::floor(step) : step,
                                   random() % 2 == 0 ? 0 : share())
                          : helix(40, turns, half ? 0.9 * step : 1.8 * step, 0.3 * share());
    ProjectionSet own = noise_of(m, rows, 32, static_cast<unsigned>(random()));
    if (half) own.geometry.center = 10;
    Preparation wanted;
    wanted.heights = Heights::all;
    if (half) wanted.half_acquisition = true;
    ProjectionSet scan = own;
    try {
      bring_to_heights(scan, wanted, 0, {});
    } catch (const InputError&) {
      continue;  // no height, or not one run
    }
    if (scan.geometry.series.none()) continue;  // no motion
    static_cast<void>(extend_rows(scan, wanted));
    FieldOptions field;
    field.preparation = scan.report.preparation;
    const ProjectionSet again = rows_to_verify(own, field);
    BOOST_TEST((again.geometry == scan.geometry));
    BOOST_TEST((again.report.preparation == scan.report.preparation));
    BOOST_REQUIRE(again.data.size() == scan.data.size());
    double largest = 0;
    for (const float p : scan.data) largest = std::max(largest, std::abs(static_cast<double>(p)));
    // Sums of products in double, whose shares carry what angles lost when they were folded.
    for (std::size_t s = 0; s < scan.data.size(); ++s)
      BOOST_TEST(std::abs(static_cast<double>(again.data[s]) - static_cast<double>(scan.data[s])) <=
                 4 * tolerance::unit_roundoff * std::abs(static_cast<double>(scan.data[s])) +
                     1e-12 * largest);
    ++several;
  }
  BOOST_TEST(several > 25);
}

BOOST_AUTO_TEST_CASE(certificates_hold_and_wrong_shifts_are_found) {
  for (const Motion& m : {stands(2, 16, pi, 3.3), helix(48, 2, 4.2)}) {
    const ProjectionSet measured = noise_of(m, 6, 24, 5);
    const ProjectionSet scan = put_together(measured);
    BOOST_TEST_REQUIRE(!scan.geometry.series.none());
    CertifyOptions options;
    options.grid.size = Index3{6, 6, 2};
    const BuildResult built = certify(device(), scan, Tolerance{.relative = 0.05}, options);
    const VerifyResult found = verify(device(), rows_to_verify(measured, built.certificate.field),
                                      built.volume, built.certificate, {.exhaustive = true});
    BOOST_TEST(found.holds, found.failure);
    ProjectionSet wrong = measured;
    wrong.geometry.row_shift[7] += 0.4;
    BOOST_TEST(!verify(device(), rows_to_verify(wrong, built.certificate.field), built.volume,
                       built.certificate, {.exhaustive = true})
                    .holds);
  }
}

// By turns, as views of stands and of a helix share theirs.
BOOST_AUTO_TEST_CASE(sigma_is_the_spread_of_repeated_scans) {
  constexpr double sigma_p = 0.1;
  constexpr int scans = 80;
  for (const Motion& m : {stands(3, 40, pi, 5.5), helix(160, 2, 9)}) {
    const ProjectionSet ideal = of_balls(m, 9, 41);
    const ProjectionSet scan = put_together(ideal);
    BOOST_TEST_REQUIRE(!scan.geometry.series.none());
    GridOptions options;
    options.size = Index3{4, 4, scan.geometry.rows - 1};
    options.spacing = 5;
    options.spacing_z = 1;
    const Grid grid = make_grid(scan, options);
    const auto model = scan_noise(scan, {.sigma_p = sigma_p})->model;
    const Volume predicted = noise_of_field(device(), scan, {}, model, grid);
    std::vector<double> sum(predicted.samples.size()), square(sum.size());
    for (int i = 0; i < scans; ++i) {
      ProjectionSet one = ideal;
      std::mt19937 random(static_cast<unsigned>(100 + i));
      std::normal_distribution<double> normal(0, sigma_p);
      for (float& p : one.data) p = static_cast<float>(normal(random));
      const Volume F = reconstruct(device(), put_together(one), grid, {});
      for (std::size_t p = 0; p < sum.size(); ++p) {
        const auto value = static_cast<double>(F.samples[p]);
        sum[p] += value;
        square[p] += value * value;
      }
    }
    double ratio = 0;
    for (std::size_t p = 0; p < sum.size(); ++p) {
      const double spread = std::sqrt((square[p] - sum[p] * sum[p] / scans) / (scans - 1)),
                   of_one = spread / static_cast<double>(predicted.samples[p]);
      // Four and a half standard errors of a spread: of 1,000 points none is beyond by chance. S between rows
      // of unlike shares is taken as that of equal ones.
      BOOST_TEST(std::abs(of_one - 1) < 4.5 / std::sqrt(2.0 * (scans - 1)) + 0.1);
      ratio += of_one / static_cast<double>(sum.size());
    }
    BOOST_TEST_MESSAGE(m.name << ": spread over sigma " << ratio);
    BOOST_TEST(std::abs(ratio - 1) < 0.03);
  }
}

BOOST_AUTO_TEST_CASE(the_centre_is_found_behind_a_series) {
  for (const Motion& m : {stands(3, 60, 2 * pi, 7.3), helix(360, 3, 11)}) {
    const auto found = find_center(put_together(of_balls(m, 11, 57, 2.3)));
    BOOST_REQUIRE(found.has_value());
    BOOST_TEST(std::abs(found->center - (28 - 2.3)) < 0.25);
  }
}

BOOST_AUTO_TEST_CASE(parts_of_a_helix_are_views_as_they_were_measured) {
  const ProjectionSet scan = put_together(of_balls(helix(240, 3, 12), 11));
  const auto middle = views_of_middle(scan);
  BOOST_REQUIRE(middle.has_value());
  BOOST_TEST(middle->geometry.series.none());
  BOOST_TEST(middle->geometry.views() < scan.geometry.views());
  const std::int64_t rows = middle->geometry.rows, first = (scan.geometry.rows - rows) / 2;
  const Phantom balls = smooth_balls();
  for (std::int64_t k = 0; k < middle->geometry.views(); ++k)
    for (std::int64_t j = 0; j < rows; ++j)
      for (std::int64_t i = 0; i < 57; ++i)
        BOOST_TEST(std::abs(static_cast<double>(middle->data[at((k * rows + j) * 57 + i)]) -
                            balls.line_integral(
                                middle->geometry.theta_rad[at(k)], static_cast<double>(i) - 28,
                                static_cast<double>(first + j) -
                                    0.5 * static_cast<double>(scan.geometry.rows - 1) + middle_of(scan))) <=
                   12 * promised);  // of 12 at most
  BOOST_TEST(!views_of_middle(put_together(of_balls(stands(3, 20, pi, 7), 11))).has_value());
}

BOOST_AUTO_TEST_CASE(heights_that_cannot_be_put_together_are_refused) {
  const auto refusal = [](const ProjectionSet& scan, const Preparation& wanted = {}) {
    try {
      ProjectionSet copy = scan;
      bring_to_heights(copy, wanted, 0, {});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  BOOST_TEST(refusal(of_balls(stands(2, 20, pi, 14), 11)).find("what lies between is not") !=
             std::string::npos);
  BOOST_TEST(refusal(of_balls(helix(120, 2, 4e9), 11)).find("cannot see them all") != std::string::npos);
  BOOST_TEST(refusal(of_balls(helix(120, 2, 40), 11)).find("heights is seen from every direction") !=
             std::string::npos);
  ProjectionSet leaning = of_balls(stands(2, 20, pi, 7), 11);
  leaning.geometry.axis_roll_deg = 1;
  BOOST_TEST(refusal(leaning, wanting(Heights::all)).find("leans") != std::string::npos);
  // Half acquisition that nobody stated: its weights would have been others.
  ProjectionSet half = put_together(of_balls(stands(2, 90, 2 * pi, 7), 11, 40, 12));
  BOOST_CHECK_THROW(static_cast<void>(extend_rows(half, {})), InputError);
  // Common heights where they are asked for, and where most are shared.
  ProjectionSet common = of_balls(stands(2, 20, pi, 8), 11);
  bring_to_heights(common, wanting(Heights::common), 0, {});
  BOOST_TEST(common.geometry.rows == 3);
  ProjectionSet most = of_balls(stands(2, 20, pi, 4), 11);
  bring_to_heights(most, {}, 0, {});
  BOOST_TEST(most.geometry.rows == 7);
  BOOST_TEST(most.geometry.series.none());
}
