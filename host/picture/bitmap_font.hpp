// A 5 x 7 bitmap font for captions: digits, letters, the usual signs. Called by error_slice.cpp, figure.cpp
// and decorate.cpp.
#pragma once

#include <array>
#include <string>

#include "vdvr/image.hpp"

namespace vdvr {

/// Height of a line of text in pixels at scale 1, and width of one character with its gap.
inline constexpr int kFontHeight = 7, kFontAdvance = 6;

/// Writes `text` with its top left corner at (x, y); what falls outside the image is clipped. Characters
/// without a glyph leave a gap.
void draw_text(Image& image, std::int64_t x, std::int64_t y, const std::string& text, int scale,
               const std::array<std::uint8_t, 3>& colour);

}  // namespace vdvr
