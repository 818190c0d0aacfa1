// F's mean over a region by the projections: against F by its definition at the nodes of rules of
// integration, and its sigma against repeated scans.
#define BOOST_TEST_MODULE mean_of_scan
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/measure/mean_weights.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/repeated_scans.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/extend_rows.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;

struct Node {
  double x, weight;
};
// Gauss and Legendre's rule on [a, b].
std::vector<Node> gauss(int n, double a, double b) {
  std::vector<Node> out;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int again = 0; again < 50; ++again) {
      double p = 1, before = 0;
      for (int j = 0; j < n; ++j) {
        const double next = ((2 * j + 1) * x * p - j * before) / (j + 1);
        before = p;
        p = next;
      }
      slope = n * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    out.push_back({0.5 * (a + b) + 0.5 * (b - a) * x, (b - a) / ((1 - x * x) * slope * slope)});
  }
  return out;
}

// A region, and a rule that integrates over it what waves of half a cycle a pixel make.
struct Shape {
  const char* name;
  MeasureRegion region;
  std::vector<Vec3> points{};
  std::vector<double> weight{};
};

Shape box_shape(const char* name, const std::array<double, 6>& box) {
  Shape s{name, {}};
  s.region.box = box;
  for (const Node& x : gauss(24, box[0], box[3]))
    for (const Node& y : gauss(24, box[1], box[4]))
      for (const Node& z : gauss(12, box[2], box[5])) {
        s.points.push_back({x.x, y.x, z.x});
        s.weight.push_back(x.weight * y.weight * z.weight);
      }
  return s;
}

constexpr int around = 48;

Shape cylinder_shape(const char* name, double x0, double y0, double low, double high, double radius) {
  Shape s{name, {}};
  s.region.box = {-1e300, -1e300, low, 1e300, 1e300, high};
  s.region.rounds.push_back({{x0, y0, 0}, radius, true});
  for (const Node& r : gauss(20, 0, radius))
    for (int a = 0; a < around; ++a)
      for (const Node& z : gauss(12, low, high)) {
        const double phi = 2 * pi * a / around;
        s.points.push_back({x0 + r.x * std::cos(phi), y0 + r.x * std::sin(phi), z.x});
        s.weight.push_back(r.weight * r.x * z.weight);
      }
  return s;
}

Shape ball_shape(const char* name, const Vec3& center, double radius) {
  Shape s{name, {}};
  s.region.rounds.push_back({center, radius, false});
  for (const Node& z : gauss(16, -radius, radius))
    for (const Node& r : gauss(16, 0, std::sqrt(radius * radius - z.x * z.x)))
      for (int a = 0; a < around; ++a) {
        const double phi = 2 * pi * a / around;
        s.points.push_back(
            {center[0] + r.x * std::cos(phi), center[1] + r.x * std::sin(phi), center[2] + z.x});
        s.weight.push_back(r.weight * r.x * z.weight);
      }
  return s;
}

// The same box as a mask, whose samples are its cells' middles; those around are 0.
Shape masked(Shape s, const std::array<double, 6>& box, int cells) {
  auto mask = std::make_shared<Volume>();
  for (std::size_t a = 0; a < 3; ++a) {
    mask->grid.cells[a] = cells + 1;
    mask->grid.spacing[a] = (box[a + 3] - box[a]) / cells;
    mask->grid.origin[a] = box[a] - 0.5 * mask->grid.spacing[a];
  }
  mask->samples.assign(at(mask->grid.sample_count()), 0.0f);
  const std::int64_t n = cells + 2;
  for (std::int64_t i = 0; i < std::ssize(mask->samples); ++i) {
    const auto within = [&](std::int64_t j) { return j > 0 && j <= cells; };
    if (within(i % n) && within(i / n % n) && within(i / n / n)) mask->samples[at(i)] = 1;
  }
  s.region = {};
  s.region.mask = mask;
  return s;
}

Certificate certificate_of(const ProjectionSet& scan, const FieldOptions& field) {
  Certificate c;
  c.field = field;
  const Coverage coverage = certified_coverage(scan, field);
  c.covered = {coverage.inner_radius(), coverage.heights()};
  return c;
}

MeasuredRegion region_of(const ProjectionSet& scan, const FieldOptions& field, const MeasureRegion& asked) {
  const Coverage coverage = certified_coverage(scan, field);
  return {testing::grid_of(coverage, 1), certificate_of(scan, field), asked};
}

