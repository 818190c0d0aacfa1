#pragma once

#include "host/measure/measured_region.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/mean_of_scan.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Cost: MeanWeights::of_view of every view, and a pass over the scan. Memory: its tables, and what it takes
/// for each thread. The same on every machine. Throws as MeanWeights.
MeanOfScan mean_of_scan(const ProjectionSet& scan, const FieldOptions& field, const MeasuredRegion& region,
                        const MeanNoise& noise, std::uint64_t max_memory_bytes, const Progress& progress);

}  // namespace vdvr
