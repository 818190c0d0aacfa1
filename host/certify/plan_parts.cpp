#include "host/certify/plan_parts.hpp"

#include "host/volume/result_units.hpp"

namespace vdvr {

Plan to_world(Plan plan, const Units& units) {
  const int density = units.density();
  plan.grid = to_world(plan.grid, units);
  plan.base.grid = to_world(plan.base.grid, units);
  scale(plan.base.samples, density);
  plan.epsilon_abs = to_world(plan.epsilon_abs, units);
  plan.reference_range = to_world(plan.reference_range, units);
  if (plan.range_at)
    for (Vec3& place : *plan.range_at) place = to_world(place, units);
  scale(plan.bounds, density);
  scale(plan.budget, density);
  return plan;
}

Tolerance to_world(Tolerance tolerance, const Units& units) {
  if (tolerance.absolute) tolerance.absolute = to_world(*tolerance.absolute, units);
  return tolerance;
}

GoldSettings gold_settings(const Plan& plan, const Rates& rates, bool cone) {
  const Comparison& comparison = plan.settings.comparison;
  GoldSettings settings = gold_settings(plan.grid, plan.layout.granularity, rates);
  settings.midrange = comparison.coefficients == Coefficients::midrange;
  settings.anisotropic = plan.layout.levels == Levels::anisotropic;
  settings.grid_only = comparison.terms == Terms::grid;
  settings.coarsening = plan.layout.coarsening;
  // Plans try several coarsenings, and gold is kept once.
  if (cone) settings.least_reach = reach_of_all(settings);
  return settings;
}

IntegerLattice lattice_of(std::span<const float> base, double epsilon_abs, const VolumeLayout& layout,
                          const Units& units, StorageChoice storage, const FilterErrors& filters) {
  return choose_lattice(base, storage, most_rounding(epsilon_abs, layout.levels == Levels::anisotropic),
                        units.density(), filters);
}

std::shared_ptr<PreparedScan> preparation_of(opencl::State& state, const ScanInUnits& from, const Plan& plan,
                                             const Progress& progress) {
  if (plan.prepared && plan.prepared->of == PreparedOf(state, from, plan.field)) return plan.prepared;
  const auto sups = needs_values_alone(plan.rates.interpolation) ? PreparedScan::Sups::of_values
                                                                 : PreparedScan::Sups::of_derivatives;
  return std::make_shared<PreparedScan>(state, from, plan.field, sups, progress);
}

}  // namespace vdvr
