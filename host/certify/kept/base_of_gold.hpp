// Base samples taken from kept gold, where a reconstruction of their own would make the same again: of cone
// beam.
#pragma once

#include "host/certify/kept/kept_gold.hpp"

namespace vdvr {

/// F at the grid's samples, as gold at rate 1 has it; 0 farther from the covered region than `margin` across
/// z and four cells along it. Cost: what `kept` does not hold yet.
Volume base_of_gold(opencl::State& state, KeptGold& kept, const Coverage& coverage, const Grid& grid,
                    double margin, const Progress& progress);

}  // namespace vdvr
