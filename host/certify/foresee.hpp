// What a build will store and how long it will take, from a sample of its bricks. Called by plan.cpp.
#pragma once

#include <cstdint>

#include "host/certify/classify_bricks.hpp"

namespace vdvr {

struct Foreseen {
  double samples_ratio = 0;  ///< samples stored per base sample, index and tiles included
  double seconds = 0;        ///< of classification and verification
  double kept_seconds = 0;   ///< of those, what gold takes that is kept
  std::uint64_t tile_bytes = 0;
  std::uint64_t kept_bytes = 0;  ///< of gold that will be kept and is not yet
};

/// Bricks that stand for all: those near the coverage, or of large grids those of some columns of blocks from
/// the lowest to the highest, at places that stand for equal areas of the covered disc.
std::vector<std::uint8_t> bricks_to_look_at(GoldStream& stream, const ParallelGeometry& geometry);

/// Classifies a few whole blocks, which tells the time, and some bricks of every stratum of expected error,
/// which tells the storage, among those to look at. `base` holds F on the grid, `stored` the base samples to
/// store, `tolerance` is what the node test may take. Raising bricks after closing is not foreseen: it
/// concerns few. Cost: about 1 % of the build.
Foreseen foresee_build(opencl::State& state, GoldRates& gold, const Volume& base,
                       const std::vector<float>& stored, const std::vector<std::uint8_t>& looked_at,
                       double tolerance);

}  // namespace vdvr
