// The float picture behind raycast(), and its tuning; tests and benches use it, the public call converts it
// to 8 bits. Called by: raycast() in raycast.cpp, tests/raycast_test.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/opencl/cl.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Never changes a picture.
struct RaycastTuning {
  int group_x = 8, group_y = 8;       ///< pixels of one work-group
  std::optional<bool> wide_gradient;  ///< gradients in vectors of eight; default: on CPUs
};

struct FloatPicture {
  /// [y][x]: r, g, b display values; then dvr: opacity; iso: distance from the eye in world units, -1 where
  /// nothing is hit; mip: the maximum, -infinity where the box is missed; slice: the field.
  std::vector<cl_float4> pixels;
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;
  std::int64_t samples = 0;
  double seconds = 0;
};
FloatPicture raycast_float(Device& device, const ResidentVolume& volume, const RenderOptions& options,
                           const RaycastTuning& tuning = {});

}  // namespace vdvr
