// Small cone-beam scans for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "host/field/fbp/coverage.hpp"
#include "tests/support/scans.hpp"

namespace vdvr::testing {

struct ConeShape {
  std::int64_t views = 24, rows = 20, columns = 24;
  double source_to_axis = 60;  ///< the detector stands at the axis, with pitch 1
  double arc_deg = 360, shift = 0, in_plane_deg = 0, out_of_plane_deg = 0;
};

/// Orbits of all kinds, by name, of detectors of 33 x 15 pixels and 40 views.
inline std::vector<std::pair<const char*, ConeShape>> cone_orbits() {
  const ConeShape s{.views = 40, .rows = 15, .columns = 33, .source_to_axis = 70};
  std::vector<std::pair<const char*, ConeShape>> out{
      {"full turn", s}, {"short scan", s}, {"displaced", s}, {"tilted", s}};
  out[1].second.arc_deg = 240;
  out[2].second.shift = 5;
  out[3].second.out_of_plane_deg = 2;
  return out;
}

inline CircularView cone_view_of(const ConeShape& s, std::int64_t k) {
  constexpr double degree = std::numbers::pi / 180;
  CircularView view;
  view.theta_rad = s.arc_deg * degree * static_cast<double>(k) / static_cast<double>(s.views);
  view.source_to_axis = view.source_to_detector = s.source_to_axis;
  view.center = 0.5 * static_cast<double>(s.columns - 1) - s.shift;
  view.row = 0.5 * static_cast<double>(s.rows - 1);
  view.in_plane_rad = s.in_plane_deg * degree;
  view.out_of_plane_rad = s.out_of_plane_deg * degree;
  return view;
}

inline ConeGeometry cone_of(const ConeShape& s) {
  ConeGeometry cone;
  for (std::int64_t k = 0; k < s.views; ++k) cone.views.push_back(circular_view(cone_view_of(s, k)));
  cone.redundancy = natural_redundancy(cone, s.columns);
  return cone;
}

/// White noise.
inline ProjectionSet noisy_cone(const ConeShape& s, unsigned seed = 1) {
  ProjectionSet scan = noise_scan(s.views, s.rows, s.columns, seed, s.arc_deg);
  scan.cone = cone_of(s);
  scan.geometry = parallel_limit(*scan.cone, s.columns, s.rows, "pixel");
  return scan;
}

/// Around the covered cylinder and a little more, off its middle.
inline Grid grid_of(const Coverage& coverage, double spacing) {
  const double r = coverage.inner_radius();
  const auto [low, high] = coverage.heights();
  Grid grid;
  grid.spacing = {spacing, spacing, spacing};
  const auto cells = [&](double length) {
    return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / spacing)));
  };
  grid.cells = {cells(2 * r), cells(2 * r), cells(high - low)};
  grid.origin = {-r + 0.01, -r - 0.02, low};
  return grid;
}

}  // namespace vdvr::testing
