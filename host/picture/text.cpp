#include "host/picture/text.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>

#include "host/files/io/text_encoding.hpp"
#include "host/picture/embedded_font.hpp"
#include "vdvr/error.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wcast-align"
#pragma GCC diagnostic ignored "-Wnull-dereference"
#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>
#pragma GCC diagnostic pop

namespace vdvr {
namespace {

using Colour = std::array<std::uint8_t, 3>;

const stbtt_fontinfo& font() {
  static const stbtt_fontinfo info = [] {
    stbtt_fontinfo f{};
    const auto* bytes = reinterpret_cast<const unsigned char*>(embedded_font().data());
    if (stbtt_InitFont(&f, bytes, stbtt_GetFontOffsetForIndex(bytes, 0)) == 0)
      throw ResourceError("the font that was built into this library is not a TrueType font");
    return f;
  }();
  return info;
}

float scale_of(double size) { return stbtt_ScaleForMappingEmToPixels(&font(), static_cast<float>(size)); }

/// Code points; U+FFFD for each byte that is not part of a whole, shortest form.
std::vector<int> code_points(std::string_view text) {
  std::vector<int> points;
  while (!text.empty()) {
    const auto point = static_cast<int>(next_code_point(text).value_or(0xfffd));
    points.push_back(point < 0x20 ? ' ' : point);
  }
  return points;
}

struct Placed {
  int glyph = 0;
  double x = 0;  // of its origin
};
struct Line {
  std::vector<Placed> glyphs;
  double width = 0;
};

Line set(std::string_view text, double size) {
  const stbtt_fontinfo& f = font();
  const auto scale = static_cast<double>(scale_of(size));
  Line line;
  int before = 0;
  for (const int point : code_points(text)) {
    const int glyph = stbtt_FindGlyphIndex(&f, point);
    if (!line.glyphs.empty()) line.width += scale * stbtt_GetGlyphKernAdvance(&f, before, glyph);
    line.glyphs.push_back({glyph, line.width});
    int advance = 0, bearing = 0;
    stbtt_GetGlyphHMetrics(&f, glyph, &advance, &bearing);
    line.width += scale * advance;
    before = glyph;
  }
  return line;
}

/// How much of each pixel the letters cover, 0 to 255, of a text whose origin lies at (left, base) of it.
struct Ink {
  std::int64_t width = 0, height = 0;
  std::int64_t left = 0, base = 0;
  std::vector<std::uint8_t> part;
};

/// `fraction_x`, `fraction_y`: where in a pixel the origin lies.
Ink cover(const Line& line, double size, double fraction_x, double fraction_y) {
  const stbtt_fontinfo& f = font();
  const float scale = scale_of(size);
  Ink c;
  // Letters that reach beyond their em, on either side of the line.
  const auto room = static_cast<std::int64_t>(std::ceil(size)) + 2;
  c.left = room;
  c.base = 2 * room;
  c.width = static_cast<std::int64_t>(std::ceil(line.width)) + 2 * room;
  c.height = 3 * room;
  c.part.assign(static_cast<std::size_t>(c.width * c.height), 0);
  std::vector<unsigned char> bitmap;
  for (const Placed& placed : line.glyphs) {
    const double at = placed.x + fraction_x;
    // Quarters of a pixel, so that equal letters look equal more often.
    const double quarter = std::floor(at * 4) / 4, whole = std::floor(quarter);
    const auto shift = static_cast<float>(quarter - whole), down = static_cast<float>(fraction_y);
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    stbtt_GetGlyphBitmapBoxSubpixel(&f, placed.glyph, scale, scale, shift, down, &x0, &y0, &x1, &y1);
    const int w = x1 - x0, h = y1 - y0;
    if (w <= 0 || h <= 0) continue;
    bitmap.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0);
    stbtt_MakeGlyphBitmapSubpixel(&f, bitmap.data(), w, h, w, scale, scale, shift, down, placed.glyph);
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const std::int64_t to_x = c.left + static_cast<std::int64_t>(whole) + x0 + x, to_y = c.base + y0 + y;
        if (to_x < 0 || to_y < 0 || to_x >= c.width || to_y >= c.height) continue;
        auto& to = c.part[static_cast<std::size_t>(to_y * c.width + to_x)];
        const auto from =
            bitmap[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)];
        to = static_cast<std::uint8_t>(std::min(255, to + from));  // letters touch, they do not overlap
      }
  }
  return c;
}

