// An axis that leans in the detector's plane (docs/geometry.md, "A leaning axis"): F against the object,
// upright rows against sums written out and against verify's own, their linearity, what noise becomes of, the
// roll found, and certificates, which another roll breaks.
#define BOOST_TEST_MODULE roll
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/scan/prepare/heights.hpp"
#include "host/scan/prepare/upright_rows.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/smooth_balls.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/find_roll.hpp"
#include "vdvr/expert/rows_to_verify.hpp"
#include "vdvr/expert/verify.hpp"

using namespace vdvr;
using support::device;
using vdvr::testing::noise_scan;
using vdvr::testing::off_by;
using vdvr::testing::smooth_balls;

namespace {

SimulateOptions leaning(double roll_deg, int views = 90) {
  SimulateOptions o;
  o.angles = views;
  o.columns = 57;
  o.rows = 41;
  o.axis_roll_deg = roll_deg;
  return o;
}

ProjectionSet upright(ProjectionSet scan) {
  bring_to_heights(scan, {}, 0, {});
  return scan;
}

// Noise of views that lean, and stood elsewhere each where a reach is given.
ProjectionSet leaning_noise(std::int64_t views, std::int64_t rows, std::int64_t columns, double roll_deg,
                            unsigned seed, double u = 0, double v = 0) {
  ProjectionSet scan = noise_scan(views, rows, columns, seed);
  scan.geometry.axis_roll_deg = roll_deg;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-1, 1);
  for (std::int64_t k = 0; k < views; ++k) {
    if (u > 0) scan.geometry.column_shift.push_back(u * share(random));
    if (v > 0) scan.geometry.row_shift.push_back(v * share(random));
  }
  return scan;
}

// The cosine series through n samples, term by term.
double series(const std::vector<double>& x, double place) {
  const auto n = static_cast<double>(x.size());
  double sum = 0;
  for (std::size_t m = 0; m < x.size(); ++m) {
    const double w = std::numbers::pi * static_cast<double>(m) / n;
    double a = 0;
    for (std::size_t v = 0; v < x.size(); ++v) a += x[v] * std::cos(w * (static_cast<double>(v) + 0.5));
    sum += (m == 0 ? 1 : 2) / n * a * std::cos(w * (place + 0.5));
  }
  return sum;
}

// Sample (row, column) of view k on upright rows: along each measured column first, then along the row. `u`
// and `v` count from the detector's middle in world units, as the header of upright_rows has them.
double by_definition(const ProjectionSet& own, const ParallelGeometry& rows, std::int64_t k, std::int64_t row,
                     std::int64_t column, double moved) {
  const ParallelGeometry& g = own.geometry;
  const double roll = g.axis_roll_deg * std::numbers::pi / 180, c = std::cos(roll), s = std::sin(roll);
  const auto middle = [](std::int64_t n) { return 0.5 * static_cast<double>(n - 1); };
  const double t = (static_cast<double>(column) - middle(rows.columns)) * g.pitch_u,
               z = (static_cast<double>(row) - middle(rows.rows) + moved) * g.pitch_v;
  std::vector<double> along_row;
  for (std::int64_t i = 0; i < g.columns; ++i) {
    const double u = (static_cast<double>(i) - middle(g.columns)) * g.pitch_u, v = (z - u * s) / c;
    std::vector<double> along_column;
    for (std::int64_t j = 0; j < g.rows; ++j)
      along_column.push_back(static_cast<double>(own.data[at((k * g.rows + j) * g.columns + i)]));
    along_row.push_back(series(along_column, v / g.pitch_v + middle(g.rows)));
  }
  return series(along_row, (t * c + z * s) / g.pitch_u + middle(g.columns));
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_object_comes_out_as_if_the_axis_stood_upright) {
  // What the feature promises of smooth parts.
  constexpr double promised = 0.01;
  for (const double roll : {1.5, -0.7, 6.0}) {
    const ProjectionSet own = simulate(smooth_balls(), leaning(roll));
    const double right = off_by(upright(own));
    BOOST_TEST(right < promised);
    // What this would not see if it could not fail: no roll, and twice as far off.
    for (const double share : {0.0, -1.0}) {
      ProjectionSet other = own;
      other.geometry.axis_roll_deg = share * roll;
      const double wrong = off_by(upright(other));
      // A point 12 from the axis and 4 high lies off by 12 times the roll, where densities change by .03 a
      // pixel and more.
      BOOST_TEST(wrong > right + 0.03 * 12 * (1 - share) * std::abs(roll) * std::numbers::pi / 180);
    }
  }
}

