#include "host/certify/plan_units.hpp"

#include "host/volume/result_units.hpp"

namespace vdvr {

Plan to_world(Plan plan, const Units& units) {
  const int density = units.density();
  plan.grid = to_world(plan.grid, units);
  plan.base.grid = to_world(plan.base.grid, units);
  scale(plan.base.samples, density);
  plan.epsilon_abs = to_world(plan.epsilon_abs, units);
  plan.reference_range = to_world(plan.reference_range, units);
  scale(plan.bounds, density);
  scale(plan.budget, density);
  return plan;
}

}  // namespace vdvr
