// Launches frames of resident volumes, and the float picture behind Renderer::render(), which converts it to
// 8 bits; tests and benches use it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/base/opencl/kernel.hpp"
#include "host/picture/render/frame.hpp"
#include "host/volume/sampler/paged_volume.hpp"
#include "host/volume/sampler/picture_parts.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Never changes a picture.
struct RaycastTuning {
  /// Pixels of one work-group; 0: 16 each way of packets of 16 rays, which then find more of what they read
  /// in a CPU's second cache, else 8.
  int group_x = 0, group_y = 0;
  /// Rays that a work-item follows side by side: 1, 4, 8 or 16; default: on CPUs 8, or 16 with stored
  /// gradients, else 1. The image3d sampler and volumes of 2^31 samples take 1; of mixed types those of 2^31
  /// smallest samples.
  std::optional<int> lanes;
};

/// A frame that the device works on: what its picture will be, without pixels.
struct Enqueued {
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;
  GradientKind gradient = GradientKind::central;
  std::chrono::steady_clock::time_point start;
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
};

DrawnField drawn_field(const ResidentVolume& volume);
/// What a frame takes for `asked`, and why. Throws ResourceError when `image3d` is asked for and cannot be
/// had.
std::pair<SamplerKind, std::string> choose_sampler(Device& device, const ResidentVolume& volume,
                                                   SamplerKind asked);
/// What is chosen for a frame before anything is drawn, and holds for all its parts.
struct FramePlan {
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;
  GradientKind gradient = GradientKind::central;
  float slack = 0;  ///< how far a sample may leave the range of its brick's samples
  int lanes = 1;
  RaycastTuning tuning;
};
/// How far samples may leave ranges.
float range_slack(Device& device, const FieldFacts& facts, SamplerKind sampler);
/// What `automatic` stands for, stored ones having room or not. Throws InputError for stored ones of images.
GradientKind choose_gradient(const RenderOptions& options, SamplerKind sampler, bool stored_fit);
/// Launches the kernel over pixels, and over more to the right and below: up to whole work-groups. `table` as
/// Frame::prepare gave it.
void draw_pixels(Frame& frame, const ResidentVolume::Impl& volume, const RenderOptions& options,
                 const FramePlan& plan, const BakedTransfer& table, const PixelBox& pixels);
/// Of a picture, from `first` on and below `end`; multiples of 16 but for the picture's own end.
struct Rows {
  std::int64_t first = 0, end = 0;
};
/// `frame` is of the volume's drawn_field(). `rows`: draws no others. Throws as Renderer::render.
Enqueued enqueue_frame(Frame& frame, Device& device, const ResidentVolume& volume,
                       const RenderOptions& options, const RaycastTuning& tuning = {},
                       std::optional<Rows> rows = std::nullopt);
/// Pixels of one work-group along an axis, of which `asked` are asked for.
int group_for(int asked, int lanes);
/// Pixels that work-items take.
opencl::Range packet_range(const RenderOptions& options, const RaycastTuning& tuning, int lanes);
/// How many rays a work-item takes, of a volume no sample of which has a higher place.
int lanes_for(const opencl::State& state, std::uint64_t highest_place, std::uint64_t record_words,
              SamplerKind sampler, GradientKind gradient, const RaycastTuning& tuning);
int lanes_for(const ResidentVolume::Impl& volume, SamplerKind sampler, GradientKind gradient,
              const RaycastTuning& tuning);
/// Whether packets ask first which of their bricks read the base (VDVR_BASE_FIRST). It needs the guide that
/// Frame::prepare makes.
bool base_first(const RenderOptions& options, GradientKind gradient, int lanes);
/// What the program of kernels/picture/render/raycast.cl is built with.
opencl::Defines raycast_defines(const ResidentVolume::Impl& volume, const RenderOptions& options,
                                SamplerKind sampler, GradientKind gradient, const RaycastTuning& tuning,
                                int lanes);

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
/// Waits for the picture.
FloatPicture read_frame(const Frame& frame, const Enqueued& enqueued);
FloatPicture raycast_float(Device& device, const ResidentVolume& volume, const RenderOptions& options,
                           const RaycastTuning& tuning = {});

/// Values and picture of a frame's pixels (renderer.cpp).
void convert(std::span<const cl_float4> pixels, const RenderOptions& options, RenderResult& result);

// --- volumes that come by bricks (paged_frame.cpp) ---

DrawnField drawn_field(const PagedVolume& volume);
/// Always `buffer`. Throws ResourceError for image3d: the positions of samples in an atlas have the rounding
/// of their coordinates there, so that other tiles beside them would change bits.
std::pair<SamplerKind, std::string> choose_sampler(SamplerKind asked);
/// Whether GradientKind::automatic takes stored gradients: what a device of which half is free
/// would do for the whole volume.
bool stored_would_fit(const PagedVolume& volume);
/// Is told of what was drawn.
using Drawn = std::function<void(const PixelBox&)>;
/// Draws part after part, and waits for each: bricks of the next take the place of those before. `frame` is
/// of the volume's drawn_field(). `rows`: draws no others. Throws as Renderer::render, ResourceError where
/// the bricks of a few pixels do not fit, and Interrupted.
Enqueued enqueue_frame(Frame& frame, Device& device, const PagedVolume& volume, const RenderOptions& options,
                       const RaycastTuning& tuning = {}, std::optional<Rows> rows = std::nullopt,
                       const Drawn& drawn = {});

}  // namespace vdvr
