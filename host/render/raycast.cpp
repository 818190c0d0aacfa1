// Launches the ray-caster: checks options, finds which bricks can be leapt over,
// converts the picture. Called by the render, run and bench commands. Launches: raycast_dvr,
// raycast_preintegrated, raycast_level, raycast_iso, raycast_mip, slice of kernels/render/raycast.cl.
#include "host/render/raycast.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <span>
#include <type_traits>

#include "host/opencl/kernel.hpp"
#include "host/render/bake.hpp"
#include "host/render/check_render_options.hpp"
#include "host/render/glm_vectors.hpp"
#include "host/sampler/resident_volume.hpp"
#include "shared/raycast_params.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrRaycast) == 408 && sizeof(VdvrSlice) == 48);

namespace {

using opencl::DeviceArray;
using Impl = ResidentVolume::Impl;

// --- which bricks can matter ---

/// By brick 0 where the transfer function may show something, else the stretch of it that its values lie in.
std::vector<std::uint8_t> empty_bricks(const Impl& v, const BakedTransfer& table, float slack) {
  std::vector<std::uint8_t> classes(v.host_ranges.size());
  std::transform(v.host_ranges.begin(), v.host_ranges.end(), classes.begin(),
                 [&](const cl_float2& r) { return table.stretch_of(r.s[0] - slack, r.s[1] + slack); });
  return classes;
}

/// By brick 1 and on how many surfaces it lies, 0 where a surface may pass.
std::vector<std::uint8_t> sides_of_surfaces(const Impl& v, const std::vector<float>& surfaces, float slack) {
  const auto side = [&](float value) {
    return std::count_if(surfaces.begin(), surfaces.end(), [&](float s) { return value >= s; });
  };
  std::vector<std::uint8_t> classes(v.host_ranges.size());
  std::transform(v.host_ranges.begin(), v.host_ranges.end(), classes.begin(), [&](const cl_float2& r) {
    // Twice the allowance: kernels add one more before they pass a cell.
    const auto lowest = side(r.s[0] - 2 * slack), highest = side(r.s[1] + 2 * slack);
    return static_cast<std::uint8_t>(lowest == highest ? 1 + lowest : 0);
  });
  return classes;
}

// Brings frame.distance up to date; a turntable computes it once.
void update_distance(Impl& v, const RenderOptions& o, const BakedTransfer& table, float slack) {
  std::vector<float> key{slack}, surfaces;
  for (const IsoSurface& s : o.surfaces) surfaces.push_back(static_cast<float>(s.value));
  if (o.mode == RenderMode::dvr) {
    key.insert(key.end(), {0, table.lo, table.scale});
    key.insert(key.end(), table.stretch.begin(), table.stretch.end());
  } else {
    key.push_back(1);
    key.insert(key.end(), surfaces.begin(), surfaces.end());
  }
  if (key == v.frame.distance_key) return;
  const auto classes =
      o.mode == RenderMode::dvr ? empty_bricks(v, table, slack) : sides_of_surfaces(v, surfaces, slack);
  const VdvrGrid& g = v.field->grid;
  const Index3 n{g.bricks_x, g.bricks_y, g.bricks_z};
  const auto distance = distance_to_other(classes, n);
  if (v.frame.distance.size() != distance.size())
    v.frame.distance = DeviceArray<cl_uchar>(*v.state, distance.size(), "distances to occupied bricks");
  v.frame.distance.write(distance);
  v.frame.distance_key = std::move(key);
}

// --- parameters ---

double length_unit(const Grid& g) { return *std::min_element(g.spacing.begin(), g.spacing.end()); }

void set3(float& x, float& y, float& z, const glm::dvec3& v) {
  x = static_cast<float>(v.x);
  y = static_cast<float>(v.y);
  z = static_cast<float>(v.z);
}

void set_surfaces(VdvrRaycast& p, std::vector<IsoSurface> surfaces) {
  std::sort(surfaces.begin(), surfaces.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  for (const IsoSurface& s : surfaces) {
    if (p.surfaces == VDVR_SURFACES) break;
    VdvrSurface& to = p.surface[p.surfaces++];
    to.value = static_cast<float>(s.value);
    to.opacity = static_cast<float>(s.opacity);
    for (std::size_t c = 0; c < 3; ++c) to.rgb[c] = static_cast<float>(s.rgb[c]);
  }
}

void set_lights(VdvrRaycast& p, const RenderOptions& o) {
  p.head_light = o.head_light ? 1 : 0;
  for (const Vec3& light : o.lights) {
    const glm::dvec3 l = glm::normalize(to_glm(light));
    float* to = p.light[p.lights++];
    set3(to[0], to[1], to[2], l);
  }
  // Together they are as bright as one alone.
  p.light_share = 0.75f / static_cast<float>(std::max(1, p.head_light + p.lights));
}

VdvrRaycast make_params(const Impl& v, const RenderOptions& o, const BakedTransfer& table, float slack) {
  const glm::dvec3 origin = to_glm(v.grid.origin), spacing = to_glm(v.grid.spacing),
                   eye = to_glm(o.camera.position);
  const glm::dvec3 forward = glm::normalize(to_glm(o.camera.focal_point) - eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, to_glm(o.camera.view_up)));
  const glm::dvec3 up = glm::cross(right, forward);
  const double tangent = std::tan(glm::radians(o.camera.view_angle_deg) / 2);
  const double aspect = static_cast<double>(o.width) / static_cast<double>(o.height),
               unit = length_unit(v.grid);
  VdvrRaycast p{};
  set3(p.eye_x, p.eye_y, p.eye_z, (eye - origin) / spacing);
  set3(p.forward_x, p.forward_y, p.forward_z, forward);
  set3(p.right_x, p.right_y, p.right_z, right * tangent * aspect);
  set3(p.up_x, p.up_y, p.up_z, up * tangent);
  set3(p.cells_per_length_x, p.cells_per_length_y, p.cells_per_length_z, glm::dvec3(unit) / spacing);
  p.step = static_cast<float>(o.step);
  p.inverse_step = 1 / p.step;
  p.length_unit = static_cast<float>(unit);
  p.table_lo = table.lo;
  p.table_scale = table.scale;
  p.table_size = table.size;
  p.termination = static_cast<float>(o.termination);
  // Below 1/32 of the range per base cell a gradient is mostly noise in reconstructions from few views.
  p.gradient_full = (v.value_range.second - v.value_range.first) / 32;
  p.slack = slack;
  for (std::size_t c = 0; c < 3; ++c) {
    p.background_top[c] = static_cast<float>(o.background_top[c]);
    p.background_bottom[c] = static_cast<float>(o.background_bottom[c]);
  }
  p.width = static_cast<int>(o.width);
  p.height = static_cast<int>(o.height);
  p.shading = o.shading ? 1 : 0;
  p.skip = o.skip_empty ? 1 : 0;
  set_surfaces(p, o.surfaces);
  set_lights(p, o);
  return p;
}

VdvrSlice make_slice(const Impl& v, const RenderOptions& o) {
  const Grid& g = v.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  const std::size_t across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
  const auto side = [&](std::size_t a) { return static_cast<double>(g.cells[a]) * g.spacing[a]; };
  const double lo = g.origin[axis], hi = lo + side(axis), at = o.slice_position.value_or((lo + hi) / 2);
  if (!(at >= lo && at <= hi))
    throw InputError(
        fmt::format("`slice_position` {} lies outside the grid, {} to {} along {}", at, lo, hi, "xyz"[axis]));
  // One square pixel size for both axes; the slice is centred in the picture.
  const double pixel =
      std::max(side(across) / static_cast<double>(o.width), side(down) / static_cast<double>(o.height));
  const auto first = [&](std::size_t a, std::int64_t pixels) {
    return static_cast<float>((side(a) / 2 + (0.5 - static_cast<double>(pixels) / 2) * pixel) / g.spacing[a]);
  };
  VdvrSlice s{};
  s.first[axis] =
      static_cast<float>(std::clamp((at - lo) / g.spacing[axis], 0.0, static_cast<double>(g.cells[axis])));
  s.first[across] = first(across, o.width);
  s.first[down] = first(down, o.height);
  s.step_across = static_cast<float>(pixel / g.spacing[across]);
  s.step_down = static_cast<float>(pixel / g.spacing[down]);
  s.across = static_cast<int>(across);
  s.down = static_cast<int>(down);
  const auto range =
      o.slice_range.value_or(std::pair<double, double>(v.value_range.first, v.value_range.second));
  s.window_lo = static_cast<float>(range.first);
  // A volume of one value is shown black: 0 times a scale.
  s.window_scale = range.second > range.first ? static_cast<float>(1 / (range.second - range.first)) : 0.0f;
  s.width = static_cast<int>(o.width);
  s.height = static_cast<int>(o.height);
  return s;
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
float range_slack(Device& device, const Impl& v, SamplerKind sampler) {
  const double magnitude = std::max(std::abs(v.value_range.first), std::abs(v.value_range.second));
  double slack = 0x1p-20 * magnitude;
  if (sampler == SamplerKind::image3d)
    slack += (2 * probe_sampler(device).largest_constant_error() + 0x1p-20) * static_cast<double>(v.largest);
  return static_cast<float>(slack);
}

// Packets address samples and records by 32-bit numbers.
int lanes_for(const Impl& v, SamplerKind sampler, GradientKind gradient, const RaycastTuning& tuning) {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  if (sampler == SamplerKind::image3d || v.field->samples.size() > most || v.field->bricks.size() > most)
    return 1;
  // Lit samples come in wide loads, of which twice as many keep the shuffles busy.
  return tuning.lanes.value_or(!v.state->info.is_cpu ? 1 : gradient == GradientKind::stored ? 16 : 8);
}

GradientKind choose_gradient(const Impl& v, const RenderOptions& o, SamplerKind sampler) {
  const bool needed = o.output == RenderOutput::normal || (o.shading && o.output == RenderOutput::colour);
  if (o.gradient == GradientKind::automatic)
    return o.mode == RenderMode::dvr && needed && sampler == SamplerKind::buffer && v.lit_fits()
               ? GradientKind::stored
               : GradientKind::central;
  if (o.gradient == GradientKind::stored && sampler == SamplerKind::image3d)
    throw InputError("`gradient` stored: the image3d sampler has none; use `sampler` buffer");
  return o.gradient;
}

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
    default:
      break;
  }
  if (o.classification == Classification::preintegrated)
    return {"raycast_preintegrated", "VDVR_KERNEL_PREINTEGRATED"};
  if (o.step_mode == StepMode::level) return {"raycast_level", "VDVR_KERNEL_LEVEL"};
  return {"raycast_dvr", "VDVR_KERNEL_DVR"};
}

