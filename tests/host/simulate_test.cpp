#define BOOST_TEST_MODULE simulate
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <thread>

#include "host/scan/simulate/simulate_band_limit.hpp"
#include "host/scan/simulate/simulate_detector.hpp"
#include "tests/reference/band_limit.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;

void check_close(double value, double expected, double tolerance) {
  BOOST_TEST(std::abs(value - expected) <= tolerance,
             value << " against " << expected << ", tolerance " << tolerance);
}

SimulateOptions small(bool band_limited = false) {
  SimulateOptions o;
  o.angles = 6;
  o.columns = 21;
  o.rows = 13;
  o.band_limited = band_limited;
  return o;
}

double at(const ProjectionSet& s, std::int64_t k, std::int64_t j, std::int64_t i) {
  return static_cast<double>(
      s.data[static_cast<std::size_t>((k * s.geometry.rows + j) * s.geometry.columns + i)]);
}

// The low-pass's largest gain on any row: sum |w| <= (4/pi^2 log U + 1) * 2 for a Dirichlet kernel and its
// mirror; 8 holds for every U used here.
double low_pass_tolerance(std::int64_t columns) { return tolerance::fp64_sum(32 * columns, 8); }

std::vector<double> low_passed(const std::vector<double>& fine, std::int64_t columns) {
  std::vector<double> out(fine.size() / 16, std::nan(""));
  BandLimiter(columns).apply(fine, out);
  return out;
}

Phantom off_centre() {
  return ellipsoid_list({{1, {2, -1, 0.5}, {5, 3, 4}, 20}, {0.5, {-3, 2, 0}, {2, 4, 2}, 0}}, 0, "off-centre");
}

}  // namespace

