// Launches the ray-caster over resident volumes: chooses sampler, gradients and packets. Launches:
// raycast_dvr, raycast_preintegrated, raycast_level, raycast_adaptive, raycast_iso, raycast_mip,
// raycast_integral, slice of kernels/picture/render/raycast.cl.
#include "host/picture/render/raycast.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "host/base/opencl/column_tuning.hpp"
#include "host/picture/render/check_render_options.hpp"
#include "host/picture/render/raycast_params.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

using Impl = ResidentVolume::Impl;

DrawnField drawn_field(const ResidentVolume& volume) {
  const Impl& v = volume.impl();
  const FieldFacts& f = *v.facts;
  return {v.state, v.grid, v.field.grid, f.ranges, f.value_range, f.highest_level, f.has_tile};
}

// --- the sampler ---

std::pair<SamplerKind, std::string> choose_sampler(Device& device, const ResidentVolume& v,
                                                   SamplerKind asked) {
  if (asked == SamplerKind::buffer) return {SamplerKind::buffer, "asked for"};
  if (asked == SamplerKind::image3d) {
    if (!v.has_image3d())
      throw ResourceError("the image3d sampler cannot be used: " + v.image3d_reason() +
                          "; use `sampler` buffer");
    return {SamplerKind::image3d, "asked for"};
  }
  if (!v.has_image3d()) return {SamplerKind::buffer, v.image3d_reason()};
  const SamplerProbe p = probe_sampler(device);
  const bool image = p.chosen == "image3d";
  return {
      image ? SamplerKind::image3d : SamplerKind::buffer,
      fmt::format("measured {:.3g} samples/s by buffer, {:.3g} by image3d", p.buffer_rate, p.image3d_rate)};
}

// How far a sample may leave the range of its brick's samples: three nested lerps in fp32 stay within 14 u of
// the largest (docs/error-bounds.md); the texture unit adds what the probe measured on constants, taken
// twice.
float range_slack(Device& device, const FieldFacts& v, SamplerKind sampler) {
  const double magnitude = std::max(std::abs(v.value_range.first), std::abs(v.value_range.second));
  double slack = 0x1p-20 * magnitude;
  if (sampler == SamplerKind::image3d)
    slack += (2 * probe_sampler(device).largest_constant_error() + 0x1p-20) * static_cast<double>(v.largest);
  return static_cast<float>(slack);
}

// Packets address samples and records by 32-bit numbers.
int lanes_for(const opencl::State& state, std::uint64_t highest_place, std::uint64_t record_words,
              SamplerKind sampler, GradientKind gradient, const RaycastTuning& tuning) {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  const bool lit = gradient == GradientKind::stored;  // then LitLayout::is_addressable() holds
  if (sampler == SamplerKind::image3d || (!lit && highest_place > most) || record_words > most) return 1;
  // Lit samples come in wide loads, of which twice as many keep the shuffles busy.
  return tuning.lanes.value_or(!carries_lanes(state.info) ? 1 : gradient == GradientKind::stored ? 16 : 8);
}
int lanes_for(const Impl& v, SamplerKind sampler, GradientKind gradient, const RaycastTuning& tuning) {
  return lanes_for(*v.state, v.field.highest_place, v.field.bricks.size(), sampler, gradient, tuning);
}

GradientKind choose_gradient(const RenderOptions& o, SamplerKind sampler, bool stored_fit) {
  const bool needed = o.output == RenderOutput::normal || (o.shading && o.output == RenderOutput::colour);
  if (o.gradient == GradientKind::automatic)
    return o.mode == RenderMode::dvr && needed && sampler == SamplerKind::buffer && stored_fit
               ? GradientKind::stored
               : GradientKind::central;
  if (o.gradient == GradientKind::stored && sampler == SamplerKind::image3d)
    throw InputError("`gradient` stored: the image3d sampler has none; use `sampler` buffer");
  return o.gradient;
}

