// A picture and the intervals of its pixels: drawn so finely that little of its bound is the drawing's.
// Called by: certify_render.
#pragma once

#include <optional>

#include "apps/vdvr/source.hpp"

namespace vdvr::cli {

/// What was drawn and what is proved of it: of a slice the picture without its frame.
struct CertifiedDrawing {
  RenderResult drawn;
  PixelBounds bounds;
};
struct Asked {
  CertifyPictureOptions certify;
  std::optional<Clip> known;        ///< where F is, of pictures under its own light
  std::optional<double> tolerance;  ///< levels, of the worst pixel
};

/// The user said how to step along rays.
bool chose_steps(const Arguments& args);
/// Classification and steps that suit a certified picture, unless they were chosen; rays end at 1 - theta.
void prepare_drawing(const Arguments& args, RenderOptions& options, double theta);
CertifiedDrawing draw_and_certify(Source& source, const RenderOptions& options, const Asked& asked,
                                  const Progress& progress);
/// Draws with half the step as long as the picture is much of its bound and that helps; `options` then say
/// what was drawn. Intervals of light as drawn depend on the step and are made each time.
void draw_finer(Source& source, RenderOptions& options, const Asked& asked, CertifiedDrawing& made,
                const Progress& progress);

}  // namespace vdvr::cli
