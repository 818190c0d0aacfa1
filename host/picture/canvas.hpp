// Pixels, rectangles and smooth lines on a picture.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>

#include "vdvr/expert/image.hpp"

namespace vdvr {

using Colour = std::array<std::uint8_t, 3>;

/// Dark to light with rising luminance, so that it reads in print too.
inline constexpr std::array<std::array<double, 3>, 5> kErrorStops{
    {{0, 0, 8}, {80, 18, 120}, {190, 55, 85}, {248, 142, 10}, {252, 255, 165}}};

/// Between stops that lie evenly from 0 to 1.
template <std::size_t N>
Colour between_stops(const std::array<std::array<double, 3>, N>& stops, double fraction) {
  const double x = std::clamp(fraction, 0.0, 1.0) * (N - 1);
  const auto i = std::min<std::size_t>(N - 2, static_cast<std::size_t>(x));
  const double t = x - static_cast<double>(i);
  Colour c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = static_cast<std::uint8_t>(std::lround((1 - t) * stops[i][k] + t * stops[i + 1][k]));
  return c;
}

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
