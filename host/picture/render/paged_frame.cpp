// Part after part of a picture: the bricks that its rays may read are brought to the device, and the
// ray-caster draws its pixels from end to end (picture_parts.hpp).
#include "host/picture/render/raycast.hpp"

#include <limits>
#include <tuple>

#include "host/picture/render/check_render_options.hpp"
#include "host/picture/render/raycast_params.hpp"
#include "host/volume/sampler/lit_samples.hpp"
#include "host/volume/sampler/picture_parts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

bool stored_would_fit(const PagedVolume& volume) {
  const PagedVolume::Impl& v = volume.impl();
  const DeviceInfo& d = v.state->info;
  return v.whole_lit <= static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()) &&
         lit_sample_bytes * v.whole_lit <= d.max_allocation &&
         sample_buffer_bytes(*v.volume) + lit_sample_bytes * v.whole_lit <= d.global_memory / 2;
}

DrawnField drawn_field(const PagedVolume& volume) {
  const PagedVolume::Impl& v = volume.impl();
  const FieldFacts& f = *v.facts;
  return {v.state, v.volume->grid, v.grid, f.ranges, f.value_range, f.highest_level, f.has_tile};
}

std::pair<SamplerKind, std::string> choose_sampler(SamplerKind asked) {
  if (asked == SamplerKind::image3d)
    throw ResourceError(
        "the image3d sampler cannot be used: the volume is brought to the device by bricks, and what a "
        "texture "
        "unit reads depends in its last bits on where a tile lies; use `sampler` buffer");
  return {SamplerKind::buffer, asked == SamplerKind::buffer ? "asked for" : "the volume comes by bricks"};
}

Enqueued enqueue_frame(Frame& frame, Device& device, const PagedVolume& volume, const RenderOptions& o,
                       const RaycastTuning& tuning, std::optional<Rows> rows, const Drawn& drawn) {
  check_options(o);
  const PagedVolume::Impl& v = volume.impl();
  if (o.output == RenderOutput::error && !frame.has_bounds())
    throw InputError("`show` error: the renderer has no bounds by brick");
  FramePlan plan;
  plan.tuning = tuning;
  plan.tuning.group_x = plan.tuning.group_y = static_cast<int>(PictureParts::least_side);
  std::tie(plan.sampler, plan.sampler_reason) = choose_sampler(o.sampler);
  plan.slack = range_slack(device, *v.facts, plan.sampler);
  plan.gradient = choose_gradient(o, plan.sampler, stored_would_fit(volume));
  plan.lanes = lanes_for(*v.state, v.highest_place(), 3 * v.facts->ranges.size(), plan.sampler, plan.gradient,
                         plan.tuning);
  const BakedTransfer& table = frame.prepare(o, plan.slack, base_first(o, plan.gradient, plan.lanes));
  opencl::finish(*v.state, "preparing a frame");
  const auto start = std::chrono::steady_clock::now();
  const bool lit = plan.gradient == GradientKind::stored;
  const bool flat = o.mode == RenderMode::slice,
             by_rays = o.mode == RenderMode::dvr || o.mode == RenderMode::iso;
  PartNeeds needs;
  needs.lit = lit;
  needs.beside = by_rays && (o.shading || o.output == RenderOutput::normal);
  // The picture lies on the device by now, and will on the host.
  needs.aside = sizeof(cl_float4) * static_cast<std::uint64_t>(o.width * o.height);
  std::variant<VdvrRaycast, VdvrSlice> rays = VdvrRaycast{};
  if (flat) rays = make_slice(frame.field(), o);
  else rays = make_params(frame.field(), o, table, plan.slack);
  const Rows all = rows.value_or(Rows{0, o.height});
  const PictureParts parts(v, rays, needs);
  parts.each({0, all.first, o.width, all.end}, [&](const PixelBox& pixels, std::vector<std::uint8_t> here) {
    const auto part = v.load(std::move(here), lit);
    draw_pixels(frame, *part, o, plan, table, pixels);
    opencl::finish(*v.state, "drawing a part of a picture");
    if (drawn) drawn(pixels);
  });
  return {plan.sampler, std::move(plan.sampler_reason), plan.gradient, start};
}

}  // namespace vdvr