// sum_k w_k max |q_k|, the largest that the sum over views can be.
double largest_sum(const ExactField& exact) {
  const ParallelGeometry& g = exact.geometry();
  double sum = 0;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    double largest = 0;
    for (std::int64_t v = 0; v < g.rows; ++v)
      for (std::int64_t u = 0; u < g.columns; ++u) {
        double q = 0;
        for (std::int64_t m = 0; m < g.columns; ++m)
          for (std::int64_t l = 0; l < g.rows; ++l)
            q += exact.coefficients()[at((k * g.columns + m) * g.rows + l)] *
                 std::cos(pi * static_cast<double>(m) * (static_cast<double>(u) + 0.5) /
                          static_cast<double>(g.columns)) *
                 std::cos(pi * static_cast<double>(l) * (static_cast<double>(v) + 0.5) /
                          static_cast<double>(g.rows));
        largest = std::max(largest, std::abs(q));
      }
    sum += largest;
  }
  return sum;
}

// What places 1/16 of a pixel apart may lose, of that sum, for a region n pixels wide. Waves of up to half a
// cycle a pixel lose nothing; what does is the region's ends: the root of a round one, in its own sum as in
// the integral, 1.1 places^-3/2; a box in views along its sides, two of K, a place.
double lost(double pixels, std::int64_t views) {
  const double places = 16 * pixels;
  return 2 * (1.1 * std::pow(places, -1.5) + 2 / (static_cast<double>(views) * places));
}

// Slabs of a ball, which is taken to be the same throughout each: of such a wave h^2 / 24 pi^2 besides.
double lost_in_slabs(double pixels) {
  const double h = 1.0 / 16;
  return 2 * 1.1 * std::pow(pixels / h, -1.5) + h * h / 24 * pi * pi;
}

void hold_to_definition(const ProjectionSet& scan, const FieldOptions& field, const Shape& s, double pixels,
                        double z_share = 0) {
  const ExactField exact(scan, field);
  const std::vector<double> values = exact.at(s.points);
  double sum = 0, volume = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    BOOST_REQUIRE(exact.covered(s.points[i]));
    sum += s.weight[i] * values[i];
    volume += s.weight[i];
  }
  const MeanOfScan found = mean_of_scan(scan, field, region_of(scan, field, s.region), {}, 0, {});
  BOOST_TEST(!found.sigma.has_value());
  const double tolerance = (lost(pixels, scan.geometry.views()) + z_share) * largest_sum(exact);
  BOOST_TEST_MESSAGE(s.name << ": " << found.mean << ", " << sum / volume << ", differs by "
                            << std::abs(found.mean - sum / volume) / tolerance << " of its tolerance");
  BOOST_TEST_CONTEXT(s.name) BOOST_TEST(std::abs(found.mean - sum / volume) <= tolerance);
}

}  // namespace

BOOST_AUTO_TEST_CASE(mean_of_parallel_beam_is_that_of_f) {
  const std::array<double, 6> box{-7, -2, -2.2, 3, 6, 1.4};
  for (ProjectionSet scan : {ideal_scan({"odd", 37, 6, 41}),
                             ideal_scan({"full turn", 48, 6, 40, 360, 2.3, 0.8}), noise_scan(31, 6, 40)}) {
    for (double& t : scan.geometry.theta_rad) t += 0.01;
    hold_to_definition(scan, {}, box_shape("box", box), 8);
    hold_to_definition(scan, {}, masked(box_shape("mask", box), box, 5), 8);
    hold_to_definition(scan, {}, cylinder_shape("cylinder", 4, -3, -1.3, 2.2, 6), 12);
    hold_to_definition(scan, {}, ball_shape("ball", {-5, 4, 0.2}, 2), 4, lost_in_slabs(4));
    FieldOptions field;
    field.filter = RampWindow::hann;
    field.cutoff = 0.8;
    field.center = scan.geometry.center + 0.7;
    hold_to_definition(scan, field, cylinder_shape("Hann", 4, -3, -1.3, 2.2, 6), 12);
  }
}

BOOST_AUTO_TEST_CASE(mean_of_longer_rows_is_that_of_f) {
  ProjectionSet scan = ideal_scan({"half acquisition", 60, 4, 40, 360, 12});
  extend_rows(scan, wanted(true));
  FieldOptions field;
  field.preparation = wanted(true);
  hold_to_definition(scan, field, cylinder_shape("half acquisition", 4, 9, -1, 1, 6), 12);
}

