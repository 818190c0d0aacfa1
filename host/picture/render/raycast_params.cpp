// Cameras, lights, surfaces and slices in the units of the kernels: cells, and lengths of the smallest
// spacing.
#include "host/picture/render/raycast_params.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <tuple>

#include "host/picture/render/glm_vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrRaycast) == 464 && sizeof(VdvrSlice) == 52);

namespace {

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

// Faces of the grid stay where they are. Others move inward by more than what fp32 makes of positions on a
// ray: those are sums of the eye's and of a product that is no longer than eye and grid together.
void set_clip(VdvrRaycast& p, const Grid& g, const std::optional<Clip>& clip) {
  const std::array<float, 3> eye{p.eye_x, p.eye_y, p.eye_z};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto cells = static_cast<double>(g.cells[a]);
    p.clip_low[a] = 0;
    p.clip_high[a] = static_cast<float>(cells);
    if (!clip) continue;
    const double inward = 0x1p-20 * (2 * std::abs(static_cast<double>(eye[a])) + cells);
    const double low = (clip->low[a] - g.origin[a]) / g.spacing[a],
                 high = (clip->high[a] - g.origin[a]) / g.spacing[a];
    if (low > 0) p.clip_low[a] = static_cast<float>(std::min(low + inward, cells + 1));
    if (high < cells) p.clip_high[a] = static_cast<float>(std::max(high - inward, -1.0));
    // Faces in the wrong order would be a box again: beside the grid there is none.
    p.clip_low[a] = std::min(p.clip_low[a], p.clip_high[a]);
  }
  if (!clip || !std::isfinite(clip->radius)) return;
  p.cylinder_x = static_cast<float>((clip->axis[0] - g.origin[0]) / g.spacing[0]);
  p.cylinder_y = static_cast<float>((clip->axis[1] - g.origin[1]) / g.spacing[1]);
  p.cylinder_per_x = static_cast<float>(g.spacing[0] / clip->radius);
  p.cylinder_per_y = static_cast<float>(g.spacing[1] / clip->radius);
}

}  // namespace

VdvrRaycast make_params(const DrawnField& v, const RenderOptions& o, const BakedTransfer& table,
                        float slack) {
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
  std::tie(p.shown_from, p.shown_to) = table.shown_places();
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
  set_clip(p, v.grid, o.clip);
  return p;
}

VdvrSlice make_slice(const DrawnField& v, const RenderOptions& o) {
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

}  // namespace vdvr
