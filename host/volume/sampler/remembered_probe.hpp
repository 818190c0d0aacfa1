// What a device's texture unit was found to do, remembered from one process to the next: by the device's
// identity (host/base/opencl/trust.hpp) and the text of the kernels that measure.
#pragma once

#include <optional>

#include "host/base/opencl/state.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr {

/// As measured on such a device, without rates. None where nothing is remembered, where a file holds anything
/// else, or where a layer may stand between the program and the device (LD_PRELOAD, LD_AUDIT, OPENCL_LAYERS).
std::optional<SamplerProbe> remembered_filters(const opencl::State& state);

/// Nothing of filters whose numbers are not finite, or behind such a layer.
void remember_filters(const opencl::State& state, const SamplerProbe& probe);

}  // namespace vdvr
