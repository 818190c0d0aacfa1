#include "host/picture/render/check_render_options.hpp"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "host/picture/render/glm_vectors.hpp"
#include "shared/raycast_params.h"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

void check_transfer(const TransferFunction& f) {
  if (f.points.empty()) throw InputError(fmt::format("transfer function '{}' has no points", f.name));
  for (std::size_t i = 0; i < f.points.size(); ++i) {
    const auto& p = f.points[i];
    if (!std::isfinite(p.value) || !(p.opacity >= 0 && p.opacity <= 1) || !is_finite(p.rgb) ||
        (i > 0 && p.value < f.points[i - 1].value))
      throw InputError(
          fmt::format("transfer function '{}', point {}: value {} and opacity {} must be finite, in order, "
                      "and opacity within [0, 1]",
                      f.name, i, p.value, p.opacity));
  }
}

void check_surfaces(const std::vector<IsoSurface>& surfaces) {
  if (surfaces.empty() || surfaces.size() > VDVR_SURFACES)
    throw InputError(
        fmt::format("`iso` names {} surfaces; 1 to {} can be drawn", surfaces.size(), VDVR_SURFACES));
  for (const IsoSurface& s : surfaces)
    if (!std::isfinite(s.value) || !(s.opacity >= 0 && s.opacity <= 1) || !is_finite(s.rgb))
      throw InputError(
          fmt::format("`iso` {} must be finite, and its opacity {} within [0, 1]", s.value, s.opacity));
}

void check_lights(const std::vector<Vec3>& lights) {
  if (lights.size() > VDVR_LIGHTS)
    throw InputError(
        fmt::format("`light` names {} lights that stand still; at most {} do", lights.size(), VDVR_LIGHTS));
  for (const Vec3& l : lights)
    if (!is_finite(l) || !(glm::length(to_glm(l)) > 0))
      throw InputError(fmt::format("`light` {},{},{} has no direction", l[0], l[1], l[2]));
}

void check_window(const RenderOptions& o) {
  if (o.slice_range && !(std::isfinite(o.slice_range->first) && std::isfinite(o.slice_range->second) &&
                         o.slice_range->first <= o.slice_range->second))
    throw InputError(fmt::format("the grey window {},{} must be finite and in order", o.slice_range->first,
                                 o.slice_range->second));
}

void check_clip(const Clip& c) {
  for (std::size_t a = 0; a < 3; ++a)
    if (!(c.low[a] < c.high[a]))
      throw InputError(fmt::format("`clip` {} is not below {} along {}", c.low[a], c.high[a], "xyz"[a]));
  if (!(c.radius > 0) || !std::isfinite(c.axis[0]) || !std::isfinite(c.axis[1]))
    throw InputError(fmt::format("`clip` needs a radius above 0 and a finite axis, not {} about {},{}",
                                 c.radius, c.axis[0], c.axis[1]));
}

}  // namespace

void check_options(const RenderOptions& o) {
  // Pixels are counted in int on the device; 16384 x 16384 already needs 4 GiB there.
  if (o.width < 1 || o.height < 1 || o.width > 16384 || o.height > 16384)
    throw InputError(fmt::format("`size` {}x{}: each side must be 1 to 16384 pixels", o.width, o.height));
  if (o.mode == RenderMode::error)
    throw InputError("an error slice is not ray-cast: it is drawn by error_slice");
  if (o.mode == RenderMode::slice) {
    if (o.output != RenderOutput::colour)
      throw InputError("`show` depth, normal and error do not apply to a slice, which has no camera");
    if (o.slice_axis < 0 || o.slice_axis > 2)
      throw InputError(fmt::format("slice axis {} is not 0 (x), 1 (y) or 2 (z)", o.slice_axis));
    check_window(o);
    return;
  }
  check_camera(o.camera);
  if (o.clip) check_clip(*o.clip);
  if (!(o.step >= 0x1p-10 && o.step <= 1024))
    throw InputError(fmt::format("`step` {} must lie between 1/1024 and 1024 base cells", o.step));
  if (!(o.termination > 0 && o.termination <= 1))
    throw InputError(fmt::format("termination opacity {} must lie in (0, 1]", o.termination));
  if (o.mode == RenderMode::iso) check_surfaces(o.surfaces);
  check_lights(o.lights);
  // Adaptive steps are a default, which the other modes have no use for.
  if (o.mode != RenderMode::dvr &&
      (o.classification != Classification::post || o.step_mode == StepMode::level))
    throw InputError("`classification` and `step_mode` apply to `mode` dvr");
  if (o.classification == Classification::preintegrated && o.step_mode != StepMode::fixed)
    throw InputError(
        "`step_mode` level or adaptive does not apply to `classification` preintegrated, whose table is of "
        "one step");
  if (o.mode == RenderMode::mip && o.output == RenderOutput::normal)
    throw InputError("`show` normal does not apply to `mode` mip: a maximum has no surface");
  if (o.mode == RenderMode::integral) {
    if (o.output != RenderOutput::colour)
      throw InputError("`show` depth, normal and error do not apply to `mode` integral: it is of whole rays");
    check_window(o);
  }
  const bool needs_transfer = o.mode == RenderMode::dvr || o.mode == RenderMode::mip;
  if (needs_transfer || !o.transfer.points.empty()) check_transfer(o.transfer);
}

}  // namespace vdvr