BOOST_AUTO_TEST_CASE(an_axis_off_the_middle_and_oblong_pixels_change_nothing) {
  SimulateOptions o = leaning(2);
  o.detector_offset = 3.3;
  o.pitch_u = 0.8;
  o.pitch_v = 1.1;
  o.columns = 75;
  const ProjectionSet scan = upright(simulate(smooth_balls(), o));
  // Counted in the detector's columns, across the axis from its middle.
  BOOST_TEST(std::abs(scan.geometry.center + static_cast<double>(scan.geometry.extension.cut) - (37 - 3.3)) <
             1e-9);
  BOOST_TEST(off_by(scan) < 0.01);
}

BOOST_AUTO_TEST_CASE(shifts_along_rows_and_columns_are_turned_with_the_detector) {
  SimulateOptions o = leaning(3);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int k = 0; k < o.angles; ++k) o.shifts.push_back({3 * share(random), 2 * share(random)});
  const ProjectionSet own = simulate(smooth_balls(), o);
  BOOST_TEST(off_by(upright(own)) < 0.01);
  ProjectionSet still = own;
  still.geometry.column_shift.clear();
  BOOST_TEST(off_by(upright(still)) > 0.05);
}

BOOST_AUTO_TEST_CASE(upright_rows_are_two_series_written_out) {
  std::mt19937 random(3);
  for (int i = 0; i < 12; ++i) {
    const auto rows = static_cast<std::int64_t>(9 + random() % 9),
               columns = static_cast<std::int64_t>(8 + random() % 14);
    const bool moves = i % 3 == 2;
    ProjectionSet own = leaning_noise(3, rows, columns, (i % 2 == 0 ? 1 : -1) * (0.3 + 0.8 * i),
                                      static_cast<unsigned>(random()), moves ? 1 : 0, moves ? 1.5 : 0);
    own.geometry.pitch_v = i % 4 == 3 ? 1.3 : 1;
    const ProjectionSet scan = upright(own);
    const ParallelGeometry& g = scan.geometry;
    double middle = 0;
    if (moves) {
      const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
      middle = 0.5 * (*least + *most);
    }
    for (std::int64_t k = 0; k < 3; ++k)
      for (std::int64_t row = 0; row < g.rows; ++row)
        for (std::int64_t column = 0; column < g.columns; ++column) {
          const double wanted =
                           by_definition(own, g, k, row, column, moves ? g.row_shift[at(k)] - middle : 0),
                       got = static_cast<double>(scan.data[at((k * g.rows + row) * g.columns + column)]);
          // One rounding, and those of sums of so many terms of at most 3 (S_v's row sum) times 1/2.
          BOOST_TEST(std::abs(got - wanted) <= tolerance::unit_roundoff * std::abs(wanted) +
                                                   tolerance::fp64_sum(40 * (rows + columns), 4));
        }
  }
}

BOOST_AUTO_TEST_CASE(verify_brings_rows_upright_by_its_own_means) {
  std::mt19937 random(7);
  for (int i = 0; i < 24; ++i) {
    const auto rows = static_cast<std::int64_t>(9 + random() % 12),
               columns = static_cast<std::int64_t>(8 + random() % 16);
    const double roll = (static_cast<double>(random() % 2000) - 1000) / 200;
    const bool moves = i % 3 == 1;
    const ProjectionSet own = leaning_noise(5, rows, columns, roll, static_cast<unsigned>(random()),
                                            moves ? 2 : 0, moves && i % 2 == 0 ? 1 : 0);
    const ProjectionSet scan = upright(own);
    FieldOptions field;
    field.preparation = scan.report.preparation;
    ProjectionSet again = rows_to_verify(own, field);
    for (std::size_t k = 0; k < again.geometry.column_shift.size(); ++k)
      for (const auto shift : {&ParallelGeometry::column_shift, &ParallelGeometry::row_shift}) {
        BOOST_TEST(std::abs((again.geometry.*shift)[k] - (scan.geometry.*shift)[k]) <=
                   tolerance::fp64_sum(4, 3));
        (again.geometry.*shift)[k] = (scan.geometry.*shift)[k];
      }
    BOOST_TEST((again.geometry == scan.geometry));
    BOOST_TEST((again.report.preparation == scan.report.preparation));
    BOOST_REQUIRE(again.data.size() == scan.data.size());
    for (std::size_t s = 0; s < scan.data.size(); ++s)
      BOOST_TEST(std::abs(static_cast<double>(again.data[s]) - static_cast<double>(scan.data[s])) <=
                 2 * tolerance::unit_roundoff * std::abs(static_cast<double>(scan.data[s])) +
                     tolerance::fp64_sum(40 * (rows + columns), 4));
  }
}

