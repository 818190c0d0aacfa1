// What was understood of a scan, on one screen: what its values are, how the views turn, which file is which
// view, what was assumed and how to say otherwise. Called by info, run and whatever else reads a scan.
#pragma once

#include "apps/common/common_options.hpp"
#include "vdvr/projections.hpp"

namespace vdvr::cli {

/// The same as JSON.
Json understood_json(const ProjectionSet& scan);
void print_scan(const ProjectionSet& scan);

}  // namespace vdvr::cli
