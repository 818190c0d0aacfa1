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
  // A base of more than four cells of the detector's pitch holds nothing.
  constexpr std::uint8_t coarsest = 2;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t cells = settings.grid.cells[a];
    std::uint8_t& of_axis = settings.coarsening[2 - a];  // along z, y, x
    while (of_axis < coarsest && cells % (std::int64_t{2} << of_axis) == 0) ++of_axis;
  }
  return gold_reach(settings);
}

GoldSource::GoldSource(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                       const GoldSettings& settings)
    : kept(state, scan, sups, settings.grid, gold_reach(settings), settings.upsampling,
           settings.interpolation, settings.heights_bytes),
      state_(state),
      scan_(scan),
      sups_(sups) {
  if (settings.part) kept.keep_only(*settings.part);
  if (settings.views_together > 0) kept.take_views_together(settings.views_together);
  if (!settings.base_only) take_differences(settings);
}

void GoldSource::take_differences(const GoldSettings& s) {
  remainder.emplace(state_, kept, scan_, sups_, s.grid, s.granularity, s.differences);
}

}  // namespace vdvr
