#include "apps/vdvr/certified_drawing.hpp"

#include <algorithm>

#include "apps/vdvr/picture_light.hpp"
#include "vdvr/stop.hpp"

namespace vdvr::cli {
namespace {

constexpr double finest = 1.0 / 32;  // base cells

PixelBounds certified(Source& source, const RenderOptions& o, const Asked& asked, const Progress& progress) {
  throw_if_stopped();
  report(progress, "certify", 0);
  return asked.known ? certify_lit(source, *asked.known, o, asked.certify, progress)
                     : source.certify(o, asked.certify, progress);
}

RenderResult drawn(Source& source, const RenderOptions& o, const Progress& progress) {
  throw_if_stopped();
  report(progress, "draw", 0);
  return source.draw(o, progress);
}

/// Of pixels that show something, levels of 255.
struct Shown {
  double bound = 0, half_width = 0;  ///< means
  double worst = 0;
};
Shown shown_of(const PixelBounds& b, const Image& image) {
  const PictureBound bound = bound_of_picture(b, image);
  Shown shown;
  double pixels = 0;
  for (std::size_t i = 0; i < b.parts.size(); ++i) {
    if (b.parts[i] == 0) continue;
    double width = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      width = std::max(width, std::clamp(static_cast<double>(b.hi.values[c]), 0.0, 1.0) -
                                  std::clamp(static_cast<double>(b.lo.values[c]), 0.0, 1.0));
    shown.bound += static_cast<double>(bound.levels.values[i]);
    shown.half_width += 255 * width / 2;
    ++pixels;
  }
  shown.bound /= std::max(1.0, pixels);
  shown.half_width /= std::max(1.0, pixels);
  shown.worst = bound.max;
  return shown;
}

/// A byte rounds by half a level, a quarter of what F leaves open is hardly seen beside it, and where F
/// leaves open more than the drawing is ever off, nothing is to be gained.
bool is_much(const Shown& s, const std::optional<double>& tolerance) {
  constexpr double byte = 0.5, coarse_drawing = 8;  // levels
  return (s.half_width < coarse_drawing && s.bound - s.half_width > std::max(byte, s.half_width / 4)) ||
         (tolerance && s.worst > *tolerance);
}

bool is_better(const Shown& s, const Shown& before, const std::optional<double>& tolerance) {
  return s.bound < 0.9 * before.bound ||
         (tolerance && before.worst > *tolerance && s.worst < 0.95 * before.worst);
}

}  // namespace

bool chose_steps(const Arguments& args) {
  return args.has("step") || args.has("classification") || args.has("step-mode");
}

void prepare_drawing(const Arguments& args, RenderOptions& o, double theta) {
  if (!chose_steps(args)) {
    o.classification = Classification::preintegrated;
    o.step_mode = StepMode::fixed;  // a pre-integrated table is of one step
  }
  o.termination = 1 - theta;
  if (o.gradient == GradientKind::automatic) o.gradient = GradientKind::central;
}

CertifiedDrawing draw_and_certify(Source& source, const RenderOptions& o, const Asked& asked,
                                  const Progress& progress) {
  if (o.mode == RenderMode::slice) {
    CertifiedDrawing made{drawn(source, o, progress), {}};
    made.bounds = certify_slice(source.scene().volume, *source.scene().certificate, o, progress);
    clear_absent(made.drawn.image, made.bounds);
    return made;
  }
  // First what needs more memory: where it is too little, the error says how much would do for both.
  PixelBounds bounds = certified(source, o, asked, progress);
  return {drawn(source, o, progress), std::move(bounds)};
}

void draw_finer(Source& source, RenderOptions& o, const Asked& asked, CertifiedDrawing& made,
                const Progress& progress) {
  const bool as_drawn = made.bounds.light == CertifiedLight::as_drawn;
  Shown shown = shown_of(made.bounds, made.drawn.image);
  while (o.step > finest && is_much(shown, asked.tolerance)) {
    RenderOptions finer = o;
    finer.step = o.step / 2;
    CertifiedDrawing next{drawn(source, finer, progress), {}};
    if (as_drawn) next.bounds = certified(source, finer, asked, progress);
    next.drawn.seconds += made.drawn.seconds;
    next.bounds.seconds += made.bounds.seconds;
    const Shown next_shown = shown_of(as_drawn ? next.bounds : made.bounds, next.drawn.image);
    if (!is_better(next_shown, shown, asked.tolerance)) break;
    made.drawn = std::move(next.drawn);
    if (as_drawn) made.bounds = std::move(next.bounds);
    shown = next_shown;
    o.step = finer.step;
  }
}

}  // namespace vdvr::cli
