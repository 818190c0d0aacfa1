// Small scans for tests: noise, single waves, spikes, phantoms; reproducible. And grids in them.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::testing {

/// Of the steps of preparation, how rows are made longer.
inline Preparation wanted(std::optional<bool> half, Padding padding = Padding::none) {
  Preparation p;
  p.half_acquisition = half;
  p.padding = padding;
  return p;
}

inline ProjectionSet empty_scan(std::int64_t views, std::int64_t rows, std::int64_t columns,
                                double arc_deg = 180) {
  ProjectionSet scan;
  scan.geometry.columns = columns;
  scan.geometry.rows = rows;
  scan.geometry.center = 0.5 * static_cast<double>(columns - 1);
  for (std::int64_t k = 0; k < views; ++k)
    scan.geometry.theta_rad.push_back(arc_deg * std::numbers::pi / 180 * static_cast<double>(k) /
                                      static_cast<double>(views));
  scan.data.assign(static_cast<std::size_t>(scan.size()), 0.0f);
  return scan;
}

/// White noise: the hardest band-limited field.
inline ProjectionSet noise_scan(std::int64_t views, std::int64_t rows, std::int64_t columns,
                                unsigned seed = 1, double arc_deg = 180) {
  ProjectionSet scan = empty_scan(views, rows, columns, arc_deg);
  std::mt19937 random(seed);
  for (float& p : scan.data) p = static_cast<float>(random()) / 4294967296.0f - 0.5f;
  return scan;
}

inline ProjectionSet simulated(const Phantom& phantom, std::int64_t columns, std::int64_t rows, int angles) {
  SimulateOptions options;
  options.columns = columns;
  options.rows = rows;
  options.angles = angles;
  return simulate(phantom, options);
}

inline Grid grid_of(const ProjectionSet& scan, const Index3& size, double spacing,
                    std::optional<Vec3> origin = {}) {
  GridOptions options;
  options.size = size;
  options.spacing = spacing;
  options.origin = origin;
  return make_grid(scan.geometry, options);
}

/// Where the samples of a grid lie, x fastest.
inline std::vector<Vec3> places_of(const Grid& grid) {
  const Index3 n = grid.samples();
  std::vector<Vec3> places;
  for (std::int64_t i = 0; i < grid.sample_count(); ++i)
    places.push_back(grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]}));
  return places;
}

}  // namespace vdvr::testing