/// Display values to light and back.
const std::array<double, 256>& light() {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double s = static_cast<double>(i) / 255;
      t[i] = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
    }
    return t;
  }();
  return table;
}
std::uint8_t display(double linear) {
  const auto& table = light();
  const auto above = std::lower_bound(table.begin(), table.end(), linear);
  if (above == table.begin()) return 0;
  if (above == table.end()) return 255;
  const auto below = above - 1;
  return static_cast<std::uint8_t>((linear - *below < *above - linear ? below : above) - table.begin());
}

void mix(Image& image, std::int64_t x, std::int64_t y, const Colour& colour, std::uint8_t part) {
  if (part == 0 || x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  auto* pixel = &image.rgb[static_cast<std::size_t>(3 * (y * image.width + x))];
  const double a = part / 255.0;
  for (std::size_t i = 0; i < 3; ++i)
    pixel[i] = part == 255 ? colour[i] : display((1 - a) * light()[pixel[i]] + a * light()[colour[i]]);
}

}  // namespace

double text_size(const Image& image) {
  constexpr double least = 10, most = 64, share = 1.0 / 34;
  return std::clamp(std::round(share * static_cast<double>(std::min(image.width, image.height))), least,
                    most);
}

double text_width(std::string_view text, double size) { return set(text, size).width; }

double cap_height(double size) {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  stbtt_GetCodepointBox(&font(), 'H', &x0, &y0, &x1, &y1);
  return static_cast<double>(scale_of(size)) * y1;
}

double line_height(double size) { return 1.3 * size; }

void draw_text(Image& image, double x, double top, std::string_view text, double size, const Colour& colour) {
  // The base line lies on a whole pixel: horizontal strokes are sharp.
  const double base = std::round(top + cap_height(size)), left = std::floor(x);
  const Ink c = cover(set(text, size), size, x - left, 0);
  for (std::int64_t j = 0; j < c.height; ++j)
    for (std::int64_t i = 0; i < c.width; ++i)
      mix(image, static_cast<std::int64_t>(left) + i - c.left, static_cast<std::int64_t>(base) + j - c.base,
          colour, c.part[static_cast<std::size_t>(j * c.width + i)]);
}

void draw_text_upwards(Image& image, double left, double bottom, std::string_view text, double size,
                       const Colour& colour) {
  const double base = std::round(left + cap_height(size)), foot = std::ceil(bottom);
  const Ink c = cover(set(text, size), size, foot - bottom, 0);
  for (std::int64_t j = 0; j < c.height; ++j)
    for (std::int64_t i = 0; i < c.width; ++i)
      mix(image, static_cast<std::int64_t>(base) + j - c.base,
          static_cast<std::int64_t>(foot) - 1 - (i - c.left), colour,
          c.part[static_cast<std::size_t>(j * c.width + i)]);
}

std::string fitted(const std::string& text, double width, double size) {
  if (text_width(text, size) <= width) return text;
  // Where characters begin; the widest part that fits is found by halving.
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) starts.push_back(i);
  const auto shown = [&](std::size_t from) { return text.substr(0, from) + "…"; };
  const auto fits = [&](std::size_t from) { return text_width(shown(from), size) <= width; };
  const auto end = std::partition_point(starts.begin(), starts.end(), fits);
  return end == starts.begin() ? "" : shown(*(end - 1));
}

std::vector<std::string> wrapped(const std::vector<std::string>& paragraphs, double width, double size) {
  std::vector<std::string> lines;
  for (const std::string& paragraph : paragraphs) {
    std::istringstream words(paragraph);
    std::string line;
    for (std::string word; words >> word;) {
      const std::string longer = line.empty() ? word : line + " " + word;
      if (text_width(longer, size) <= width) {
        line = longer;
        continue;
      }
      if (!line.empty()) lines.push_back(line);
      line = fitted(word, width, size);
    }
    lines.push_back(line);
  }
  return lines;
}

}  // namespace vdvr