opencl::Defines defines_for(const Impl& v, const RenderOptions& o, SamplerKind sampler, GradientKind gradient,
                            const RaycastTuning& tuning, int lanes) {
  const bool lit = gradient == GradientKind::stored;
  const bool uniform = lit ? v.lit_layout.is_uniform() : v.is_uniform;
  opencl::Defines defines = coarse_defines(v.field->grid);
  const auto add = [&](const opencl::Defines& more) {
    defines.insert(defines.end(), more.begin(), more.end());
  };
  add({
      {"VDVR_KERNEL", kernel_of(o).number},
      {"VDVR_GRANULARITY", std::to_string(v.field->grid.granularity)},
      {sampler == SamplerKind::image3d ? "VDVR_SAMPLER_IMAGE3D" : "VDVR_SAMPLER_BUFFER", "1"},
      {"VDVR_GROUP_X", std::to_string(tuning.group_x)},
      {"VDVR_GROUP_Y", std::to_string(tuning.group_y)},
      {"VDVR_GEOMETRY", o.output == RenderOutput::colour ? "0" : "1"},
      {"VDVR_BOUNDS", o.output == RenderOutput::error ? "1" : "0"},
      {"VDVR_GRADIENT_ANALYTIC", gradient == GradientKind::analytic ? "1" : "0"},
      {"VDVR_LIT", lit ? "1" : "0"},
      {"VDVR_FIXED_LIGHTS", o.lights.empty() && o.head_light ? "0" : "1"},
      {"VDVR_LANES", std::to_string(lanes)},
      {"VDVR_UNIFORM", uniform && lanes > 1 ? "1" : "0"},
  });
  if (lit) add({{"VDVR_SAMPLE_TYPES", "1"}});
  else add(sampler == SamplerKind::image3d ? v.atlas_defines() : v.field->defines);
  return defines;
}

