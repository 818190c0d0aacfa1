#include "apps/vdvr/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "vdvr/automatic_view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/decorate.hpp"
#include "vdvr/expert/error_slice.hpp"

namespace vdvr::cli {
namespace {

/// How much of what lies behind the volume is hidden, [y][x].
std::vector<float> hidden_part(RenderMode mode, const FloatImage& values) {
  std::vector<float> hidden;
  hidden.reserve(values.values.size());
  for (const float v : values.values) {
    // A maximum hides nothing, nor does an integral; where an iso-surface was hit its depth is a number.
    if (mode == RenderMode::dvr) hidden.push_back(v);
    else hidden.push_back(mode == RenderMode::iso && v == v ? 1.0f : 0.0f);
  }
  return hidden;
}

ColourBar colour_bar(const RenderOptions& o, const Scene& scene, bool certified, const FloatImage& values) {
  ColourBar bar;
  if (o.mode == RenderMode::integral) {
    // A line integral has no unit.
    const auto [lo, hi] = o.slice_range.value_or(range_of_values(values));
    bar.points = {{lo, {0, 0, 0}, 1}, {hi, {1, 1, 1}, 1}};
    bar.opacity = false;
    return bar;
  }
  if (o.mode == RenderMode::slice) {
    const auto [lo, hi] = o.slice_range.value_or(std::pair{0.0, 1.0});
    bar.points = {{lo, {0, 0, 0}, 1}, {hi, {1, 1, 1}, 1}};
  } else {
    bar.points = o.transfer.points;
  }
  bar.opacity = o.mode == RenderMode::dvr;
  // Line integrals have no unit, so a certified density has one over length; of other volumes it is unknown.
  if (certified) bar.unit = scene.volume.grid.unit + "⁻¹";
  return bar;
}

std::vector<std::string> caption_lines(const RenderOptions& o, const Grid& grid,
                                       const std::optional<Certificate>& certificate) {
  if (!certificate) return {"No certificate", outside_certificate(o)};
  return {fmt::format("|V − F| ≤ {:.4g} {}⁻¹ ({:.3g} % of the range) at every covered point",
                      certificate->epsilon_abs, grid.unit, 100 * certificate->epsilon),
          "Not certified: " + outside_certificate(o)};
}

/// The base samples alone, or what was not verified, are another field than the one certified.
std::optional<Certificate> certificate_of(const Scene& scene, bool certified) {
  return certified ? scene.certificate : std::nullopt;
}

RenderResult draw_framed(Source& source, RenderOptions o, bool certified) {
  const Scene& scene = source.scene();
  const SliceFrame frame = frame_of_slice(o, scene.volume.grid, certificate_of(scene, certified));
  const std::int64_t width = o.width, height = o.height;
  const SlicePlace place = slice_place(frame, width, height);
  o.width = place.width;
  o.height = place.height;
  RenderResult r = source.draw(o);
  r.image = framed_slice(frame, r.image, width, height);
  return r;
}

}  // namespace

void add_overlay(Arguments& args) {
  args.group("Drawn over the picture")
      .flag("axes", "directions of x, y and z, bottom left")
      .flag("box", "edges of the grid: those in front over the volume, those behind show through it")
      .flag("colorbar", "colours by density, with the opacity as a line across")
      .flag("caption", "what is certified, and what lies outside the certificate")
      .flag("plain", "a slice alone, without axes, scale bar, colour bar and caption");
}

Overlay overlay_options(const Arguments& args, RenderMode mode) {
  Overlay o{args.has("axes"), args.has("box"), args.has("colorbar"), args.has("caption"), args.has("plain")};
  if (mode == RenderMode::slice) refuse(args, {"axes", "box"}, "a slice has no camera");
  if (mode == RenderMode::iso) refuse(args, {"colorbar"}, "an iso-surface has no transfer function");
  if (mode != RenderMode::slice && mode != RenderMode::error)
    refuse(args, {"plain"}, "is of slices; other pictures are plain unless something is asked for");
  if (mode == RenderMode::error)
    refuse(args, {"axes", "box", "colorbar", "caption"}, "an error slice has its own caption");
  return o;
}

SliceFrame frame_of_slice(const RenderOptions& o, const Grid& grid,
                          const std::optional<Certificate>& certificate) {
  SliceFrame frame;
  frame.grid = grid;
  frame.axis = o.slice_axis;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  frame.position = o.slice_position.value_or(grid.origin[axis] + 0.5 * static_cast<double>(grid.cells[axis]) *
                                                                     grid.spacing[axis]);
  frame.colours = grey_window(o.slice_range.value_or(std::pair{0.0, 1.0}));
  if (certificate) frame.unit = grid.unit + "⁻¹";
  frame.caption = caption_lines(o, grid, certificate);
  return frame;
}

void draw_overlay(RenderResult& r, const Scene& scene, const RenderOptions& o, const Overlay& overlay,
                  bool certified, const std::vector<std::string>& caption) {
  if (!overlay.any()) return;
  const bool translucent =
      std::any_of(o.surfaces.begin(), o.surfaces.end(), [](const IsoSurface& s) { return s.opacity < 1; });
  if (overlay.box && o.mode == RenderMode::iso && translucent)
    throw InputError("--box: how far edges show through translucent surfaces is not known; leave it out");
  if (overlay.box) draw_box(r.image, o.camera, scene.volume.grid, hidden_part(o.mode, r.values));
  std::int64_t above = 0;
  if (overlay.caption) above = draw_caption(r.image, caption);
  if (overlay.colour_bar) draw_colour_bar(r.image, colour_bar(o, scene, certified, r.values), above);
  if (overlay.axes) draw_axes(r.image, o.camera, above);
}

RenderResult render_with_overlay(Source& source, const RenderOptions& o, const Overlay& overlay,
                                 bool certified) {
  const Scene& scene = source.scene();
  if (o.output == RenderOutput::error) {
    RenderOptions above_caption = o;
    above_caption.height -= kErrorCaption;
    if (o.width < 160 || above_caption.height < 16)
      throw InputError(fmt::format("--size {}x{}: an error picture needs at least 160x{} pixels", o.width,
                                   o.height, 16 + kErrorCaption));
    RenderResult r = source.draw(above_caption);
    r.image = bound_picture(r.values, source.shown().end, source.shown().quantity);
    return r;
  }
  if (o.mode == RenderMode::slice && !overlay.plain) return draw_framed(source, o, certified);
  RenderResult r = source.draw(o);
  draw_overlay(r, scene, o, overlay, certified,
               caption_lines(o, scene.volume.grid, certificate_of(scene, certified)));
  return r;
}

}  // namespace vdvr::cli
