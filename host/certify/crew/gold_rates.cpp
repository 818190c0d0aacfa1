#include "host/certify/crew/gold_rates.hpp"

#include <utility>

namespace vdvr {
namespace {

GoldSettings with_coarse(GoldSettings settings) {
  if (settings.rate >= 4 && !settings.grid_only && !settings.window) settings.coarse_rate = settings.rate / 2;
  return settings;
}

}  // namespace

GoldRates::GoldRates(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                     GoldSettings settings, std::shared_ptr<GoldSource> source) {
  settings = with_coarse(settings);
  fine_.emplace(state, scan, sups, settings, std::move(source));
  if (settings.coarse_rate == 0) return;
  settings.finer_rate = std::exchange(settings.rate, std::exchange(settings.coarse_rate, 0));
  coarse_.emplace(state, scan, sups, settings, fine_->source());
}

}  // namespace vdvr
