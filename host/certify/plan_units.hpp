// Plans in other units (units.hpp).
#pragma once

#include "host/scan/units.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// What is given in `units` in world units. Bounds by brick never become smaller.
Plan to_world(Plan plan, const Units& units);

}  // namespace vdvr
