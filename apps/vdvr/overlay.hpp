// What `render` draws over a picture when asked: --axes, --box, --colorbar, --caption.
#pragma once

#include "apps/vdvr/source.hpp"

namespace vdvr::cli {

struct Overlay {
  bool axes = false, box = false, colour_bar = false, caption = false;
  [[nodiscard]] bool any() const { return axes || box || colour_bar || caption; }
};
void add_overlay(Arguments& args);
/// Throws InputError for what a mode has not: slices have no camera, iso-surfaces no transfer function.
Overlay overlay_options(const Arguments& args, RenderMode mode);

/// Renders, and draws what was asked for over the picture.
RenderResult render_with_overlay(Source& source, const RenderOptions& options, const Overlay& overlay,
                                 bool certified);

}  // namespace vdvr::cli
