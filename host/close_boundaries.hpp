// Boundary closing `coarse`: makes the field continuous across bricks of different levels without upgrading
// any, and packs the result (docs/error-bounds.md, section on closing). Called by build.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/mixed_volume.hpp"

namespace vdvr {

/// The bricks before closing: their levels, whether they take part (a brick wholly outside the covered
/// region, or the region of interest, does not), and the gold samples of those above level 0.
struct OpenBricks {
  Grid grid;
  int granularity = 4;
  int rate = 8;
  std::vector<float> base;               ///< [nz+1][ny+1][nx+1]
  std::vector<LevelTriple> level;        ///< [bz][by][bx]
  std::vector<std::uint8_t> involved;    ///< [bz][by][bx]
  std::vector<std::vector<float>> gold;  ///< per brick: its tile's samples from gold; empty at level 0
};

/// Each shared face, edge and corner takes, per axis, the lowest level of its incident bricks; the samples of
/// finer bricks on it are interpolated from that one, edges before faces. Every sample that several bricks
/// store is computed from one source, so that they hold the same bits. Cost: the tiles' boundaries, over all
/// cores.
MixedVolume close_boundaries(const OpenBricks& bricks);

/// Bricks of the grid that share a part of a closed brick: side per axis x, y, z is 0 (low border), 1
/// (inside) or 2 (high border). Only those that take part, the brick itself included.
std::vector<std::int64_t> incident_bricks(const OpenBricks& bricks, std::int64_t brick,
                                          const std::array<int, 3>& side);

}  // namespace vdvr