BOOST_AUTO_TEST_CASE(mean_of_cone_beam_is_that_of_f) {
  for (const auto& [name, shape] : cone_orbits()) {
    ProjectionSet scan = noisy_cone(shape);
    const ParallelGeometry& g = scan.geometry;
    for (std::size_t i = 0; i < scan.data.size(); ++i) {
      const double u = static_cast<double>(static_cast<std::int64_t>(i) % g.columns) - g.center;
      scan.data[i] += static_cast<float>(1.5 * std::exp(-u * u / 100));
    }
    // Both ways across the detector.
    hold_to_definition(scan, {}, cylinder_shape(name, 2, -1, -2, 1.5, 5), 3.5, lost(10, shape.views));
    hold_to_definition(scan, {}, ball_shape(name, {-3, 2, 0.2}, 3), 6, lost(6, shape.views));
  }
}

namespace {

// Standard deviations of the mean over repeated scans, over what is predicted.
void hold_to_repeated(const char* name, const std::function<ProjectionSet(unsigned)>& scan_of,
                      const FieldOptions& field, const MeasureRegion& asked, const MeanNoise& noise,
                      int scans, double share_of_flats = 0) {
  const ProjectionSet one = scan_of(77);
  const MeasuredRegion region = region_of(one, field, asked);
  const MeanOfScan predicted = mean_of_scan(one, field, region, noise, 0, {});
  // The mean is linear in the samples: it is that of its weights.
  const measured::MeanWeights weights(one, field, region, 0);
  std::vector<std::vector<double>> of_view(at(one.geometry.views()));
  for (std::int64_t k = 0; k < one.geometry.views(); ++k) weights.of_view(k, of_view[at(k)]);
  const auto mean_of = [&](const ProjectionSet& scan) {
    double sum = 0;
    const std::int64_t pixels = scan.geometry.rows * scan.geometry.columns;
    for (std::int64_t i = 0; i < scan.size(); ++i)
      sum += of_view[at(i / pixels)][at(i % pixels)] * static_cast<double>(scan.data[at(i)]);
    return sum;
  };
  BOOST_TEST(std::abs(mean_of(one) - predicted.mean) <=
             tolerance::fp64_sum(one.size(), std::abs(predicted.mean)));
  double sum = 0, squares = 0;
  for (int s = 0; s < scans; ++s) {
    const double mean = mean_of(scan_of(static_cast<unsigned>(1000 + s))) - predicted.mean;
    sum += mean;
    squares += mean * mean;
  }
  const double found = std::sqrt((squares - sum * sum / scans) / (scans - 1));
  BOOST_TEST_REQUIRE(predicted.sigma.has_value());
  BOOST_TEST_MESSAGE(name << ": found " << found << ", predicted " << *predicted.sigma << ", of flats "
                          << predicted.of_flats);
  // Four standard errors of a standard deviation, and what docs/noise.md promises of any.
  BOOST_TEST_CONTEXT(name)
  BOOST_TEST(std::abs(found / *predicted.sigma - 1) <= promised + 4 / std::sqrt(2.0 * scans));
  BOOST_TEST(predicted.of_flats >= share_of_flats);
}

constexpr int scans = 1000;
constexpr double photons = 20000;
LineIntegralNoise of_photons() {
  LineIntegralNoise noise;
  noise.photon = {static_cast<float>(1 / photons)};
  return noise;
}

}  // namespace

BOOST_AUTO_TEST_CASE(sigma_of_means_is_that_of_repeated_scans) {
  for (const ScanShape& s :
       {ScanShape{"half turn", 30, 3, 31}, ScanShape{"uneven full turn", 36, 2, 30, 360, 2, 0.8}}) {
    const ProjectionSet ideal = ideal_scan(s);
    const auto scan_of = [&](unsigned seed) { return counted(ideal, photons, seed); };
    for (const Shape& shape :
         {cylinder_shape("cylinder", 3, -2, -0.5, 0.5, 6), ball_shape("ball", {-4, 3, 0}, 0.5)})
      hold_to_repeated(shape.name, scan_of, {}, shape.region, {of_photons(), 0}, scans);
  }
}

