// What a build will store and how long it will take, from a sample of its bricks. Called by plan.cpp.
#pragma once

#include <cstdint>

#include "host/certify/classify_bricks.hpp"

namespace vdvr {

struct Foreseen {
  double samples_ratio = 0;  ///< samples stored per base sample, index and tiles included
  double seconds = 0;        ///< of classification and verification
  std::uint64_t tile_bytes = 0;
};

/// Classifies a few whole blocks, which tells the time, and some bricks of every stratum of expected error,
/// which tells the storage. `base` holds F on the grid, `stored` the base samples to store, `tolerance` is
/// what the node test may take. Raising bricks after closing is not foreseen: it concerns few. Cost: about 1
/// % of the build, and six layers of rows.
Foreseen foresee_build(opencl::State& state, GoldRates& gold, const Volume& base,
                       const std::vector<float>& stored, double tolerance);

}  // namespace vdvr
