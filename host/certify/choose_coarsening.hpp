// How much coarser than the grid the stored base is, per axis (docs/error-bounds.md, section on levels per
// axis).
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

struct CoarseningQuestion {
  int granularity = 4, rate = 8;
  double tolerance = 0;   ///< of |V - F|
  double projection = 0;  ///< what P takes of it
  bool fitted = true;     ///< samples fitted to the trilinear filter err half as much
};

/// The coarsening that is foreseen to store the fewest samples, from second differences of the base samples
/// alone: what bricks take along each axis adds up (error-bounds.md, section 3). `covered`: samples of a
/// plane [y][x] that lie on the detector in every view; bricks with another are not looked at. Nothing of the
/// certificate rests on it. Cost: a look at 4096 bricks at most.
LevelTriple choose_coarsening(const Volume& base, const std::vector<std::uint8_t>& covered,
                              const CoarseningQuestion& question);

/// Whether a base may be that coarse: it divides granularity and cells, and its levels up to gold can be
/// named.
bool is_possible(const LevelTriple& coarsening, const Grid& grid, int granularity, int rate);

/// The samples of a grid that its base has.
std::vector<float> take_base(Volume volume, const LevelTriple& coarsening);

}  // namespace vdvr
