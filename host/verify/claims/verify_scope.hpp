// What a certificate says that follows from scan and file alone, computed again (docs/error-bounds.md, "What
// verify compares").
#pragma once

#include <string>
#include <vector>

#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// One line for each claim that differs from what it should be.
using Differences = std::vector<std::string>;

/// Input, geometry, options, rates, coverage, region and the relations between totals: all that needs no
/// field. `used` is the scan's geometry with the centre in use.
Differences compare_scope(const ProjectionSet& scan, const ParallelGeometry& used, const MixedVolume& volume,
                          const Certificate& stored);

/// The sampler terms of the stored samples on this device.
Differences compare_samplers(const SamplerTerms& found, const SamplerTerms& least, bool same_device,
                             const Certificate& stored);

}  // namespace vdvr
