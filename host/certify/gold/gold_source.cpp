#include "host/certify/gold/gold_source.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {

double gold_reach(const GoldSettings& settings) {
  return std::max(settings.least_reach,
                  std::max(settings.kept(), kept_margin(settings.grid, 1)) +
                      3 * std::hypot(settings.grid.spacing[0], settings.grid.spacing[1]));
}

double reach_of_all(GoldSettings settings) {
  double reach = gold_reach(settings);
  // A base of more than four cells of the detector's pitch holds nothing.
  for (std::uint8_t log = 1; log <= 2; ++log) {
    bool divides = true;
    for (const std::int64_t cells : settings.grid.cells) divides = divides && cells % (1 << log) == 0;
    if (!divides) break;
    settings.coarsening = {log, log, log};
    reach = std::max(reach, gold_reach(settings));
  }
  return reach;
}

GoldSource::GoldSource(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                       const GoldSettings& settings)
    : kept(state, scan, sups, settings.grid, gold_reach(settings), settings.upsampling,
           settings.interpolation, settings.heights_bytes) {
  if (settings.part) kept.keep_only(*settings.part);
  if (!settings.base_only) remainder.emplace(state, kept, scan, sups, settings.grid, settings.granularity);
}

}  // namespace vdvr