void prepare_frame(Impl& v, const RenderOptions& o, const BakedTransfer& table) {
  auto& f = v.frame;
  const auto pixels = static_cast<std::uint64_t>(o.width * o.height),
             rows = static_cast<std::uint64_t>(o.height);
  if (f.picture.size() != pixels) {
    f.picture = {};  // first give back what is held
    f.picture = DeviceArray<cl_float4>(*v.state, pixels, "picture");
  }
  if (f.row_samples.size() != rows) f.row_samples = DeviceArray<cl_uint>(*v.state, rows, "samples per row");
  f.row_samples.fill(0);
  if (table.rows.empty()) return;
  if (f.table.size() != table.rows.size()) {
    f.table = {};
    f.table = DeviceArray<cl_float4>(*v.state, table.rows.size(), "transfer function");
  }
  f.table.write(table.rows);
}

// Tables are kept: a turntable bakes once.
const BakedTransfer& baked(Impl& v, const RenderOptions& o) {
  const bool dvr = o.mode == RenderMode::dvr;
  const bool square = dvr && o.classification == Classification::preintegrated;
  const int levels = dvr && o.step_mode == StepMode::level ? v.highest_level + 1 : 1;
  std::vector<double> key{square ? 1.0 : 0.0, static_cast<double>(levels), o.step};
  for (const TransferPoint& p : o.transfer.points)
    key.insert(key.end(), {p.value, p.rgb[0], p.rgb[1], p.rgb[2], p.opacity});
  if (key != v.frame.table_key) {
    v.frame.baked =
        square ? bake_preintegrated(o.transfer, o.step, v.value_range) : bake(o.transfer, o.step, levels);
    v.frame.table_key = std::move(key);
  }
  return v.frame.baked;
}

