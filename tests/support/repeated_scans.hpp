// Scans of a smooth object, repeated with other noise: the spread of F over them against what is predicted.
#pragma once

#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/device.hpp"
#include "tests/support/photons.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::testing {

/// What docs/noise.md says of sigma, in the mean over places.
inline constexpr double promised = 0.03;

/// Three smooth ellipsoids, of line integrals up to about 2.
inline Phantom smooth_object(double radius) {
  return ellipsoid_list(
      {{1.2 / radius, {0, 0, 0}, {0.8 * radius, 0.7 * radius, 3 * radius}, 20},
       {-0.4 / radius, {0.2 * radius, 0.1 * radius, 0}, {0.3 * radius, 0.2 * radius, radius}, 0},
       {0.6 / radius, {-0.3 * radius, 0, 0}, {0.2 * radius, 0.25 * radius, 2 * radius}, 70}},
      0, "smooth");
}

struct ScanShape {
  const char* name;
  std::int64_t views, rows, columns;
  double arc_deg = 180, shift = 0, jitter = 0;
};

inline ProjectionSet ideal_scan(const ScanShape& s) {
  SimulateOptions options;
  options.angles = static_cast<int>(s.views);
  options.rows = s.rows;
  options.columns = s.columns;
  options.arc_deg = s.arc_deg;
  ProjectionSet scan = simulate(smooth_object(0.42 * static_cast<double>(s.columns)), options);
  scan.geometry.center += s.shift;
  std::mt19937 random(3);
  for (double& t : scan.geometry.theta_rad)
    t += s.jitter * (static_cast<double>(random()) / 4294967296.0 - 0.5) * std::numbers::pi /
         static_cast<double>(s.views);
  return scan;
}

/// A handful of samples at and between pixels and rows, within the covered region.
inline Grid some_places(double radius, double low, double high) {
  Grid grid;
  grid.cells = {4, 2, 2};
  grid.origin = {-0.8 * radius, -0.55 * radius, low};
  grid.spacing = {0.39 * radius, 0.53 * radius, (high - low) / 2};
  return grid;
}

/// Standard deviations over repeated scans, against what is predicted from one of them.
struct Agreement {
  double mean = 0, farthest = 0;  ///< of found over predicted: mean, and largest distance from 1
};
/// `scan_of(seed)`: one of the scans; `ideal`: the same without noise.
inline Agreement repeated(const std::function<ProjectionSet(unsigned)>& scan_of, const ProjectionSet& ideal,
                          const LineIntegralNoise& noise, const FieldOptions& field, const Grid& grid,
                          int scans) {
  const Volume predicted = noise_of_field(support::device(), scan_of(77), field, noise, grid);
  const std::vector<Vec3> points = places_of(grid);
  std::vector<double> sum(points.size()), squares(points.size());
  for (int s = 0; s < scans; ++s) {
    const ExactField exact(scan_of(static_cast<unsigned>(1000 + s)), field);
    const std::vector<double> values = exact.at(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum[i] += values[i];
      squares[i] += values[i] * values[i];
    }
  }
  Agreement out;
  std::size_t compared = 0;
  const ExactField exact(ideal, field);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!exact.covered(points[i])) continue;
    const double mean = sum[i] / scans,
                 found = std::sqrt((squares[i] / scans - mean * mean) * scans / (scans - 1)),
                 ratio = found / static_cast<double>(predicted.samples[i]);
    BOOST_TEST_INFO("sample " << i << ": found " << found << ", predicted " << predicted.samples[i]);
    BOOST_TEST(std::isfinite(ratio));
    out.mean += ratio;
    out.farthest = std::max(out.farthest, std::abs(ratio - 1));
    ++compared;
  }
  BOOST_TEST_REQUIRE(compared >= 20u);
  out.mean /= static_cast<double>(compared);
  return out;
}

/// What is promised in the mean and anywhere; and the standard error of a standard deviation from n scans is
/// 1 / sqrt(2 n), of which no point is 4 away.
inline void check(const Agreement& found, int scans, const char* name, double in_the_mean = promised,
                  double anywhere = promised) {
  const double error = 1 / std::sqrt(2.0 * scans);
  BOOST_TEST_INFO(name << ": mean " << found.mean << ", farthest " << found.farthest);
  BOOST_TEST(std::abs(found.mean - 1) <= in_the_mean + 4 * error / std::sqrt(20.0));
  BOOST_TEST_INFO(name << ": mean " << found.mean << ", farthest " << found.farthest);
  BOOST_TEST(found.farthest <= anywhere + 4 * error);
}

}  // namespace vdvr::testing
