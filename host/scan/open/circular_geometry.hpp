// `geometry` of scan.json: a circular scan in a few numbers.
#pragma once

#include "host/scan/geometry/cone_views.hpp"
#include "host/scan/geometry/description.hpp"

namespace vdvr::io {

/// The member's object; of its names `angles` is left to the caller.
Description circular_description(const Description& scan);
/// One view for each angle, degrees. Throws FileError.
ConeViews circular_geometry(const Description& about, const StackShape& stack,
                            const std::vector<double>& theta_deg);

}  // namespace vdvr::io