opencl::Range packet_range(const RenderOptions& o, const RaycastTuning& tuning, int lanes) {
  // Pixels of one packet (shared/packet.h).
  const int packet_x = lanes == 1 ? 1 : lanes == 4 ? 2 : 4, packet_y = lanes / packet_x;
  const auto packets = [](std::int64_t pixels, int packet) {
    return static_cast<std::uint64_t>((pixels + packet - 1) / packet);
  };
  return {{packets(o.width, packet_x), packets(o.height, packet_y), 1},
          {packets(tuning.group_x, packet_x), packets(tuning.group_y, packet_y), 1}};
}

// `field`: the sample buffer, or the three images of the atlas; `bricks` the records that go with it.
template <class... Field>
void launch(Impl& v, const RenderOptions& o, const opencl::Defines& defines, const RaycastTuning& tuning,
            int lanes, const BakedTransfer& table, float slack, const VdvrGrid& grid,
            const cl::Buffer& bricks, const Field&... field) {
  const opencl::Range range = packet_range(o, tuning, lanes);
  const auto& picture = v.frame.picture.buffer();
  if (o.mode == RenderMode::slice) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, VdvrSlice, cl::Buffer, cl::Buffer> kernel(
        *v.state, "render/raycast", kernel_of(o).name, defines);
    kernel(range, field..., bricks, grid, make_slice(v, o), picture, v.frame.row_samples.buffer());
    return;
  }
  // dvr and iso leap by distances, mip by the bricks' maxima.
  const cl::Buffer& guide = o.mode == RenderMode::mip ? v.ranges() : v.frame.distance.buffer();
  const auto draw = [&](const auto&... bounds) {
    opencl::Kernel<Field..., cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrRaycast, cl::Buffer,
                   cl::Buffer, std::remove_cvref_t<decltype(bounds)>...>
        kernel(*v.state, "render/raycast", kernel_of(o).name, defines);
    kernel(range, field..., bricks, grid, guide, v.frame.table.buffer(), make_params(v, o, table, slack),
           picture, v.frame.row_samples.buffer(), bounds...);
  };
  if (o.output == RenderOutput::error) draw(v.bounds.buffer());
  else draw();
}