BOOST_AUTO_TEST_CASE(upright_rows_are_linear_and_keep_a_constant) {
  const ProjectionSet a = leaning_noise(2, 15, 16, 2.5, 1), b = leaning_noise(2, 15, 16, 2.5, 2);
  ProjectionSet both = a, constant = a;
  for (std::size_t i = 0; i < both.data.size(); ++i) {
    both.data[i] = 2 * a.data[i] - 3 * b.data[i];
    constant.data[i] = 0.75f;
  }
  const ProjectionSet ua = upright(a), ub = upright(b), sum = upright(both), flat = upright(constant);
  for (std::size_t i = 0; i < sum.data.size(); ++i) {
    const double wanted = 2 * static_cast<double>(ua.data[i]) - 3 * static_cast<double>(ub.data[i]);
    // Roundings of the inputs' sums and of three outputs.
    BOOST_TEST(std::abs(static_cast<double>(sum.data[i]) - wanted) <=
               16 * tolerance::unit_roundoff * 2.5 * 3);
  }
  for (const float p : flat.data) BOOST_TEST(p == 0.75f);
}

BOOST_AUTO_TEST_CASE(no_roll_leaves_a_scan_as_it_is) {
  const ProjectionSet own = noise_scan(3, 6, 9), scan = upright(own);
  BOOST_TEST((scan.geometry == own.geometry));
  BOOST_TEST(std::equal(scan.data.begin(), scan.data.end(), own.data.begin()));
  BOOST_TEST(!scan.report.preparation.heights.has_value());
}

// White noise stays white to 1 / c of its variance, which is what docs/noise.md takes it for.
BOOST_AUTO_TEST_CASE(noise_keeps_its_variance) {
  for (const double roll : {0.7, 1.5, 10.0}) {
    const ProjectionSet own = leaning_noise(400, 40, 48, roll, 11), scan = upright(own);
    const ParallelGeometry& g = scan.geometry;
    double sum = 0, beside = 0, below = 0;
    std::int64_t n = 0;
    // A quarter of the detector from its edges, where the mirror image adds its share.
    for (std::int64_t k = 0; k < g.views(); ++k)
      for (std::int64_t j = g.rows / 4; j < 3 * g.rows / 4; ++j)
        for (std::int64_t i = g.columns / 4; i < 3 * g.columns / 4; ++i) {
          const float* p = scan.data.data() + (k * g.rows + j) * g.columns + i;
          sum += static_cast<double>(p[0]) * static_cast<double>(p[0]);
          beside += static_cast<double>(p[0]) * static_cast<double>(p[1]);
          below += static_cast<double>(p[0]) * static_cast<double>(p[g.columns]);
          ++n;
        }
    const double
        variance = 1.0 / 12,
        c = std::cos(roll * std::numbers::pi / 180),
        // Of a mean of n squares of a uniform variate: variance times sqrt(4/5 / n); five deviations.
        spread = 5 * std::sqrt(2.0 / static_cast<double>(n));
    BOOST_TEST(std::abs(sum / static_cast<double>(n) / variance - 1) < 2 * (1 / c - 1) + 1.0 / 40 + spread);
    BOOST_TEST(std::abs(beside / static_cast<double>(n) / variance) < 2 * (1 / c - 1) + 1.0 / 40 + spread);
    BOOST_TEST(std::abs(below / static_cast<double>(n) / variance) < 2 * (1 / c - 1) + 1.0 / 40 + spread);
  }
}

