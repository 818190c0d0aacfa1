#include "vdvr/decorate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <numeric>
#include <optional>
#include <sstream>

#include "host/picture/bitmap_font.hpp"
#include "host/render/glm_vectors.hpp"

namespace vdvr {
namespace {

using Colour = std::array<std::uint8_t, 3>;
constexpr Colour kInk{235, 235, 235}, kShadow{0, 0, 0}, kEdge{200, 205, 215};

/// Small pictures have small letters.
int text_scale(const Image& image) { return std::min(image.width, image.height) >= 400 ? 2 : 1; }
std::int64_t text_width(const std::string& s, int scale) {
  return static_cast<std::int64_t>(s.size()) * kFontAdvance * scale;
}

void blend(Image& image, std::int64_t x, std::int64_t y, const Colour& c, double part) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height || !(part > 0)) return;
  auto* p = &image.rgb[static_cast<std::size_t>(3 * (y * image.width + x))];
  for (std::size_t i = 0; i < 3; ++i)
    p[i] = static_cast<std::uint8_t>(std::lround((1 - part) * p[i] + part * c[i]));
}

void fill(Image& image, std::int64_t x, std::int64_t y, std::int64_t w, std::int64_t h, const Colour& c,
          double part = 1) {
  for (std::int64_t j = y; j < y + h; ++j)
    for (std::int64_t i = x; i < x + w; ++i) blend(image, i, j, c, part);
}

/// Letters with a dark rim, legible on any picture.
void label(Image& image, std::int64_t x, std::int64_t y, const std::string& s, int scale, const Colour& c) {
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (dx != 0 || dy != 0) draw_text(image, x + dx, y + dy, s, scale, kShadow);
  draw_text(image, x, y, s, scale, c);
}

/// A smooth line of `width` pixels; `part(x, y)` scales its opacity.
template <class Part>
void line(Image& image, glm::dvec2 a, glm::dvec2 b, double width, const Colour& c, Part&& part) {
  // Clip generously to the picture first: an end may lie far outside.
  const glm::dvec2 lo{-8, -8},
      hi{static_cast<double>(image.width) + 8, static_cast<double>(image.height) + 8};
  double t0 = 0, t1 = 1;
  const glm::dvec2 d = b - a;
  for (int k = 0; k < 2; ++k) {
    if (d[k] == 0) {
      if (a[k] < lo[k] || a[k] > hi[k]) return;
      continue;
    }
    const double u = (lo[k] - a[k]) / d[k], v = (hi[k] - a[k]) / d[k];
    t0 = std::max(t0, std::min(u, v));
    t1 = std::min(t1, std::max(u, v));
  }
  if (!(t0 <= t1)) return;
  const glm::dvec2 p = a + t0 * d, q = a + t1 * d, e = q - p;
  const double length2 = glm::dot(e, e), reach = width / 2 + 1;
  // Column by column, or row by row where it is steep: pixels near the line only.
  const int along = std::abs(e.x) >= std::abs(e.y) ? 0 : 1, across = 1 - along;
  const double from = std::min(p[along], q[along]) - reach, to = std::max(p[along], q[along]) + reach;
  for (auto i = static_cast<std::int64_t>(std::floor(from)); i <= static_cast<std::int64_t>(std::ceil(to));
       ++i) {
    const double t =
        e[along] != 0 ? std::clamp((static_cast<double>(i) + 0.5 - p[along]) / e[along], 0.0, 1.0) : 0;
    const double middle = p[across] + t * e[across];
    for (auto j = static_cast<std::int64_t>(std::floor(middle - 2 * reach));
         j <= static_cast<std::int64_t>(std::ceil(middle + 2 * reach)); ++j) {
      const std::int64_t x = along == 0 ? i : j, y = along == 0 ? j : i;
      const glm::dvec2 pixel{static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5};
      const double s = length2 > 0 ? std::clamp(glm::dot(pixel - p, e) / length2, 0.0, 1.0) : 0;
      const double away = glm::distance(pixel, p + s * e);
      blend(image, x, y, c, std::clamp(width / 2 + 0.5 - away, 0.0, 1.0) * part(x, y));
    }
  }
}

// --- projection ---

/// The ray-caster's camera: `right` and `up` span the picture's plane at distance one.
struct View {
  glm::dvec3 eye, forward, right, up;
  double tangent, width, height;

  View(const Camera& c, const Image& image)
      : eye(to_glm(c.position)),
        forward(glm::normalize(to_glm(c.focal_point) - eye)),
        right(glm::normalize(glm::cross(forward, to_glm(c.view_up)))),
        up(glm::cross(right, forward)),
        tangent(std::tan(glm::radians(c.view_angle_deg) / 2)),
        width(static_cast<double>(image.width)),
        height(static_cast<double>(image.height)) {}

