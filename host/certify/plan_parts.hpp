// What a plan is to those who carry it out: in their units (units.hpp), and as settings of gold.
#pragma once

#include "host/certify/gold/gold_settings.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// What is given in `units` in world units.
Plan to_world(Plan plan, const Units& units);
Tolerance to_world(Tolerance tolerance, const Units& units);

/// Gold of a plan's grid, layout and comparison, at rates that it has chosen or tries.
GoldSettings gold_settings(const Plan& plan, const Rates& rates, bool cone);

}  // namespace vdvr
