// Rates and small grids for scan_chain.hpp. Called by attacks_test.cpp and attack_terms_test.cpp.
#pragma once

#include <string>
#include <vector>

#include "tests/support/device.hpp"
#include "tests/support/scan_chain.hpp"

namespace vdvr::attacks {

using support::device;

inline std::string name_of(const Rates& rates) {
  return std::string(text_of(rates.interpolation)) + " " + std::to_string(rates.upsampling) + ", gold " +
         std::to_string(rates.gold);
}

/// Six taps are for columns at 8x or more.
inline bool serves(int upsampling, Interpolation filter) {
  return filter != Interpolation::six_taps || upsampling >= 8;
}
constexpr Interpolation all_filters[] = {Interpolation::linear, Interpolation::cubic,
                                         Interpolation::six_taps};

/// Every set of rates: 4 upsamplings, 3 filters, 4 of gold.
inline std::vector<Rates> all_rates() {
  std::vector<Rates> all;
  for (const int upsampling : {2, 4, 8, 16})
    for (const Interpolation filter : all_filters)
      for (const int gold : {2, 4, 8, 16})
        if (serves(upsampling, filter)) all.push_back({upsampling, filter, gold});
  return all;
}

/// On the device of all tests.
struct Chain : ScanChain {
  explicit Chain(const ProjectionSet& given) : ScanChain(support::device(), given) {}
};

/// Where a scan's target lies on the grid: inside a gold cell, or on a gold node that is a corner of base
/// cells, at their top or bottom.
enum class Place { cell, top, bottom };
inline const char* name_of(Place p) {
  return p == Place::cell ? "in a gold cell" : p == Place::top ? "on a top node" : "on a bottom node";
}

/// 2 x 2 x 1 base cells around the target.
inline Grid grid_at(const ParallelGeometry& g, const Vec3& target, double spacing, int gold, Place place) {
  Grid grid;
  grid.cells = {2, 2, 1};
  grid.spacing = {spacing, spacing, spacing * (g.rows > 1 ? g.pitch_v : 1.0)};
  for (std::size_t a = 0; a < 2; ++a)
    grid.origin[a] = target[a] - (gold + (place == Place::cell ? 0.5 : 0.0)) / gold * spacing;
  const double up = place == Place::cell ? (gold / 2 + 0.5) / gold : place == Place::top ? 1.0 : 0.0;
  grid.origin[2] = target[2] - up * grid.spacing[2];
  return grid;
}

}  // namespace vdvr::attacks
