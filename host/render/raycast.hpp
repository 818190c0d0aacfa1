// The float picture behind raycast(), and its tuning; tests and benches use it, the public call converts it
// to 8 bits. Called by: raycast() in raycast.cpp, tests/device/raycast_test.cpp.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/opencl/kernel.hpp"
#include "host/sampler/resident_volume.hpp"
#include "shared/raycast_params.h"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Never changes a picture.
struct RaycastTuning {
  int group_x = 8, group_y = 8;  ///< pixels of one work-group
  /// Rays that a work-item follows side by side: 1, 4, 8 or 16; default: on CPUs 8, or 16 with stored
  /// gradients, else 1. The image3d sampler and volumes of 2^31 samples take 1.
  std::optional<int> lanes;
};

struct FloatPicture {
  /// [y][x]: r, g, b display values, or of output depth and normal the unit normal; then the value of
  /// RenderResult, but of iso -1 and of mip -infinity where it is NaN there, and of normal the depth.
  std::vector<cl_float4> pixels;
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;
  GradientKind gradient = GradientKind::central;
  std::int64_t samples = 0;
  double seconds = 0;
};
FloatPicture raycast_float(Device& device, const ResidentVolume& volume, const RenderOptions& options,
                           const RaycastTuning& tuning = {});

// --- for a field that takes the place of the volume's (d2vr.cpp) ---

struct DvrFrame {
  opencl::Range range;
  VdvrRaycast params;
};
/// Checks options of mode dvr; brings table, distances and picture of `v`'s frame up to date.
DvrFrame prepare_dvr(ResidentVolume::Impl& v, const RenderOptions& options, const RaycastTuning& tuning,
                     int lanes);
/// Waits for the picture: fills pixels, samples and seconds since `start`.
void read_frame(ResidentVolume::Impl& v, std::chrono::steady_clock::time_point start, FloatPicture& picture);
RenderResult to_result(FloatPicture picture, const RenderOptions& options);

}  // namespace vdvr