  [[nodiscard]] double depth(const glm::dvec3& p) const { return glm::dot(p - eye, forward); }
  [[nodiscard]] glm::dvec2 pixel(const glm::dvec3& p) const {
    const double scale = height / 2 / (tangent * depth(p));
    return {width / 2 + scale * glm::dot(p - eye, right), height / 2 - scale * glm::dot(p - eye, up)};
  }
};

struct Segment {
  glm::dvec3 a, b;
};

/// What lies in front of the eye.
std::optional<Segment> in_front(const View& view, Segment s, double near) {
  const double a = view.depth(s.a), b = view.depth(s.b);
  if (a < near && b < near) return std::nullopt;
  const auto cut = [&] { return s.a + (near - a) / (b - a) * (s.b - s.a); };
  if (a < near) s.a = cut();
  else if (b < near) s.b = cut();
  return s;
}

std::vector<std::string> wrapped(const std::vector<std::string>& paragraphs, std::size_t width) {
  std::vector<std::string> lines;
  for (const auto& paragraph : paragraphs) {
    std::istringstream words(paragraph);
    std::string text;
    for (std::string word; words >> word;) {
      if (!text.empty() && text.size() + 1 + word.size() > width) {
        lines.push_back(text);
        text.clear();
      }
      text += (text.empty() ? "" : " ") + word;
    }
    if (!text.empty()) lines.push_back(text);
  }
  return lines;
}

// At scale 1, in pixels.
constexpr std::int64_t kCaptionMargin = 4, kCaptionLine = kFontHeight + 3;

struct CaptionText {
  std::vector<std::string> lines;
  std::int64_t height = 0;  // pixels, with its margins
};

CaptionText caption_text(const Image& image, const std::vector<std::string>& paragraphs, int scale) {
  const std::int64_t room = image.width - 2 * kCaptionMargin * scale;
  const std::int64_t columns = std::max<std::int64_t>(1, room / (kFontAdvance * scale));
  CaptionText text{wrapped(paragraphs, static_cast<std::size_t>(columns))};
  // The gap under the last line is the margin's.
  text.height =
      (static_cast<std::int64_t>(text.lines.size()) * kCaptionLine + 2 * kCaptionMargin - 3) * scale;
  return text;
}

}  // namespace

void draw_box(Image& image, const Camera& camera, const Grid& grid, const std::vector<float>& hidden) {
  const View view(camera, image);
  const glm::dvec3 lo = to_glm(grid.origin);
  glm::dvec3 side{};
  for (int a = 0; a < 3; ++a)
    side[a] = static_cast<double>(grid.cells[static_cast<std::size_t>(a)]) *
              grid.spacing[static_cast<std::size_t>(a)];
  const double near = 1e-6 * glm::length(side);
  const auto faces_eye = [&](int axis, int end) {
    return end == 0 ? view.eye[axis] < lo[axis] : view.eye[axis] > lo[axis] + side[axis];
  };
  const auto shows = [&](std::int64_t x, std::int64_t y) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return 0.0;
    return 1.0 -
           std::clamp(static_cast<double>(hidden[static_cast<std::size_t>(y * image.width + x)]), 0.0, 1.0);
  };
  // Edges behind first, so that those in front cross over them.
  for (const bool front : {false, true})
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < 4; ++corner) {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3, at_b = corner & 1, at_c = corner >> 1;
        if ((faces_eye(b, at_b) || faces_eye(c, at_c)) != front) continue;
        glm::dvec3 from = lo;
        from[b] += at_b * side[b];
        from[c] += at_c * side[c];
        glm::dvec3 to = from;
        to[axis] += side[axis];
        const auto visible = in_front(view, {from, to}, near);
        if (!visible) continue;
        const glm::dvec2 p = view.pixel(visible->a), q = view.pixel(visible->b);
        if (front) line(image, p, q, 1.2, kEdge, [](std::int64_t, std::int64_t) { return 0.9; });
        else line(image, p, q, 1.0, kEdge, [&](std::int64_t x, std::int64_t y) { return 0.6 * shows(x, y); });
      }
}

