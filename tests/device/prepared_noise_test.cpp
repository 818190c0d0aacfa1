// What a preparation leaves of noise: against transfer functions, and sigma of F against repeated scans that
// were prepared.
#define BOOST_TEST_MODULE prepared_noise
#include <boost/test/unit_test.hpp>

#include "host/field/noise/field_variance.hpp"
#include "host/field/noise/passed_noise.hpp"
#include "host/scan/prepare/prepare.hpp"
#include "tests/support/repeated_scans.hpp"
#include "vdvr/expert/preparation.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;

LineIntegralNoise white(double variance) {
  LineIntegralNoise noise;
  noise.constant = variance;
  return noise;
}

ProjectionSet prepared(ProjectionSet scan, const Preparation& p) {
  const Preparation whole = for_columns(p, scan.geometry.columns);
  const ViewPreparation steps(whole, scan.geometry, false);
  const std::int64_t pixels = scan.geometry.rows * scan.geometry.columns;
  for (std::int64_t k = 0; !steps.none() && k < scan.geometry.views(); ++k) {
    float* own = scan.data.data() + k * pixels;
    View view{scan.geometry.columns, scan.geometry.rows, std::vector<double>(own, own + pixels)};
    steps.apply(view);
    std::transform(view.data.begin(), view.data.end(), own, [](double v) { return static_cast<float>(v); });
  }
  scan.report.preparation = whole;
  prepare_scan(scan, whole, 0, {});
  return scan;
}

// Of a still scan.
LineIntegralNoise passed_by(const Preparation& p, std::int64_t views = 200, std::int64_t rows = 60,
                            std::int64_t columns = 180) {
  return passed_noise(white(1e-4), rows, columns, prepared(empty_scan(views, rows, columns), p), 0);
}

Preparation gaussian(double across, double along) {
  Preparation p;
  p.gaussian = {across, along};
  return p;
}
Preparation median(int side) {
  Preparation p;
  p.median = side;
  return p;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_blur_passes_what_its_transfer_function_says) {
  // The sampled Gaussian along one axis, normalised.
  const auto kernel = [](double sigma) {
    std::vector<double> g;
    double sum = 0;
    for (int i = 0; i <= std::ceil(5 * sigma); ++i) {
      g.push_back(std::exp(-0.5 * i * i / sigma / sigma));
      sum += (i == 0 ? 1 : 2) * g.back();
    }
    for (double& v : g) v /= sum;
    return g;
  };
  for (const auto& [across, along] : {std::pair(1.0, 0.7), std::pair(0.6, 0.0), std::pair(0.0, 1.2)}) {
    const LineIntegralNoise noise = passed_by(gaussian(across, along));
    const std::vector<double> u = across > 0 ? kernel(across) : std::vector{1.0},
                              v = along > 0 ? kernel(along) : std::vector{1.0};
    const auto product = [&](std::int64_t lag) {
      double sum = 0;
      const auto reach = std::ssize(v) - 1;
      const auto weight = [&](std::int64_t i) {
        return std::abs(i) > reach ? 0.0 : v[static_cast<std::size_t>(std::abs(i))];
      };
      for (std::int64_t i = -reach; i <= reach; ++i) sum += weight(i) * weight(i + lag);
      return sum;
    };
    BOOST_TEST_REQUIRE(noise.spectrum.size() == 64u);
    // Of 6,000 rows each power is good to its own size over the square root of that; leaks of Hann's window
    // are below 1e-6. Five times that: 200 are looked at.
    const double error = 5 / std::sqrt(6000.0);
    for (std::size_t m = 0; m < 64; ++m) {
      const double omega = pi * (static_cast<double>(m) + 0.5) / 64;
      double transfer = u[0];
      for (std::size_t i = 1; i < u.size(); ++i)
        transfer += 2 * u[i] * std::cos(omega * static_cast<double>(i));
      const double expected = transfer * transfer * product(0);
      BOOST_TEST_INFO(across << "," << along << " bin " << m);
      BOOST_TEST(std::abs(static_cast<double>(noise.spectrum[m]) - expected) <= error * expected + 1e-6);
    }
    BOOST_TEST_REQUIRE(noise.row_correlation.size() == 4u);
    for (std::size_t l = 0; l < 4; ++l)
      BOOST_TEST(std::abs(static_cast<double>(noise.row_correlation[l]) -
                          product(static_cast<std::int64_t>(l) + 1) / product(0)) <= error);
  }
}

BOOST_AUTO_TEST_CASE(a_median_passes_what_was_seen_of_it) {
  // The method's figure for 3 x 3, of flat noise, given to two digits.
  const double share = passed_share({}, passed_by(median(3)).spectrum);
  BOOST_TEST(std::abs(share - 0.065) <= 0.0015);
}

BOOST_AUTO_TEST_CASE(bins_of_white_noise_are_white) {
  Preparation p;
  p.binning = 2;
  const LineIntegralNoise noise = passed_by(p);
  BOOST_TEST(noise.constant == 1e-4 / 4);
  for (const float power : noise.spectrum)
    BOOST_TEST(std::abs(static_cast<double>(power) - 1) <= 4 / std::sqrt(3000.0));
}

BOOST_AUTO_TEST_CASE(sigma_of_prepared_scans_is_that_of_repeated_ones) {
  // `prepared_noise_test -- long`: as docs/noise.md has it.
  const int scans = boost::unit_test::framework::master_test_suite().argc > 1 ? 600 : 100;
  constexpr double photons = 5000;
  struct Case {
    const char* name;
    Preparation preparation;
    double anywhere;  // docs/noise.md
  };
  constexpr double in_the_mean = 0.05;
  Preparation stripes, bins = median(3), phase, zingers;
  stripes.stripes.emplace();
  bins.binning = 2;
  phase.phase = {50, 20, 1000};
  zingers.outliers.emplace();
  for (const Case& c :
       {Case{"median", median(3), 0.2}, Case{"blur", gaussian(1, 0.8), 0.05}, Case{"stripes", stripes, 0.4},
        Case{"median, bins", bins, 0.2}, Case{"phase", phase, 0.1}, Case{"zingers", zingers, 0.05}}) {
    ProjectionSet ideal = ideal_scan({c.name, 40, 24, 41});
    ideal.geometry.unit = "mm";
    ideal.geometry.pitch_u = ideal.geometry.pitch_v = 0.005;
    LineIntegralNoise noise;
    noise.photon = {static_cast<float>(1 / photons)};
    const ProjectionSet one = prepared(counted(ideal, photons, 77), c.preparation);
    noise = passed_noise(noise, 24, 41, one, 0);
    // Away from the outermost rows, where steps see mirrored ones.
    const double pitch = one.geometry.pitch_u, height = 0.25 * static_cast<double>(one.geometry.rows) * pitch;
    check(
        repeated([&](unsigned seed) { return prepared(counted(ideal, photons, seed), c.preparation); },
                 prepared(ideal, c.preparation), noise, {},
                 some_places(0.4 * static_cast<double>(one.geometry.columns) * pitch, -height, 0.9 * height),
                 scans),
        scans, c.name, in_the_mean, c.anywhere);
  }
}
