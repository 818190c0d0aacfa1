// A picture of an audit (docs/audit.md).
#pragma once

#include "vdvr/api.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/image.hpp"

namespace vdvr {

/// |W - F| on the slice across z through the worst point that was found, W trilinear and as it is; colours up
/// to AuditFigures::within, else to what was found there. Cost: as error_slice.
VDVR_API Image audit_picture(Device& device, const ProjectionSet& scan, const Volume& volume,
                             const Audit& audit, const AuditOptions& options, const Progress& progress = {});

}  // namespace vdvr
