// Text in pictures: DejaVu Sans, anti-aliased, kerned, placed to a quarter of a pixel. The same bits on every
// machine: the font lies in the library.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "vdvr/expert/image.hpp"

namespace vdvr {

/// Sizes are of the font's em, in pixels; texts are UTF-8. What is no UTF-8 is drawn as U+FFFD, a character
/// that the font lacks as a box, a line feed as a space.

/// Of text over a picture: it grows with the picture, and stays legible in a small one.
double text_size(const Image& image);

double text_width(std::string_view text, double size);
/// Of capitals and digits.
double cap_height(double size);
/// From one base line to the next.
double line_height(double size);

/// Writes `text` with its left edge at x and the top of its capitals at `top`; what falls outside the image
/// is left out. Colours are mixed in linear light.
void draw_text(Image& image, double x, double top, std::string_view text, double size,
               const std::array<std::uint8_t, 3>& colour);
/// From the bottom to the top: the text's left edge is at y `bottom`, the top of its capitals at x `left`.
void draw_text_upwards(Image& image, double left, double bottom, std::string_view text, double size,
                       const std::array<std::uint8_t, 3>& colour);

/// The text, or as much of it as is not wider than `width` with an ellipsis behind it.
std::string fitted(const std::string& text, double width, double size);
/// Paragraphs in lines of at most `width` pixels; a longer word is fitted into a line of its own.
std::vector<std::string> wrapped(const std::vector<std::string>& paragraphs, double width, double size);

}  // namespace vdvr
