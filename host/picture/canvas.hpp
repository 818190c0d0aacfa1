// Pixels, rectangles and smooth lines on a picture.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>

#include "vdvr/expert/image.hpp"

namespace vdvr {

using Colour = std::array<std::uint8_t, 3>;

Image blank(std::int64_t width, std::int64_t height, const Colour& colour);

/// What falls outside the image is left out. `part`: of the colour, 0 to 1, mixed with what is there.
void blend(Image& image, std::int64_t x, std::int64_t y, const Colour& c, double part);
void fill(Image& image, std::int64_t x, std::int64_t y, std::int64_t w, std::int64_t h, const Colour& c,
          double part = 1);
/// A frame one pixel wide, whose outer size is w x h.
void frame(Image& image, std::int64_t x, std::int64_t y, std::int64_t w, std::int64_t h, const Colour& c);
/// A smooth line of `width` pixels; `part(x, y)` scales its opacity.
void draw_line(Image& image, glm::dvec2 a, glm::dvec2 b, double width, const Colour& c,
               const std::function<double(std::int64_t, std::int64_t)>& part);
/// `source` with its top left corner at (x, y).
void paste(Image& image, std::int64_t x, std::int64_t y, const Image& source);

}  // namespace vdvr
