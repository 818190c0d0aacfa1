// What gold is streamed for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "host/certify/kept/kept_gold.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/volume/quantise.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// The grid whose samples are the base of `grid` with this coarsening, which divides its cells.
inline Grid coarsened(const Grid& grid, const LevelTriple& coarsening) {
  Grid out = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    out.cells[a] >>= coarsening[2 - a];
    out.spacing[a] *= 1 << coarsening[2 - a];
  }
  return out;
}

struct GoldSettings {
  Grid grid;
  int granularity = 4;
  int rate = 8;
  int upsampling = 8;
  Interpolation interpolation = Interpolation::linear;
  std::optional<std::pair<double, double>> window{};
  bool midrange = false;     ///< samples fitted to the trilinear filter; else gold at the nodes
  bool of_noise = false;     ///< bricks have tolerances of their own: fits take larger steps (fit_tiles.hpp)
  bool anisotropic = false;  ///< levels per axis; else one for all three
  bool base_only = false;    ///< only fitted base samples are asked for: no slack, no other level
  /// Of gold's second differences: the middle of the T that they stand for, an eighth at most in a cell.
  float curvature = 0.0625f;
  int coarse_rate = 0;       ///< of a coarser gold that is tested first; 0: none
  int finer_rate = 0;        ///< of the finer gold that will measure what this one proposes; 0: none
  bool grid_only = false;    ///< slack counts as 0: the paper's test, for comparison
  IntegerLattice lattice{};  ///< on which tiles will be stored; classification leaves room for it
  LevelTriple coarsening{};  ///< log2 of cells per base cell, z, y, x
  /// Of heights that blocks of kept gold share (kept_gold.hpp).
  std::uint64_t heights_bytes = std::uint64_t{1} << 30;

  /// Of estimates: where gold is kept, the rest counting as 0; all of it where there is none.
  std::optional<PlanePart> part{};
  double least_reach = 0;               ///< of kept gold: what later settings will ask for
  int differences = dense_differences;  ///< as Rates has them
  /// Of cone beam, that are summed up together; 0: as many as memory allows. How sums round depends on it, so
  /// that all of a crew take as many.
  std::int64_t views_together = 0;
  /// How far outside the covered region samples are kept: as far as a base cell that meets it reaches.
  [[nodiscard]] double kept() const {
    return 0.5 * (kept_margin(grid, 1) + kept_margin(coarsened(grid, coarsening), 1));
  }
  /// The level whose samples are this gold, z, y, x.
  [[nodiscard]] LevelTriple finest() const { return finest_level(rate, coarsening); }
};

/// Gold at these rates; nothing else is asked of it.
inline GoldSettings gold_settings(const Grid& grid, int granularity, const Rates& rates) {
  GoldSettings out{grid, granularity, rates.gold, rates.upsampling, rates.interpolation};
  out.differences = rates.differences;
  return out;
}

/// The base alone as a volume, every brick at level 0.
inline MixedVolume as_mixed(std::vector<float> base, const GoldSettings& settings) {
  MixedVolume m;
  m.grid = settings.grid;
  m.granularity = settings.granularity;
  m.coarsening = settings.coarsening;
  m.base = std::move(base);
  m.level.assign(static_cast<std::size_t>(m.brick_count()), LevelTriple{0, 0, 0});
  m.tile.assign(static_cast<std::size_t>(m.brick_count()), 0);
  return m;
}

/// The largest granularity up to `wanted` with bricks at most twice as thick as the thinnest axis: half of a
/// tile beyond the grid costs less than a record for each of eight times as many bricks.
inline int fitting_granularity(int wanted, const Grid& grid) {
  int g = wanted;
  while (g > 1 && 2 * *std::min_element(grid.cells.begin(), grid.cells.end()) < g) g /= 2;
  return g;
}

}  // namespace vdvr