namespace {

struct KernelName {
  const char *name, *number;  // VDVR_KERNEL: the number
};
KernelName kernel_of(const RenderOptions& o) {
  switch (o.mode) {
    case RenderMode::iso:
      return {"raycast_iso", "VDVR_KERNEL_ISO"};
    case RenderMode::mip:
      return {"raycast_mip", "VDVR_KERNEL_MIP"};
    case RenderMode::slice:
      return {"slice", "VDVR_KERNEL_SLICE"};
    case RenderMode::integral:
      return {"raycast_integral", "VDVR_KERNEL_INTEGRAL"};
    default:
      break;
  }
  if (o.classification == Classification::preintegrated)
    return {"raycast_preintegrated", "VDVR_KERNEL_PREINTEGRATED"};
  if (o.step_mode == StepMode::level) return {"raycast_level", "VDVR_KERNEL_LEVEL"};
  if (o.step_mode == StepMode::adaptive) return {"raycast_adaptive", "VDVR_KERNEL_ADAPTIVE"};
  return {"raycast_dvr", "VDVR_KERNEL_DVR"};
}

}  // namespace

bool base_first(const RenderOptions& o, GradientKind gradient, int lanes) {
  return std::string(kernel_of(o).name) == "raycast_dvr" && gradient == GradientKind::stored && lanes > 1;
}

opencl::Defines raycast_defines(const Impl& v, const RenderOptions& o, SamplerKind sampler,
                                GradientKind gradient, const RaycastTuning& tuning, int lanes) {
  const bool lit = gradient == GradientKind::stored;
  const bool uniform = lit ? v.lit_layout.is_uniform() : v.is_uniform;
  opencl::Defines defines = coarse_defines(v.field.grid);
  const auto add = [&](const opencl::Defines& more) {
    defines.insert(defines.end(), more.begin(), more.end());
  };
  add({
      {"VDVR_KERNEL", kernel_of(o).number},
      {"VDVR_GRANULARITY", std::to_string(v.field.grid.granularity)},
      {sampler == SamplerKind::image3d ? "VDVR_SAMPLER_IMAGE3D" : "VDVR_SAMPLER_BUFFER", "1"},
      {"VDVR_GROUP_X", std::to_string(group_for(tuning.group_x, lanes))},
      {"VDVR_GROUP_Y", std::to_string(group_for(tuning.group_y, lanes))},
      {"VDVR_GEOMETRY", o.output == RenderOutput::colour ? "0" : "1"},
      {"VDVR_BOUNDS", o.output == RenderOutput::error ? "1" : "0"},
      {"VDVR_GRADIENT_ANALYTIC", gradient == GradientKind::analytic ? "1" : "0"},
      {"VDVR_LIT", lit ? "1" : "0"},
      {"VDVR_FIXED_LIGHTS", o.lights.empty() && o.head_light ? "0" : "1"},
      {"VDVR_LANES", std::to_string(lanes)},
      {"VDVR_UNIFORM", uniform && lanes > 1 ? "1" : "0"},
      {"VDVR_BASE_FIRST", base_first(o, gradient, lanes) ? "1" : "0"},
  });
  if (lit) add({{"VDVR_SAMPLE_TYPES", "1"}});
  else add(sampler == SamplerKind::image3d ? v.atlas_defines() : v.field.defines);
  return defines;
}

int group_for(int asked, int lanes) { return asked > 0 ? asked : lanes == 16 ? 16 : 8; }

opencl::Range packet_range(const RenderOptions& o, const RaycastTuning& tuning, int lanes) {
  // Pixels of one packet (device/packet.h).
  const int packet_x = lanes == 1 ? 1 : lanes == 4 ? 2 : 4, packet_y = lanes / packet_x;
  const int group_x = group_for(tuning.group_x, lanes), group_y = group_for(tuning.group_y, lanes);
  const auto packets = [](std::int64_t pixels, int packet) {
    return static_cast<std::uint64_t>((pixels + packet - 1) / packet);
  };
  return {{packets(o.width, packet_x), packets(o.height, packet_y), 1},
          {packets(group_x, packet_x), packets(group_y, packet_y), 1}};
}

