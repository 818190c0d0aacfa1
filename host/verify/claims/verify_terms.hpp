// What a certificate says of its terms, computed again by build's own code: this finds edits, the measure of
// |V - F| is another (docs/error-bounds.md, "What verify compares").
#pragma once

#include <cstdint>
#include <vector>

#include "host/verify/claims/verify_scope.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Reference range, arithmetic, P, and T + P with |V - gold| in the selected bricks. Cost: what `build` takes
/// to filter, to reconstruct the base, and to measure those bricks. `exhaustive`: all bricks are selected.
Differences compare_terms(Device& device, const ProjectionSet& scan, const ExactField& exact,
                          const MixedVolume& volume, const Certificate& stored,
                          const std::vector<std::uint8_t>& selected, bool exhaustive,
                          const Progress& progress);

}  // namespace vdvr
