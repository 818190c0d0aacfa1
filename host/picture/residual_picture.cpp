// A row's residuals as a sinogram between a scale, the rms of each view and that of each column.
#include "vdvr/expert/residual_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/picture/canvas.hpp"
#include "host/picture/sheet.hpp"
#include "host/picture/text.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr Colour kAside{150, 150, 150};
constexpr std::int64_t kTextLine = 22, kCapital = 12, kScale = 14, kCurves = 90, kTicks = 74;

/// Blue below, white at 0, red above; -1 to 1.
Colour signed_colour(double x) {
  constexpr std::array<double, 3> below{5, 48, 155}, above{170, 12, 30};
  const double part = std::min(std::abs(x), 1.0);
  const auto& end = x < 0 ? below : above;
  Colour c{};
  // A root, so that small residuals are told from none.
  for (std::size_t i = 0; i < 3; ++i)
    c[i] = static_cast<std::uint8_t>(std::lround(255 + std::sqrt(part) * (end[i] - 255)));
  return c;
}

void write(Image& image, std::int64_t x, std::int64_t y, const std::string& text) {
  draw_text(image, static_cast<double>(x), static_cast<double>(y), text, kText, kInk);
}

struct Layout {
  std::int64_t columns, views, zoom_x, zoom_y;
  std::int64_t left = kEdge + kTicks, top = kEdge + 2 * kTextLine;
  [[nodiscard]] std::int64_t width() const { return columns * zoom_x; }
  [[nodiscard]] std::int64_t height() const { return views * zoom_y; }
};

/// Pixels of a ray: the sinogram is some 700 wide and 500 high where it can be.
Layout layout_of(const ParallelGeometry& g) {
  return {g.columns, g.views(), std::max<std::int64_t>(1, 700 / g.columns),
          std::max<std::int64_t>(1, 500 / g.views())};
}

/// The 99th percentile of magnitudes: one spoilt view must not make all others white.
double scale_of(const Residual& r, std::int64_t row) {
  std::vector<double> magnitude;
  for (std::int64_t k = 0; k < r.geometry.views(); ++k)
    for (std::int64_t i = 0; i < r.geometry.columns; ++i)
      if (const std::size_t at = r.index(k, row, i); !std::isnan(r.lo[at]))
        magnitude.push_back(std::abs(r.middle(at)));
  if (magnitude.empty()) return 1;
  const auto place = magnitude.begin() + static_cast<std::ptrdiff_t>(magnitude.size() * 99 / 100);
  std::nth_element(magnitude.begin(), place, magnitude.end());
  return *place > 0 ? *place : 1;
}

void draw_rays(Image& image, const Layout& l, const Residual& r, std::int64_t row, double scale) {
  for (std::int64_t k = 0; k < l.views; ++k)
    for (std::int64_t i = 0; i < l.columns; ++i) {
      const std::size_t at = r.index(k, row, i);
      fill(image, l.left + i * l.zoom_x, l.top + k * l.zoom_y, l.zoom_x, l.zoom_y,
           std::isnan(r.lo[at]) ? kAside : signed_colour(r.middle(at) / scale));
    }
  // Every fourth pixel of a lattice: what lies below can still be seen.
  constexpr std::int64_t lattice = 4;
  for (std::int64_t y = 0; y < l.height(); y += lattice)
    for (std::int64_t x = 0; x < l.width(); x += lattice)
      if (r.beyond_interpolation(r.index(y / l.zoom_y, row, x / l.zoom_x)))
        fill(image, l.left + x, l.top + y, 2, 2, kInk);
}

void draw_scale(Image& image, const Layout& l, double scale, const std::string& unit) {
  const std::int64_t x = l.left + l.width() + kEdge + kCurves + 2 * kEdge;
  for (std::int64_t y = 0; y < l.height(); ++y)
    fill(image, x, l.top + y, kScale, 1,
         signed_colour(1 - 2 * static_cast<double>(y) / static_cast<double>(l.height() - 1)));
  const auto label = [&](std::int64_t y, double value) {
    write(image, x + kScale + 6, y, fmt::format("{:+.3g}", value));
  };
  label(l.top, scale);
  write(image, x + kScale + 6, l.top + l.height() / 2 - kCapital / 2, "0");
  label(l.top + l.height() - kCapital, -scale);
  write(image, x, l.top + l.height() + kEdge, "density");
  write(image, x, l.top + l.height() + kEdge + kTextLine, "× " + unit);
}