std::uint8_t to_byte(float x) {
  // NaN becomes 0.
  return static_cast<std::uint8_t>(x > 0.0f ? std::min(x, 1.0f) * 255.0f + 0.5f : 0.0f);
}

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

using Pixels = std::span<const cl_float4>;

FloatImage values_of(Pixels pixels, const RenderOptions& o) {
  FloatImage image{o.width, o.height, {}, o.output == RenderOutput::normal ? 3 : 1};
  image.values.resize(pixels.size() * static_cast<std::size_t>(image.channels));
  float* to = image.values.data();
  for (const cl_float4& p : pixels) {
    if (image.channels == 3) {
      for (std::size_t c = 0; c < 3; ++c) *to++ = p.s[c];
      continue;
    }
    const bool missed = o.output == RenderOutput::error ? p.s[3] < 0
                        : o.mode == RenderMode::iso     ? p.s[3] < 0
                        : o.mode == RenderMode::mip     ? !std::isfinite(p.s[3])
                                                        : false;
    *to++ = missed ? kNothing : p.s[3];
  }
  return image;
}

Image coloured(Pixels pixels, const RenderOptions& o) {
  Image image{o.width, o.height, std::vector<std::uint8_t>(3 * pixels.size())};
  std::uint8_t* to = image.rgb.data();
  for (const cl_float4& p : pixels)
    for (std::size_t c = 0; c < 3; ++c) *to++ = to_byte(p.s[c]);
  return image;
}

// Depths from white, nearest, to dark grey; normals with 0 as middle grey; nothing black.
Image shown(const FloatImage& values) {
  Image image{values.width, values.height,
              std::vector<std::uint8_t>(static_cast<std::size_t>(3 * values.width * values.height))};
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  for (const float x : values.values) {
    if (!std::isfinite(x)) continue;
    lo = std::min(lo, x);
    hi = std::max(hi, x);
  }
  const float scale = hi > lo ? 0.85f / (hi - lo) : 0.0f;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = to_byte(values.channels == 3 ? 0.5f + 0.5f * values.values[i]
                                                : 1.0f - (values.values[i / 3] - lo) * scale);
  return image;
}

