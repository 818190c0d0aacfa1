// What gold is streamed for. Called by gold_stream.hpp and node_slack.hpp.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "vdvr/grid.hpp"

namespace vdvr {

struct GoldSettings {
  Grid grid;
  int granularity = 4;
  int rate = 8;
  int upsampling = 8;
  std::string u_filter = "linear";
  std::optional<std::pair<double, double>> window{};
  bool midrange = false;     ///< samples fitted to the trilinear filter; else gold at the nodes
  bool anisotropic = false;  ///< levels per axis; else one for all three
  bool base_only = false;    ///< only fitted base samples are asked for: no slack, no other level
  /// Of gold's second differences: the middle of the T that they stand for, an eighth at most in a cell.
  float curvature = 0.0625f;
  int coarse_rate = 0;     ///< of a coarser gold that shares this one's bounds of base cells; 0: none
  bool grid_only = false;  ///< slack counts as 0: the paper's test, for comparison

  [[nodiscard]] int coarsest() const { return coarse_rate > 0 ? coarse_rate : rate; }
};

/// The largest granularity up to `wanted` that does not waste tiles on a grid thinner than a brick.
inline int fitting_granularity(int wanted, const Grid& grid) {
  int g = wanted;
  while (g > 1 && *std::min_element(grid.cells.begin(), grid.cells.end()) < g) g /= 2;
  return g;
}

}  // namespace vdvr