BOOST_AUTO_TEST_CASE(sigma_of_means_has_the_noise_of_flats) {
  const ProjectionSet ideal = ideal_scan({"half turn", 60, 3, 31});
  constexpr std::int64_t flats = 2;
  const auto scan_of = [&](unsigned seed) {
    ProjectionSet scan = counted(ideal, photons, seed);
    std::mt19937_64 random(seed + 5000);
    std::poisson_distribution<long> count(photons * flats);
    const std::int64_t pixels = scan.geometry.rows * scan.geometry.columns;
    for (std::int64_t i = 0; i < pixels; ++i) {
      const double flat = std::log(static_cast<double>(count(random)) / (photons * flats));
      for (std::int64_t k = 0; k < scan.geometry.views(); ++k)
        scan.data[at(k * pixels + i)] += static_cast<float>(flat);
    }
    return scan;
  };
  // About the axis, where rings are what most of it is made of, and beside it.
  hold_to_repeated("at the axis", scan_of, {}, cylinder_shape("", 0, 0, -0.5, 0.5, 4).region,
                   {of_photons(), flats}, scans, 0.5);
  hold_to_repeated("beside it", scan_of, {}, cylinder_shape("", 8, 0, -0.5, 0.5, 4).region,
                   {of_photons(), flats}, scans, 0.01);
}

BOOST_AUTO_TEST_CASE(sigma_of_means_of_longer_rows_is_that_of_repeated_scans) {
  const ProjectionSet ideal = ideal_scan({"half acquisition", 60, 2, 40, 360, 12});
  const auto scan_of = [&](unsigned seed) {
    ProjectionSet scan = counted(ideal, photons, seed);
    extend_rows(scan, wanted(true));
    return scan;
  };
  FieldOptions field;
  field.preparation = wanted(true);
  hold_to_repeated("half acquisition", scan_of, field, cylinder_shape("", 4, 9, -0.4, 0.4, 6).region,
                   {of_photons(), 0}, scans);
}

// White noise through (1/4, 1/2, 1/4) along columns has the power cos^4(pi f), and along rows correlations of
// 2/3 and 1/6. A ramp over all pixels is not the region's own response: means keep more than single points.
BOOST_AUTO_TEST_CASE(sigma_of_means_of_filtered_noise_is_that_of_repeated_scans) {
  const ProjectionSet still = empty_scan(24, 5, 61);
  LineIntegralNoise noise;
  noise.constant = 1e-4;
  constexpr int bins = 64;
  for (int m = 0; m < bins; ++m)
    noise.spectrum.push_back(static_cast<float>(std::pow(std::cos(0.5 * pi * (m + 0.5) / bins), 4)));
  const auto scan_of = [&](unsigned seed) {
    ProjectionSet scan = still;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> white(0, 0.01);
    const std::int64_t columns = scan.geometry.columns;
    for (std::int64_t row = 0; row < scan.size() / columns; ++row) {
      std::vector<double> noisy(at(columns + 2));
      for (double& n : noisy) n = white(random);
      for (std::int64_t i = 0; i < columns; ++i)
        scan.data[at(row * columns + i)] =
            static_cast<float>(0.25 * noisy[at(i)] + 0.5 * noisy[at(i + 1)] + 0.25 * noisy[at(i + 2)]);
    }
    return scan;
  };
  hold_to_repeated("filtered", scan_of, {}, cylinder_shape("", 3, -2, -1.2, 1.2, 9).region, {noise, 0},
                   scans);
  hold_to_repeated("filtered, small", scan_of, {}, cylinder_shape("", 3, -2, -1.2, 1.2, 1.5).region,
                   {noise, 0}, scans);
}

BOOST_AUTO_TEST_CASE(sigma_of_means_of_cone_beam_is_that_of_repeated_scans) {
  for (const double shift : {0.0, 5.0}) {
    ConeShape shape;
    shape.views = 30;
    shape.columns = 27;
    shape.rows = 9;
    shape.source_to_axis = 60;
    shape.shift = shift;
    ProjectionSet ideal = noisy_cone(shape);
    for (std::size_t i = 0; i < ideal.data.size(); ++i) {
      const double u =
          static_cast<double>(static_cast<std::int64_t>(i) % ideal.geometry.columns) - ideal.geometry.center;
      ideal.data[i] = static_cast<float>(1.5 * std::exp(-u * u / 100));
    }
    hold_to_repeated(
        "cone beam", [&](unsigned seed) { return counted(ideal, photons, seed); }, {},
        ball_shape("", {2, -1, 0}, 2).region, {of_photons(), 0}, scans);
  }
}

BOOST_AUTO_TEST_CASE(memory_is_asked_for_before_it_is_taken) {
  const ProjectionSet scan = ideal_scan({"odd", 37, 6, 41});
  BOOST_CHECK_THROW(
      mean_of_scan(scan, {}, region_of(scan, {}, cylinder_shape("", 0, 0, -1, 1, 6).region), {}, 10000, {}),
      ResourceError);
}
