// What can be drawn over a picture: the grid's box, axes, a colour bar, a caption. Drawn on the host with the
// picture's own camera.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Edges that no face of the box hides lie in front of the volume and are drawn over it; the others lie
/// behind all of it and show through where `hidden` [y][x] (1: nothing shows) is below 1.
VDVR_API void draw_box(Image& image, const Camera& camera, const Grid& grid,
                       const std::vector<float>& hidden);

/// Directions of x (red), y (green), z (blue) in the bottom left corner, `above` pixels from the bottom.
VDVR_API void draw_axes(Image& image, const Camera& camera, std::int64_t above);

/// Colours by value from the lowest at the bottom, with the opacity as a line across the bar. `unit` may be
/// empty. Right edge, `above` pixels free at the bottom.
struct ColourBar {
  std::vector<TransferPoint> points;  ///< in order, two at least
  bool opacity = true;
  std::string unit;
};
VDVR_API void draw_colour_bar(Image& image, const ColourBar& bar, std::int64_t above);

/// Lines wrapped to the width on a darkened band at the bottom, in small letters where large ones would hide
/// more than an eighth of the picture; returns the band's height.
VDVR_API std::int64_t draw_caption(Image& image, const std::vector<std::string>& paragraphs);

}  // namespace vdvr
