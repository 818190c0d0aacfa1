// What was understood of a scan, on one screen: what its values are, how the views turn, which file is which
// view, what was assumed and how to say otherwise. Called by info, run and whatever else reads a scan.
#pragma once

#include <numbers>

#include "apps/common/common_options.hpp"
#include "vdvr/expert/find_roll.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/understood.hpp"

namespace vdvr::cli {

inline constexpr double degrees_per_radian = 180 / std::numbers::pi;

/// "1.49 +- 0.004 degrees, by the centres of 16 bands of rows: --axis-roll 1.49"; `stated`: what was read
/// with.
std::string words_of(const RollEstimate& roll, double stated);
Json understood_json(const ProjectionSet& scan, const Understood& understood);
/// With `understood`, what was understood too.
void print_scan(const ProjectionSet& scan, const Understood* understood = nullptr);

}  // namespace vdvr::cli
