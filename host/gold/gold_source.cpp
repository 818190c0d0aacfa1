#include "host/gold/gold_source.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {

double gold_reach(const GoldSettings& settings) {
  return std::max(settings.kept(), kept_margin(settings.grid, 1)) +
         3 * std::hypot(settings.grid.spacing[0], settings.grid.spacing[1]);
}

GoldSource::GoldSource(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                       const GoldSettings& settings)
    : kept(state, scan, sups, settings.grid, gold_reach(settings), settings.upsampling,
           settings.interpolation, settings.heights_bytes) {
  if (!settings.base_only) remainder.emplace(state, kept, scan, sups, settings.grid, settings.granularity);
}

}  // namespace vdvr
