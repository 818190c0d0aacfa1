// Where a certificate is worst, in the words of what is stored.
#pragma once

#include <cstdint>

#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/verify.hpp"

namespace vdvr {

/// The corner of a gold cell (`cell` of the brick, `rate` to a cell of the grid) where V is farthest from F,
/// and the stored sample nearest to it. Cost: F at eight points.
SamplePlace worst_sample(const MixedVolume& v, const ExactField& field, std::int64_t brick,
                         const Index3& cell, int rate);

}  // namespace vdvr
