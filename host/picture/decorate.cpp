#include "vdvr/expert/decorate.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <optional>

#include "host/picture/canvas.hpp"
#include "host/picture/render/glm_vectors.hpp"
#include "host/picture/text.hpp"
#include "host/picture/ticks.hpp"

namespace vdvr {
namespace {

constexpr Colour kLetters{235, 235, 235}, kShadow{0, 0, 0}, kRim{200, 205, 215};

/// Letters with a dark rim, legible on any picture.
void label(Image& image, double x, double top, const std::string& s, double size, const Colour& c) {
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (dx != 0 || dy != 0) draw_text(image, x + dx, top + dy, s, size, kShadow);
  draw_text(image, x, top, s, size, c);
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

struct CaptionText {
  double size = 0;
  std::vector<std::string> lines;
  std::int64_t margin = 0, height = 0;  // pixels; the height with its margins
};

CaptionText caption_text(const Image& image, const std::vector<std::string>& paragraphs, double size) {
  CaptionText text{size, {}, std::lround(0.6 * size)};
  text.lines = wrapped(paragraphs, static_cast<double>(image.width - 2 * text.margin), size);
  const auto lines = static_cast<double>(text.lines.size());
  text.height =
      std::lround(lines * line_height(size) - (line_height(size) - cap_height(size))) + 2 * text.margin;
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
        if (front) draw_line(image, p, q, 1.2, kRim, [](std::int64_t, std::int64_t) { return 0.9; });
        else
          draw_line(image, p, q, 1.0, kRim,
                    [&](std::int64_t x, std::int64_t y) { return 0.6 * shows(x, y); });
      }
}

void draw_axes(Image& image, const Camera& camera, std::int64_t above) {
  const View view(camera, image);
  const double size = text_size(image), thick = size / 10;
  const double length = 0.07 * static_cast<double>(std::min(image.width, image.height));
  const double margin = length + 1.6 * size;
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
    draw_line(image, foot, tip, thick, c, whole);
    const double seen = glm::length(arrow.direction);
    if (seen > 0.2) {
      const glm::dvec2 d = arrow.direction / seen, n{-d.y, d.x};
      const double head = size / 4;
      draw_line(image, tip, tip - head * (d - 0.6 * n), thick, c, whole);
      draw_line(image, tip, tip - head * (d + 0.6 * n), thick, c, whole);
    }
    const glm::dvec2 out = seen > 0.05 ? arrow.direction / seen : glm::dvec2(0.7, 0.7);
    const glm::dvec2 at = tip + 0.6 * size * out;
    const std::string name(1, "xyz"[arrow.axis]);
    label(image, at.x - text_width(name, size) / 2, at.y - cap_height(size) / 2, name, size, c);
  }
}

void draw_colour_bar(Image& image, const ColourBar& bar, std::int64_t above) {
  const double size = text_size(image), cap = cap_height(size), line = line_height(size);
  const double lo = bar.points.front().value, hi = bar.points.back().value;
  const std::int64_t margin = std::lround(0.6 * size), width = std::lround(0.8 * size);
  const std::int64_t room = image.height - above - 2 * margin - std::lround(line);
  const std::int64_t height = std::min<std::int64_t>(room, image.height / 2);
  if (height < std::lround(3 * line)) return;  // a picture too flat for a bar
  const Ticks ticks =
      round_ticks(lo, hi, std::clamp(static_cast<int>(static_cast<double>(height) / (2 * line)), 2, 6));
  double widest = 0;
  for (const Tick& t : ticks.ticks) widest = std::max(widest, text_width(t.label, size));
  const std::string power = times_power(ticks.exponent),
                    unit = power + (power.empty() || bar.unit.empty() ? "" : " ") + bar.unit;
  const std::int64_t top = margin + (unit.empty() ? std::lround(cap / 2) : std::lround(1.4 * line));
  const std::int64_t x = image.width - 2 * margin - std::lround(widest) - width;
  fill(image, x - 1, top - 1, width + 2, height + 2, kLetters);
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
    if (before) draw_line(image, *before, here, 1, kShadow, [](std::int64_t, std::int64_t) { return 0.8; });
    before = here;
  }
  if (!unit.empty())
    label(image, static_cast<double>(image.width - margin) - text_width(unit, size),
          static_cast<double>(margin), unit, size, kLetters);
  for (const Tick& t : ticks.ticks) {
    const double part = hi > lo ? (t.value - lo) / (hi - lo) : 0.5;
    const double y = static_cast<double>(top) + (1 - part) * static_cast<double>(height - 1);
    fill(image, x + width + 1, std::lround(y), 3, 1, kLetters);
    label(image, static_cast<double>(x + width + margin), y - cap / 2, t.label, size, kLetters);
  }
}

std::int64_t draw_caption(Image& image, const std::vector<std::string>& paragraphs) {
  // A caption that would hide more than an eighth of the picture takes smaller letters.
  const double size = text_size(image), small = std::max(10.0, 0.75 * size);
  CaptionText text = caption_text(image, paragraphs, size);
  if (text.height * 8 > image.height) text = caption_text(image, paragraphs, small);
  const std::int64_t top = image.height - text.height;
  fill(image, 0, top, image.width, text.height, kShadow, 0.65);
  for (std::size_t i = 0; i < text.lines.size(); ++i)
    draw_text(image, static_cast<double>(text.margin),
              static_cast<double>(top + text.margin) + static_cast<double>(i) * line_height(text.size),
              text.lines[i], text.size, kLetters);
  return text.height;
}

}  // namespace vdvr