/// Curves of rms from 0: by view to the right of the rays, by column below.
void draw_curves(Image& image, const Layout& l, const ResidualSummary& s) {
  const auto length = [](double rms, double largest) {
    return largest > 0 ? std::lround(rms / largest * static_cast<double>(kCurves)) : 0;
  };
  const std::int64_t right = l.left + l.width() + kEdge, below = l.top + l.height() + kEdge;
  fill(image, right, l.top, 1, l.height(), kGrid);
  for (std::int64_t k = 0; k < l.views; ++k)
    fill(image, right, l.top + k * l.zoom_y,
         length(s.views[static_cast<std::size_t>(k)].rms, s.worst_view.rms), l.zoom_y, kCurve);
  fill(image, l.left, below, l.width(), 1, kGrid);
  for (std::int64_t i = 0; i < l.columns; ++i)
    fill(image, l.left + i * l.zoom_x, below, l.zoom_x,
         length(s.columns[static_cast<std::size_t>(i)].rms, s.worst_column.rms), kCurve);
  write(image, right, l.top - kTextLine, fmt::format("rms, {:.2g}", s.worst_view.rms));
  write(image, kEdge, below, "rms");
  write(image, kEdge, below + kTextLine, fmt::format("{:.2g}", s.worst_column.rms));
}

void draw_ticks(Image& image, const Layout& l) {
  write(image, kEdge, l.top, "view 0");
  write(image, kEdge, l.top + l.height() - kCapital, fmt::format("{}", l.views - 1));
  write(image, l.left, l.top - kTextLine, "column 0");
  const std::string last = fmt::format("{}", l.columns - 1);
  write(image, l.left + l.width() - std::lround(text_width(last, kText)), l.top - kTextLine, last);
}

}  // namespace

Image residual_picture(const Residual& r, const ResidualSummary& s, std::int64_t row,
                       const std::string& title) {
  if (row < r.first_row || row >= r.first_row + r.rows)
    throw InputError(fmt::format("`row` {} is none of {} to {}", row, r.first_row, r.first_row + r.rows - 1));
  const Layout l = layout_of(r.geometry);
  const double scale = scale_of(r, row);
  constexpr std::int64_t numbers = 130;
  const std::array<std::string, 3> caption{
      fmt::format("{:.2f} % of {} rays: no interpolation within the certificate explains them (dots)",
                  s.compared > 0
                      ? 100.0 * static_cast<double>(s.beyond_interpolation) / static_cast<double>(s.compared)
                      : 0.0,
                  s.compared),
      "red: measured more than F has along the ray; blue: less; grey: not compared",
      fmt::format("worst view {} ({:.1f} times the median rms), worst column {} ({:.1f} times)",
                  s.worst_view.index, s.median_view_rms > 0 ? s.worst_view.rms / s.median_view_rms : 0,
                  s.worst_column.index,
                  s.median_column_rms > 0 ? s.worst_column.rms / s.median_column_rms : 0)};
  double longest = text_width(title, kText);
  for (const std::string& line : caption) longest = std::max(longest, text_width(line, kText));
  Image image = blank(
      std::max(l.left + l.width() + 4 * kEdge + kCurves + kScale + numbers, std::lround(longest) + 2 * kEdge),
      l.top + l.height() + 3 * kEdge + kCurves + 3 * kTextLine, kPaper);
  write(image, kEdge, kEdge, title);
  draw_rays(image, l, r, row, scale);
  draw_curves(image, l, s);
  draw_scale(image, l, scale, r.geometry.unit);
  draw_ticks(image, l);
  std::int64_t y = l.top + l.height() + 2 * kEdge + kCurves;
  for (const std::string& line : caption) {
    write(image, kEdge, y, line);
    y += kTextLine;
  }
  return image;
}

}  // namespace vdvr
