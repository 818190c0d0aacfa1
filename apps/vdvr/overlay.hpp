// What `render` draws over a picture when asked, --axes, --box, --colorbar, --caption, and around a slice.
#pragma once

#include "apps/vdvr/source.hpp"
#include "vdvr/expert/slice_frame.hpp"

namespace vdvr::cli {

struct Overlay {
  bool axes = false, box = false, colour_bar = false, caption = false;
  bool plain = false;  ///< a slice without its frame
  [[nodiscard]] bool any() const { return axes || box || colour_bar || caption; }
};
void add_overlay(Arguments& args);
/// Throws InputError for what a mode has not: slices have no camera, iso-surfaces no transfer function.
Overlay overlay_options(const Arguments& args, RenderMode mode);

/// The frame around a slice of what `options` say, which have a position and a window; `certificate`: of what
/// is drawn, if any.
SliceFrame frame_of_slice(const RenderOptions& options, const Grid& grid,
                          const std::optional<Certificate>& certificate);

/// Over a picture that was drawn with `options`. `caption` stands in place of the certificate's own.
void draw_overlay(RenderResult& result, const Scene& scene, const RenderOptions& options,
                  const Overlay& overlay, bool certified, const std::vector<std::string>& caption);

/// Renders, and draws what was asked for over the picture.
RenderResult render_with_overlay(Source& source, const RenderOptions& options, const Overlay& overlay,
                                 bool certified);

}  // namespace vdvr::cli