namespace {

// `field`: the sample buffer, or the three images of the atlas; `bricks` the records that go with it.
template <class... Field>
void launch(const Frame& f, const Impl& v, const RenderOptions& o, const opencl::Defines& defines,
            const opencl::Range& range, const PixelBox& pixels, const BakedTransfer& table, float slack,
            const VdvrGrid& grid, const cl::Buffer& bricks, const Field&... field) {
  const auto& picture = f.picture().buffer();
  if (o.mode == RenderMode::slice) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, VdvrSlice, cl::Buffer, cl::Buffer> kernel(
        *v.state, "picture/render/raycast", kernel_of(o).name, defines);
    VdvrSlice slice = make_slice(f.field(), o);
    slice.pixel_x = static_cast<int>(pixels.x0);
    slice.pixel_y = static_cast<int>(pixels.y0);
    kernel(range, field..., bricks, grid, slice, picture, f.row_samples());
    return;
  }
  // dvr and iso leap by distances, mip by the bricks' maxima; an integral passes every cell.
  VdvrRaycast params = make_params(f.field(), o, table, slack);
  params.pixel_x = static_cast<int>(pixels.x0);
  params.pixel_y = static_cast<int>(pixels.y0);
  const bool by_distance = o.mode == RenderMode::dvr || o.mode == RenderMode::iso;
  const cl::Buffer& guide = by_distance ? f.distance() : v.ranges();
  const auto draw = [&](const auto&... bounds) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrRaycast, cl::Buffer,
                   cl::Buffer, std::remove_cvref_t<decltype(bounds)>...>
        kernel(*v.state, "picture/render/raycast", kernel_of(o).name, defines);
    kernel(range, field..., bricks, grid, guide, f.table(), params, picture, f.row_samples(), bounds...);
  };
  if (o.output == RenderOutput::error) draw(f.bounds());
  else draw();
}

}  // namespace

void draw_pixels(Frame& frame, const Impl& v, const RenderOptions& o, const FramePlan& plan,
                 const BakedTransfer& table, const PixelBox& pixels) {
  RenderOptions drawn = o;
  drawn.width = pixels.x1 - pixels.x0;
  drawn.height = pixels.y1 - pixels.y0;
  const opencl::Range range = packet_range(drawn, plan.tuning, plan.lanes);
  const auto defines = raycast_defines(v, o, plan.sampler, plan.gradient, plan.tuning, plan.lanes);
  const auto draw = [&](const VdvrGrid& grid, const cl::Buffer& bricks, const auto&... field) {
    launch(frame, v, o, defines, range, pixels, table, plan.slack, grid, bricks, field...);
  };
  if (plan.sampler == SamplerKind::image3d) {
    const Atlas& atlas = v.atlas();
    draw(v.field.grid, atlas.bricks.buffer(), atlas.images[0], atlas.images[1], atlas.images[2]);
  } else if (plan.gradient == GradientKind::stored) {
    const LitSamples& lit = v.lit();
    draw(lit.grid(), lit.bricks(), lit.samples());
  } else {
    draw(v.field.grid, v.field.bricks.buffer(), v.field.samples.buffer());
  }
}

Enqueued enqueue_frame(Frame& frame, Device& device, const ResidentVolume& volume, const RenderOptions& o,
                       const RaycastTuning& tuning, std::optional<Rows> rows) {
  check_options(o);
  const Impl& v = volume.impl();
  if (o.output == RenderOutput::error && !frame.has_bounds())
    throw InputError("`show` error: the renderer has no bounds by brick");
  FramePlan plan;
  plan.tuning = tuning;
  std::tie(plan.sampler, plan.sampler_reason) = choose_sampler(device, volume, o.sampler);
  plan.slack = range_slack(device, *v.facts, plan.sampler);
  plan.gradient = choose_gradient(o, plan.sampler, v.lit_fits());
  plan.lanes = lanes_for(v, plan.sampler, plan.gradient, tuning);
  const BakedTransfer& table = frame.prepare(o, plan.slack, base_first(o, plan.gradient, plan.lanes));

  // What is made on first use is not the frame's time.
  if (plan.sampler == SamplerKind::image3d) static_cast<void>(v.atlas());
  else if (plan.gradient == GradientKind::stored) static_cast<void>(v.lit());
  opencl::finish(*v.state, "preparing a frame");
  const auto start = std::chrono::steady_clock::now();
  const Rows all = rows.value_or(Rows{0, o.height});
  draw_pixels(frame, v, o, plan, table, {0, all.first, o.width, all.end});
  return {plan.sampler, std::move(plan.sampler_reason), plan.gradient, start};
}

FloatPicture read_frame(const Frame& frame, const Enqueued& enqueued) {
  FloatPicture p;
  p.pixels = frame.picture().to_host();
  p.seconds = enqueued.seconds();
  p.samples = frame.samples();
  p.sampler = enqueued.sampler;
  p.sampler_reason = enqueued.sampler_reason;
  p.gradient = enqueued.gradient;
  return p;
}

FloatPicture raycast_float(Device& device, const ResidentVolume& volume, const RenderOptions& o,
                           const RaycastTuning& tuning) {
  Frame frame(drawn_field(volume));
  return read_frame(frame, enqueue_frame(frame, device, volume, o, tuning));
}

}  // namespace vdvr