// Values and picture.
void convert(Pixels pixels, const RenderOptions& o, RenderResult& r) {
  r.values = values_of(pixels, o);
  r.image = o.output == RenderOutput::colour ? coloured(pixels, o) : shown(r.values);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::int64_t samples_of(const Impl& v) {
  std::int64_t samples = 0;
  for (const cl_uint n : v.frame.row_samples.to_host()) samples += n;
  return samples;
}

/// Enqueues a frame; what it will be, without pixels.
struct Enqueued {
  FloatPicture picture;
  std::chrono::steady_clock::time_point start;
};
Enqueued enqueue_frame(Device& device, const ResidentVolume& volume, const RenderOptions& o,
                       const RaycastTuning& tuning) {
  check_options(o);
  Impl& v = volume.impl();
  if (o.output == RenderOutput::error && v.bounds.size() == 0)
    throw InputError("`show` error: the volume has no bounds by brick");
  FloatPicture result;
  std::tie(result.sampler, result.sampler_reason) = choose_sampler(device, volume, o.sampler);
  const float slack = range_slack(device, v, result.sampler);
  const bool sliced = o.mode == RenderMode::slice;
  const BakedTransfer none;
  const BakedTransfer& table = sliced ? none : baked(v, o);
  prepare_frame(v, o, table);
  if (!sliced && o.mode != RenderMode::mip) update_distance(v, o, table, slack);

  result.gradient = choose_gradient(v, o, result.sampler);
  const int lanes = lanes_for(v, result.sampler, result.gradient, tuning);
  const auto defines = defines_for(v, o, result.sampler, result.gradient, tuning, lanes);
  const bool image = result.sampler == SamplerKind::image3d, lit = result.gradient == GradientKind::stored;
  if (image) v.atlas();
  if (lit) v.lit();
  opencl::finish(*v.state, "preparing a frame");
  const auto start = std::chrono::steady_clock::now();
  const auto draw = [&](const VdvrGrid& grid, const cl::Buffer& bricks, const auto&... field) {
    launch(v, o, defines, tuning, lanes, table, slack, grid, bricks, field...);
  };
  if (image) draw(v.field->grid, v.atlas_bricks(), v.atlas()[0], v.atlas()[1], v.atlas()[2]);
  else if (lit) draw(v.lit().grid(), v.lit().bricks(), v.lit().samples());
  else draw(v.field->grid, v.field->bricks.buffer(), v.field->samples.buffer());
  return {std::move(result), start};
}

}  // namespace

FloatPicture raycast_float(Device& device, const ResidentVolume& volume, const RenderOptions& o,
                           const RaycastTuning& tuning) {
  Enqueued frame = enqueue_frame(device, volume, o, tuning);
  read_frame(volume.impl(), frame.start, frame.picture);
  return std::move(frame.picture);
}

DvrFrame prepare_dvr(Impl& v, const RenderOptions& o, const RaycastTuning& tuning, int lanes) {
  check_options(o);
  const BakedTransfer& table = baked(v, o);
  prepare_frame(v, o, table);
  update_distance(v, o, table, 0);
  return {packet_range(o, tuning, lanes), make_params(v, o, table, 0)};
}

void read_frame(Impl& v, std::chrono::steady_clock::time_point start, FloatPicture& picture) {
  picture.pixels = v.frame.picture.to_host();
  picture.seconds = seconds_since(start);
  picture.samples = samples_of(v);
}

// As to_result(raycast_float()), but converts the pixels where they lie: a copy of them would be a tenth of a
// fast frame.
RenderResult raycast(Device& device, const ResidentVolume& volume, const RenderOptions& options) {
  Enqueued frame = enqueue_frame(device, volume, options, {});
  Impl& v = volume.impl();
  RenderResult r;
  r.sampler = frame.picture.sampler;
  r.sampler_reason = std::move(frame.picture.sampler_reason);
  r.gradient = frame.picture.gradient;
  v.frame.picture.read_mapped([&](Pixels pixels) {
    r.seconds = seconds_since(frame.start);
    convert(pixels, options, r);
  });
  r.samples = samples_of(v);
  return r;
}

RenderResult to_result(FloatPicture picture, const RenderOptions& options) {
  RenderResult r;
  r.sampler = picture.sampler;
  r.sampler_reason = std::move(picture.sampler_reason);
  r.gradient = picture.gradient;
  r.samples = picture.samples;
  r.seconds = picture.seconds;
  convert(picture.pixels, options, r);
  return r;
}

}  // namespace vdvr
