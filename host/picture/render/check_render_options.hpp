// Refuses render options that are out of range or exclude each other.
#pragma once

#include "vdvr/raycast.hpp"

namespace vdvr {

/// Throws InputError naming the option and its value. What depends on the volume is checked by whoever has
/// it.
void check_options(const RenderOptions& options);

}  // namespace vdvr