BOOST_AUTO_TEST_CASE(pixels_of_upright_rows_are_the_nearest_ones) {
  const ProjectionSet own = leaning_noise(2, 31, 24, 5, 1);
  ProjectionSet marked = own;
  // A plane: what an upright sample shows is its place.
  for (std::int64_t j = 0; j < 31; ++j)
    for (std::int64_t i = 0; i < 24; ++i) {
      marked.data[at(j * 24 + i)] = static_cast<float>(i);
      marked.data[at((31 + j) * 24 + i)] = static_cast<float>(j);
    }
  const ProjectionSet scan = upright(marked);
  const ParallelGeometry& g = scan.geometry;
  for (std::int64_t j = g.rows / 4; j < 3 * g.rows / 4; ++j)
    for (std::int64_t i = g.columns / 4; i < 3 * g.columns / 4; ++i) {
      const std::int64_t pixel = nearest_pixel(g, 31, 24, j, i);
      // Half a pixel, and how far a plane's series is from it so far from the edges.
      BOOST_TEST(std::abs(static_cast<double>(scan.data[at(j * g.columns + i)]) -
                          static_cast<double>(pixel % 24)) < 0.75);
      BOOST_TEST(std::abs(static_cast<double>(scan.data[at((g.rows + j) * g.columns + i)]) -
                          static_cast<double>(pixel / 24)) < 0.75);
    }
}

BOOST_AUTO_TEST_CASE(the_roll_is_found_and_how_sure_it_is) {
  for (const double arc : {360.0, 180.0})
    for (const double roll : {1.5, -0.7, 8.0, 0.0}) {
      SimulateOptions o = leaning(roll, 120);
      o.arc_deg = arc;
      o.noise_sigma = 0.01;
      ProjectionSet scan = simulate(smooth_balls(), o);
      scan.geometry.axis_roll_deg = 0;
      const auto found = find_roll(scan);
      BOOST_REQUIRE(found.has_value());
      // Smooth balls on 41 rows: a tenth of a degree moves the axis by .03 columns at the outermost.
      BOOST_TEST(std::abs(found->roll_deg - roll) < std::max(0.1, 4 * found->uncertainty_deg));
      BOOST_TEST(found->uncertainty_deg < 0.2);
      BOOST_TEST(found->significant == (roll != 0));
    }
  BOOST_TEST(!find_roll(noise_scan(8, 2, 16)).has_value());
}

BOOST_AUTO_TEST_CASE(a_roll_that_leaves_nothing_is_refused) {
  for (const double roll : {std::nan(""), 10.5, -HUGE_VAL, 9.0}) {
    ProjectionSet scan = noise_scan(3, 3, 40);
    scan.geometry.axis_roll_deg = roll;
    BOOST_CHECK_THROW(bring_to_heights(scan, {}, 0, {}), InputError);
  }
  ProjectionSet scan = noise_scan(3, 6, 8);
  scan.geometry.axis_roll_deg = 1;
  BOOST_CHECK_THROW(static_cast<void>(check_scan(scan.geometry)), InputError);  // rows as they were seen
}

BOOST_AUTO_TEST_CASE(certificates_hold_for_rolls_that_verify_follows_itself) {
  for (const bool moves : {false, true})
    for (const Padding padding : {Padding::none, Padding::edge}) {
      const ProjectionSet measured = leaning_noise(24, 9, 30, 1.8, 4, moves ? 2 : 0, moves ? 0.6 : 0);
      ProjectionSet scan = upright(measured);
      Preparation wanted;
      wanted.padding = padding;
      wanted.half_acquisition = false;
      static_cast<void>(extend_rows(scan, wanted));
      scan.report.preparation.heights = Heights::common;
      CertifyOptions options;
      options.grid.size = Index3{6, 6, 1};
      const BuildResult built = certify(device(), scan, Tolerance{.relative = 0.05}, options);
      const VerifyResult found = verify(device(), rows_to_verify(measured, built.certificate.field),
                                        built.volume, built.certificate, {.exhaustive = true});
      BOOST_TEST(found.holds, found.failure);
      ProjectionSet wrong = measured;
      wrong.geometry.axis_roll_deg += 0.4;
      BOOST_TEST(!verify(device(), rows_to_verify(wrong, built.certificate.field), built.volume,
                         built.certificate, {.exhaustive = true})
                      .holds);
    }
}