void draw_axes(Image& image, const Camera& camera, std::int64_t above) {
  const View view(camera, image);
  const int scale = text_scale(image);
  const double length = 0.07 * static_cast<double>(std::min(image.width, image.height));
  const double margin = length + 14 * scale;
  const glm::dvec2 foot{margin, static_cast<double>(image.height - above) - margin};
  struct Arrow {
    double depth;
    glm::dvec2 direction;
    std::size_t axis;
  };
  std::vector<Arrow> arrows;
  for (std::size_t a = 0; a < 3; ++a) {
    glm::dvec3 e{};
    e[static_cast<int>(a)] = 1;
    arrows.push_back({glm::dot(e, view.forward), {glm::dot(e, view.right), -glm::dot(e, view.up)}, a});
  }
  // What points away is drawn first.
  std::sort(arrows.begin(), arrows.end(), [](const Arrow& p, const Arrow& q) { return p.depth > q.depth; });
  constexpr std::array<Colour, 3> colours{{{235, 90, 80}, {110, 210, 100}, {110, 150, 255}}};
  const auto whole = [](std::int64_t, std::int64_t) { return 1.0; };
  for (const Arrow& arrow : arrows) {
    const glm::dvec2 tip = foot + length * arrow.direction;
    const Colour& c = colours[arrow.axis];
    line(image, foot, tip, 1.5 * scale, c, whole);
    const double seen = glm::length(arrow.direction);
    if (seen > 0.2) {
      const glm::dvec2 d = arrow.direction / seen, n{-d.y, d.x};
      const double head = 3.0 * scale;
      line(image, tip, tip - head * (d - 0.6 * n), 1.5 * scale, c, whole);
      line(image, tip, tip - head * (d + 0.6 * n), 1.5 * scale, c, whole);
    }
    const glm::dvec2 out = seen > 0.05 ? arrow.direction / seen : glm::dvec2(0.7, 0.7);
    const glm::dvec2 at = tip + 7.0 * scale * out;
    label(image, std::lround(at.x - 2.5 * scale), std::lround(at.y - 3.5 * scale),
          std::string(1, "xyz"[arrow.axis]), scale, c);
  }
}

void draw_colour_bar(Image& image, const ColourBar& bar, std::int64_t above) {
  const int scale = text_scale(image);
  const double lo = bar.points.front().value, hi = bar.points.back().value;
  const std::int64_t line_height = (kFontHeight + 3) * scale, margin = 8 * scale, width = 10 * scale;
  const std::int64_t top = margin + (bar.unit.empty() ? 0 : line_height + 2 * scale);
  const std::int64_t height = std::min<std::int64_t>(image.height - above - margin - top, image.height / 2);
  if (height < 2 * line_height) return;  // a picture too flat for a bar
  std::vector<std::string> labels;
  std::size_t longest = 0;
  constexpr int quarters = 4;
  for (int i = 0; i <= quarters; ++i) {
    const double value = lo + (hi - lo) * i / quarters;
    labels.push_back(fmt::format("{:.3g}", std::abs(value) < 1e-9 * (hi - lo) ? 0.0 : value));
    longest = std::max(longest, labels.back().size());
  }
  const std::int64_t x =
      image.width - margin - static_cast<std::int64_t>(longest) * kFontAdvance * scale - width - 4;
  fill(image, x - 1, top - 1, width + 2, height + 2, kInk);
  std::optional<glm::dvec2> before;
  const double most =
      std::max_element(bar.points.begin(), bar.points.end(), [](const auto& a, const auto& b) {
        return a.opacity < b.opacity;
      })->opacity;
  for (std::int64_t j = 0; j < height; ++j) {
    const double f = 1 - static_cast<double>(j) / static_cast<double>(height - 1);
    const TransferPoint p = transfer_at(bar.points, lo + f * (hi - lo));
    Colour c{};
    for (std::size_t k = 0; k < 3; ++k) c[k] = static_cast<std::uint8_t>(std::lround(255 * p.rgb[k]));
    fill(image, x, top + j, width, 1, c);
  }
  for (std::int64_t j = 0; bar.opacity && most > 0 && j < height; ++j) {
    const double f = 1 - static_cast<double>(j) / static_cast<double>(height - 1);
    const double part = transfer_at(bar.points, lo + f * (hi - lo)).opacity / most;
    const glm::dvec2 here{static_cast<double>(x) + 0.5 + part * static_cast<double>(width - 1),
                          static_cast<double>(top + j) + 0.5};
    if (before) line(image, *before, here, 1, kShadow, [](std::int64_t, std::int64_t) { return 0.8; });
    before = here;
  }
  if (!bar.unit.empty())
    label(image, image.width - margin - text_width(bar.unit, scale), margin - 2 * scale, bar.unit, scale,
          kInk);
  for (int i = 0; i <= quarters; ++i) {
    const std::int64_t y = top + (height - 1) * (quarters - i) / quarters;
    fill(image, x + width + 1, y, 3, 1, kInk);
    label(image, x + width + 6, y - kFontHeight * scale / 2, labels[static_cast<std::size_t>(i)], scale,
          kInk);
  }
}

std::int64_t draw_caption(Image& image, const std::vector<std::string>& paragraphs) {
  // A caption that would hide more than an eighth of the picture takes the small letters.
  int scale = text_scale(image);
  CaptionText text = caption_text(image, paragraphs, scale);
  if (scale > 1 && text.height * 8 > image.height) text = caption_text(image, paragraphs, scale = 1);
  const std::int64_t margin = kCaptionMargin * scale, top = image.height - text.height;
  fill(image, 0, top, image.width, text.height, kShadow, 0.65);
  for (std::size_t i = 0; i < text.lines.size(); ++i)
    draw_text(image, margin, top + margin + static_cast<std::int64_t>(i) * kCaptionLine * scale,
              text.lines[i], scale, kInk);
  return text.height;
}

}  // namespace vdvr