BOOST_AUTO_TEST_CASE(cosines_below_nyquist_pass_unchanged_and_all_others_vanish) {
  for (const std::int64_t columns : {1, 2, 5, 8}) {
    const std::int64_t n = 16 * columns;
    for (std::int64_t m = 0; m < n; ++m) {  // a basis of all rows
      std::vector<double> fine;
      for (std::int64_t k = 0; k < n; ++k)
        fine.push_back(
            std::cos(pi * static_cast<double>(m * (2 * k + 1) % (4 * n)) / static_cast<double>(2 * n)));
      const auto out = low_passed(fine, columns);
      for (std::int64_t i = 0; i < columns; ++i) {
        const double kept = std::cos(pi * static_cast<double>(m * (2 * i + 1) % (4 * columns)) /
                                     static_cast<double>(2 * columns));
        check_close(out[static_cast<std::size_t>(i)], m < columns ? kept : 0, low_pass_tolerance(columns));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(low_pass_matches_reference_for_any_number_of_rows) {
  std::mt19937 random(3);
  for (const std::int64_t columns : {1, 7, 64, 129, 160})
    for (const std::int64_t rows : {1, 16, 19}) {
      std::vector<double> fine(static_cast<std::size_t>(16 * columns * rows));
      for (double& x : fine) x = static_cast<double>(random()) * 0x1p-32;
      const auto out = low_passed(fine, columns);
      for (const std::int64_t row : {std::int64_t{0}, rows - 1}) {
        const std::vector<double> one(fine.begin() + row * 16 * columns,
                                      fine.begin() + (row + 1) * 16 * columns);
        const auto expected = reference::band_limited(one, static_cast<std::size_t>(columns));
        for (std::int64_t i = 0; i < columns; ++i)
          check_close(out[static_cast<std::size_t>(row * columns + i)], expected[static_cast<std::size_t>(i)],
                      low_pass_tolerance(columns));
      }
    }
}

BOOST_AUTO_TEST_CASE(point_views_are_line_integrals_at_pixel_centres) {
  const Phantom p = off_centre();
  SimulateOptions o = small();
  o.pitch_u = 0.75;
  o.pitch_v = 0.5;
  o.arc_deg = 120;
  const ProjectionSet s = simulate(p, o);
  BOOST_TEST(s.geometry.center == 10.0);
  BOOST_TEST(s.data.size() == static_cast<std::size_t>(s.size()));
  for (std::int64_t k = 0; k < 6; ++k) {
    const double theta = static_cast<double>(k) * 20 * pi / 180;
    check_close(s.geometry.theta_rad[static_cast<std::size_t>(k)], theta, tolerance::fp64_sum(4, pi));
    for (std::int64_t j = 0; j < o.rows; ++j)
      for (std::int64_t i = 0; i < o.columns; ++i)
        check_close(
            at(s, k, j, i),
            p.line_integral(theta, (static_cast<double>(i) - 10) * 0.75, (static_cast<double>(j) - 6) * 0.5),
            tolerance::fp32_sum(1, 12));
  }
}

BOOST_AUTO_TEST_CASE(band_limited_views_are_low_passed_fine_rows) {
  const Phantom p = off_centre();
  const SimulateOptions o = small(true);
  const ProjectionSet s = simulate(p, o);
  for (const std::int64_t k : {0, 4})
    for (const std::int64_t j : {3, 6}) {
      std::vector<double> fine;
      for (int n = 0; n < 16 * 21; ++n)  // pixel i holds u = i - 10 - 1/2 + (f + 1/2) / 16
        fine.push_back(p.line_integral(s.geometry.theta_rad[static_cast<std::size_t>(k)],
                                       n / 16 - 10.5 + (n % 16 + 0.5) / 16, static_cast<double>(j) - 6));
      const auto expected = reference::band_limited(fine, 21);
      for (std::int64_t i = 0; i < 21; ++i)
        check_close(at(s, k, j, i), expected[static_cast<std::size_t>(i)],
                    tolerance::fp32_sum(1, 16) + 12 * low_pass_tolerance(21));
    }
}

BOOST_AUTO_TEST_CASE(band_limited_rows_keep_the_mass_of_the_fine_rows) {
  const Phantom p = off_centre();
  const SimulateOptions o = small(true);
  const ProjectionSet s = simulate(p, o);
  for (std::int64_t k = 0; k < 6; ++k) {
    double mass = 0, fine = 0;
    for (std::int64_t i = 0; i < 21; ++i) mass += at(s, k, 6, i);
    for (int n = 0; n < 16 * 21; ++n)
      fine +=
          p.line_integral(s.geometry.theta_rad[static_cast<std::size_t>(k)], (n + 0.5) / 16 - 10.5, 0) / 16;
    check_close(mass, fine, tolerance::fp32_sum(21, 21 * 12));
  }
}

BOOST_AUTO_TEST_CASE(line_integrals_scale_with_the_pitch) {
  for (const bool band_limited : {false, true}) {
    SimulateOptions o = small(band_limited);
    o.columns = o.rows = 45;
    const ProjectionSet large = simulate(sphere(20), o);
    o.pitch_u = o.pitch_v = 0.1;
    const ProjectionSet scaled = simulate(sphere(2), o);
    // Near the edge a chord's square is a difference: a rounding of u^2 counts relative to the radius.
    for (std::size_t n = 0; n < large.data.size(); ++n)
      check_close(static_cast<double>(scaled.data[n]), 0.1 * static_cast<double>(large.data[n]),
                  tolerance::fp32_sum(2, 4) + std::sqrt(tolerance::fp64_sum(8, 16)));
  }
}

BOOST_AUTO_TEST_CASE(a_phantom_with_rays_only_gives_the_same_views) {
  Phantom p = off_centre();
  const ProjectionSet with = simulate(p, small(true));
  p.view_integrals = nullptr;
  const ProjectionSet without = simulate(p, small(true));
  BOOST_TEST((with.data == without.data));
}

BOOST_AUTO_TEST_CASE(half_a_turn_mirrors_the_view) {
  SimulateOptions o = small(true);
  o.arc_deg = 360;
  const ProjectionSet s = simulate(off_centre(), o);
  for (std::int64_t k = 0; k < 3; ++k)
    for (std::int64_t j = 0; j < o.rows; ++j)
      for (std::int64_t i = 0; i < o.columns; ++i)
        check_close(at(s, k, j, i), at(s, k + 3, j, o.columns - 1 - i),
                    tolerance::fp32_sum(2, 16) + 1e3 * low_pass_tolerance(21));
}

BOOST_AUTO_TEST_CASE(same_seed_same_noise_and_another_seed_another) {
  SimulateOptions o = small();
  o.noise_sigma = 0.05;
  const ProjectionSet a = simulate(off_centre(), o), b = simulate(off_centre(), o);
  BOOST_TEST((a.data == b.data));
  BOOST_TEST(a.report.sha256 == b.report.sha256);
  o.seed = 2;
  const ProjectionSet c = simulate(off_centre(), o);
  BOOST_TEST(!(a.data == c.data));
  BOOST_TEST(a.report.sha256 != c.report.sha256);
}

BOOST_AUTO_TEST_CASE(noise_has_the_stated_deviation_of_the_largest_integral) {
  SimulateOptions o;
  o.angles = 8;
  o.columns = o.rows = 65;
  o.band_limited = false;
  const ProjectionSet clean = simulate(sphere(20), o);
  o.noise_sigma = 0.03;
  const ProjectionSet noisy = simulate(sphere(20), o);
  const auto n = static_cast<double>(clean.data.size());
  double sum = 0, squares = 0, largest = 0;
  for (std::size_t i = 0; i < clean.data.size(); ++i) {
    const double d = static_cast<double>(noisy.data[i]) - static_cast<double>(clean.data[i]);
    sum += d;
    squares += d * d;
    largest = std::max(largest, static_cast<double>(clean.data[i]));
  }
  const double sigma = 0.03 * largest;
  check_close(largest, 40, tolerance::fp32_sum(1, 40));
  check_close(sum / n, 0, 5 * sigma / std::sqrt(n));  // five standard errors
  check_close(std::sqrt(squares / n), sigma, 5 * sigma / std::sqrt(2 * n));
}

BOOST_AUTO_TEST_CASE(normal_deviates_have_normal_moments_and_follow_seed_and_view) {
  View a{500, 401, std::vector<double>(500 * 401)}, b = a, c = a;
  add_noise(a, 1, 9, 3);
  add_noise(b, 1, 9, 3);
  add_noise(c, 1, 9, 4);
  BOOST_TEST((a.data == b.data));
  BOOST_TEST(!(a.data == c.data));
  const auto n = static_cast<double>(a.data.size());
  double third = 0, fourth = 0, together = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    third += std::pow(a.data[i], 3);
    fourth += std::pow(a.data[i], 4);
    together += a.data[i] * c.data[i];
  }
  check_close(third / n, 0, 5 * std::sqrt(15 / n));  // E x^6 = 15, E x^8 = 105
  check_close(fourth / n, 3, 5 * std::sqrt(96 / n));
  check_close(together / n, 0, 5 / std::sqrt(n));  // views are independent
}

BOOST_AUTO_TEST_CASE(binning_is_the_mean_of_the_finer_detector) {
  SimulateOptions o = small();
  o.pitch_v = 0.5;
  o.binning = 3;
  const ProjectionSet binned_scan = simulate(off_centre(), o);
  BOOST_TEST(binned_scan.geometry.columns == 21);
  BOOST_TEST(binned_scan.geometry.pitch_u == 1.0);
  o.binning = 1;
  o.columns *= 3;
  o.rows *= 3;
  o.pitch_u /= 3;
  o.pitch_v /= 3;
  const ProjectionSet fine = simulate(off_centre(), o);
  for (std::int64_t k = 0; k < 6; ++k)
    for (std::int64_t j = 0; j < 13; ++j)
      for (std::int64_t i = 0; i < 21; ++i) {
        double sum = 0;
        for (int b = 0; b < 3; ++b)
          for (int a = 0; a < 3; ++a) sum += at(fine, k, 3 * j + b, 3 * i + a);
        check_close(at(binned_scan, k, j, i), sum / 9, tolerance::fp32_sum(2, 12));
      }
}

BOOST_AUTO_TEST_CASE(median_removes_lone_pixels_and_keeps_edges) {
  View view{9, 7, std::vector<double>(63)};
  for (std::int64_t j = 0; j < 7; ++j)
    for (std::int64_t i = 0; i < 9; ++i) view.at(i, j) = i < 4 ? 1 : 2;
  const View clean = view;
  view.at(2, 3) = 100;
  view.at(8, 6) = -100;
  BOOST_TEST(median_filtered(view, 3).data == clean.data);
  BOOST_TEST(median_filtered(view, 1).data == view.data);
}

BOOST_AUTO_TEST_CASE(median_is_the_middle_of_the_mirrored_window) {
  std::mt19937 random(5);
  View view{6, 3, std::vector<double>(18)};
  for (double& x : view.data) x = static_cast<double>(random());
  const View out = median_filtered(view, 5);
  for (std::int64_t j = 0; j < 3; ++j)
    for (std::int64_t i = 0; i < 6; ++i) {
      std::vector<double> window;
      for (std::int64_t b = -2; b <= 2; ++b)
        for (std::int64_t a = -2; a <= 2; ++a) {
          const std::int64_t x = i + a < 0 ? -1 - (i + a) : i + a > 5 ? 11 - (i + a) : i + a;
          const std::int64_t y = j + b < 0 ? -1 - (j + b) : j + b > 2 ? 5 - (j + b) : j + b;
          window.push_back(view.at(x, y));
        }
      std::sort(window.begin(), window.end());
      BOOST_TEST(out.at(i, j) == window[12]);
    }
}

BOOST_AUTO_TEST_CASE(mirror_repeats_the_last_pixel) {
  BOOST_TEST(mirrored(-1, 4) == 0);
  BOOST_TEST(mirrored(4, 4) == 3);
  BOOST_TEST(mirrored(7, 4) == 0);
  BOOST_TEST(mirrored(8, 4) == 0);
  BOOST_TEST(mirrored(-9, 4) == 0);
  BOOST_TEST(mirrored(5, 1) == 0);
}

BOOST_AUTO_TEST_CASE(gaussian_has_its_deviations_and_keeps_the_sum) {
  View view{61, 81, std::vector<double>(61 * 81)};
  view.at(30, 40) = 1;
  const View out = gaussian_filtered(view, 1.5, 4);
  double sum = 0, uu = 0, vv = 0;
  for (std::int64_t j = 0; j < 81; ++j)
    for (std::int64_t i = 0; i < 61; ++i) {
      const auto x = static_cast<double>(i - 30), y = static_cast<double>(j - 40);
      sum += out.at(i, j);
      uu += out.at(i, j) * x * x;
      vv += out.at(i, j) * y * y;
    }
  check_close(sum, 1, tolerance::fp64_sum(200, 1));
  // Beyond 5 standard deviations lies 2 (5 phi(5) + Q(5)) = 1.54e-5 of the second moment.
  check_close(uu, 1.5 * 1.5, 1.6e-5 * 1.5 * 1.5);
  check_close(vv, 16, 1.6e-5 * 16);
  BOOST_TEST(gaussian_filtered(view, 0, 0).data == view.data);

  View edge{5, 4, std::vector<double>(20, 3.0)};  // mirrored edges: a constant stays one
  for (const double value : gaussian_filtered(edge, 2, 3).data)
    check_close(value, 3, tolerance::fp64_sum(60, 3));
}

BOOST_AUTO_TEST_CASE(detector_recipe_runs_in_the_stated_order) {
  SimulateOptions o = small();
  o.angles = 1;
  o.noise_sigma = 0.05;
  o.median = 3;
  o.gaussian_u = 0.5;
  o.gaussian_v = 1.5;
  o.binning = 2;
  const Phantom p = sphere(5);
  const ProjectionSet s = simulate(p, o);
  View view{42, 26, {}};
  for (int j = 0; j < 26; ++j)
    for (int i = 0; i < 42; ++i) view.data.push_back(p.line_integral(0, (i - 20.5) / 2, (j - 12.5) / 2));
  const double largest = *std::max_element(view.data.begin(), view.data.end());
  add_noise(view, 0.05 * largest, o.seed, 0);
  view = binned(gaussian_filtered(median_filtered(view, 3), 0.5, 1.5), 2);
  for (std::size_t n = 0; n < view.data.size(); ++n)
    check_close(static_cast<double>(s.data[n]), view.data[n], tolerance::fp32_sum(1, 12));
}

BOOST_AUTO_TEST_CASE(report_names_phantom_noise_and_truncation) {
  SimulateOptions o = small();
  const ProjectionSet inside = simulate(sphere(9), o);
  BOOST_TEST(inside.report.format == "simulated");
  BOOST_TEST(inside.report.name == "sphere");
  BOOST_TEST(inside.report.sha256.size() == 64u);
  BOOST_TEST(inside.report.notes.empty());
  o.noise_sigma = 0.1;
  const ProjectionSet outside = simulate(sphere(12), o);
  BOOST_TEST(outside.report.notes.size() == 2u);
  BOOST_TEST(outside.report.notes.at(0).find("6 of 6 views") != std::string::npos);
  BOOST_TEST(simulate(sphere(9, 2), small()).report.sha256 != inside.report.sha256);
  BOOST_TEST(simulate(sphere(9), small()).report.sha256 == inside.report.sha256);
}

BOOST_AUTO_TEST_CASE(the_papers_object_stays_on_its_detector) {
  SimulateOptions o;
  o.angles = 4;  // 45 degrees among them: the cube's edge is seen at 32 of 32.5 pixels
  o.columns = 65;
  o.rows = 5;
  BOOST_TEST(simulate(marschner_lobb(32 / std::sqrt(2.0)), o).report.notes.empty());
}

BOOST_AUTO_TEST_CASE(progress_comes_from_the_caller_and_rises_to_one) {
  const auto caller = std::this_thread::get_id();
  double last = 0;
  bool same_thread = true, rising = true;
  SimulateOptions o = small(true);
  o.angles = 40;
  o.noise_sigma = 0.01;
  simulate(sphere(5), o, [&](const std::string& stage, double fraction) {
    same_thread = same_thread && std::this_thread::get_id() == caller && stage == "simulate";
    rising = rising && fraction >= last && fraction <= 1;
    last = fraction;
  });
  BOOST_TEST(same_thread);
  BOOST_TEST(rising);
  BOOST_TEST(last == 1.0);
}

BOOST_AUTO_TEST_CASE(an_interrupt_or_a_failing_phantom_ends_it_cleanly) {
  SimulateOptions o = small(true);
  o.angles = 200;
  BOOST_CHECK_THROW(simulate(sphere(5), o, [](const std::string&, double) { throw Interrupted(130); }),
                    Interrupted);
  Phantom broken = sphere(5);
  broken.view_integrals = [](double theta, std::span<const double>, std::span<const double>,
                             std::span<double>) {
    if (theta > 1) throw InputError("broken");
  };
  BOOST_CHECK_THROW(simulate(broken, o), InputError);
}

BOOST_AUTO_TEST_CASE(a_background_is_refused_because_its_integrals_are_infinite) {
  const Phantom p = ellipsoid_list({{}}, 0.5, "with background");
  BOOST_TEST(p.density({7, 0, 0}) == 0.5);
  BOOST_TEST(std::isinf(p.line_integral(0, 0, 0)));
  BOOST_CHECK_THROW(simulate(p, small()), InputError);
}

BOOST_AUTO_TEST_CASE(unusable_options_are_refused) {
  const auto refused = [](auto change) {
    SimulateOptions o = small();
    change(o);
    BOOST_CHECK_THROW(simulate(sphere(5), o), InputError);
  };
  refused([](SimulateOptions& o) { o.angles = 0; });
  refused([](SimulateOptions& o) { o.arc_deg = 0; });
  refused([](SimulateOptions& o) { o.arc_deg = 360001; });
  refused([](SimulateOptions& o) {
    o.arc_deg = 361;
    o.cone = ConeSetup{.source_to_axis = 100, .source_to_detector = 150};
  });
  refused([](SimulateOptions& o) { o.columns = 0; });
  refused([](SimulateOptions& o) { o.rows = -3; });
  refused([](SimulateOptions& o) { o.pitch_u = 0; });
  refused([](SimulateOptions& o) { o.pitch_v = std::nan(""); });
  refused([](SimulateOptions& o) { o.noise_sigma = -0.1; });
  refused([](SimulateOptions& o) { o.noise_sigma = std::numeric_limits<double>::infinity(); });
  refused([](SimulateOptions& o) { o.median = 4; });
  refused([](SimulateOptions& o) { o.median = 23; });
  refused([](SimulateOptions& o) { o.gaussian_u = -1; });
  refused([](SimulateOptions& o) { o.gaussian_v = 1e9; });
  refused([](SimulateOptions& o) { o.binning = 0; });
}

BOOST_AUTO_TEST_CASE(projections_beyond_memory_are_the_same_in_scratch) {
  SimulateOptions o = small();
  o.noise_sigma = 0.01;
  o.angles = 100'000;
  const ProjectionSet in_memory = simulate(sphere(5), o);
  BOOST_TEST(!in_memory.data.scratch());
  o.scratch = ".";  // a disk, which a temporary folder need not be
  // More than a view of each thread, and less than eight times the result.
  o.max_memory_bytes = std::uint64_t{std::thread::hardware_concurrency()} * (std::uint64_t{8} << 20);
  BOOST_REQUIRE(o.max_memory_bytes < 8 * sizeof(float) * in_memory.data.size());
  const ProjectionSet in_scratch = simulate(sphere(5), o);
  BOOST_TEST(static_cast<bool>(in_scratch.data.scratch()));
  BOOST_TEST((in_scratch.data == in_memory.data));
}

BOOST_AUTO_TEST_CASE(sizes_beyond_memory_are_refused_before_allocation) {
  SimulateOptions o = small();
  o.max_memory_bytes = 1 << 10;
  BOOST_CHECK_THROW(simulate(sphere(5), o), ResourceError);
  o = small();
  o.columns = o.rows = std::int64_t{1} << 40;
  BOOST_CHECK_THROW(simulate(sphere(5), o), ResourceError);
  o.columns = o.rows = std::numeric_limits<std::int64_t>::max();
  BOOST_CHECK_THROW(simulate(sphere(5), o), ResourceError);
}
