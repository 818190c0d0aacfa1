// What one frame's kernels are told besides the field (kernels/shared/raycast_params.h), from options that
// check_options() has passed.
#pragma once

#include "host/picture/render/frame.hpp"
#include "shared/raycast_params.h"

namespace vdvr {

VdvrRaycast make_params(const DrawnField& field, const RenderOptions& options, const BakedTransfer& table,
                        float slack);
/// Throws InputError for a position outside the grid.
VdvrSlice make_slice(const DrawnField& field, const RenderOptions& options);

}  // namespace vdvr
