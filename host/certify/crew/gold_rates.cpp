#include "host/certify/crew/gold_rates.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "host/certify/kept/gold_filters.hpp"

namespace vdvr {
namespace {

// Cell coordinates of nodes are exact in fp32.
constexpr std::int64_t most_nodes_across = 1 << 24;

GoldSettings with_coarse(GoldSettings settings) {
  if (settings.rate >= 4 && !settings.grid_only && !settings.window) settings.coarse_rate = settings.rate / 2;
  return settings;
}

bool is_possible(const GoldSettings& settings, const KeptGold& kept) {
  const std::array<int, 3> phases = kept.lattice(settings.grid, settings.rate).phases;
  const auto cells = *std::max_element(settings.grid.cells.begin(), settings.grid.cells.end());
  return cells * settings.rate <= most_nodes_across &&
         *std::max_element(phases.begin(), phases.end()) <= most_gold_phases;
}

}  // namespace

GoldRates::GoldRates(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                     GoldSettings settings, std::shared_ptr<GoldSource> source) {
  settings = with_coarse(settings);
  fine_.emplace(state, scan, sups, settings, std::move(source));
  if (settings.coarse_rate == 0) return;
  GoldSettings coarse = settings;
  coarse.finer_rate = std::exchange(coarse.rate, std::exchange(coarse.coarse_rate, 0));
  settings.rate *= 2;
  settings.coarse_rate = 0;
  if (is_possible(settings, fine_->source()->kept)) {
    finer_.emplace(state, scan, sups, settings, fine_->source());
    coarse.finer_rate = settings.rate;
  }
  coarse_.emplace(state, scan, sups, coarse, fine_->source());
}

GoldStream& GoldRates::of(int rate) {
  for (auto* gold : {&fine_, &coarse_, &finer_})
    if (*gold && (*gold)->settings().rate == rate) return **gold;
  throw std::logic_error("GoldRates: gold of a rate that there is none of");
}

}  // namespace vdvr
