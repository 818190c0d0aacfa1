#include "host/picture/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/picture/canvas.hpp"
#include "host/picture/text.hpp"

namespace vdvr::figure {
namespace {

constexpr Colour kPaper{255, 255, 255}, kInk{20, 20, 20}, kGrid{215, 215, 215}, kFrame{255, 255, 255};
// Apart in lightness as well as in hue.
constexpr std::array<Colour, 4> kCurves{{{0, 0, 0}, {0, 90, 180}, {215, 80, 20}, {150, 160, 0}}};

constexpr double kText = 16;  // size of the font; its capitals have 12 pixels
constexpr std::int64_t kCapital = 12, kLine = 22;
constexpr std::int64_t kEdge = 14, kLeft = 104, kTop = kLine + 4, kBottom = 2 * kLine + 12;
constexpr std::int64_t kBarGap = 12, kBar = 18, kRight = kBarGap + kBar + 80;

std::string number(double v, int digits = 3) { return v == 0 ? "0" : fmt::format("{:.{}g}", v, digits); }

enum class Align { left, centre, right };
void text(Image& image, std::int64_t x, std::int64_t y, const std::string& s, Align align,
          const Colour& c = kInk) {
  const double width = text_width(s, kText), left = static_cast<double>(x);
  draw_text(image,
            align == Align::left     ? left
            : align == Align::centre ? left - width / 2
                                     : left - width,
            static_cast<double>(y), s, kText, c);
}

/// A place for one panel: the plot's own square lies at (x, y).
struct Place {
  std::int64_t x, y, side;
};
std::int64_t cell_width(std::int64_t side) { return kLeft + side + kRight; }
std::int64_t cell_height(std::int64_t side) { return kTop + side + kBottom; }

/// Marks along a scale that are worth a number: its ends, and the decades or quarters between.
std::vector<double> marks(const Scale& s) {
  std::vector<double> out{s.low, s.high};
  if (s.logarithmic) {
    for (double d = std::pow(10, std::ceil(std::log10(s.low))); d < s.high; d *= 10)
      if (s.fraction(d) > 0.06 && s.fraction(d) < 0.92) out.push_back(d);
  } else {
    for (const double f : {0.25, 0.5, 0.75}) out.push_back(s.value(f));
  }
  return out;
}

void frequency_axis(Image& image, const Place& p, const std::string& label, double first) {
  for (double f = first; f <= 0.5; f += 0.25) {
    const auto x = p.x + std::lround((f - first) / (0.5 - first) * static_cast<double>(p.side - 1));
    fill(image, x, p.y + p.side, 1, 6, kInk);
    text(image, x, p.y + p.side + 9, number(f), Align::centre);
  }
  text(image, p.x + p.side / 2, p.y + p.side + 9 + kLine, label, Align::centre);
}

void draw_bar(Image& image, const Place& p, const Scale& scale) {
  const std::int64_t x = p.x + p.side + kBarGap;
  for (std::int64_t j = 0; j < p.side; ++j)
    fill(image, x, p.y + j, kBar, 1,
         colour(1 - static_cast<double>(j) / static_cast<double>(std::max<std::int64_t>(1, p.side - 1))));
  for (const double v : marks(scale)) {
    const auto y = p.y + std::lround((1 - scale.fraction(v)) * static_cast<double>(p.side - 1));
    fill(image, x + kBar, y, 4, 1, kInk);
    text(image, x + kBar + 8, std::clamp<std::int64_t>(y - kCapital / 2, p.y, p.y + p.side - kCapital),
         scale.logarithmic && v == scale.low ? "<" + number(v) : number(v, scale.logarithmic ? 3 : 4),
         Align::left);
  }
}

void draw_raster(Image& image, const Place& p, const Raster& r) {
  text(image, p.x + p.side / 2, p.y - kLine, r.title, Align::centre);
  for (std::int64_t y = 0; y < r.side; ++y)
    for (std::int64_t x = 0; x < r.side; ++x)
      fill(image, p.x + x, p.y + y, 1, 1,
           colour(r.scale.fraction(r.values[static_cast<std::size_t>(y * r.side + x)])));
  if (r.box > 0) {
    const auto half = std::lround(r.box * static_cast<double>(r.side) / 2);
    for (std::int64_t grow = 0; grow < 2; ++grow)
      frame(image, p.x + r.side / 2 - half - grow, p.y + r.side / 2 - half - grow, 2 * (half + grow) + 1,
            2 * (half + grow) + 1, kFrame);
  }
  frame(image, p.x - 1, p.y - 1, p.side + 2, p.side + 2, kInk);
  frequency_axis(image, p, r.x_label, -0.5);
  for (double f = -0.5; f <= 0.5; f += 0.25) {
    const auto y = p.y + std::lround((0.5 - f) * static_cast<double>(p.side - 1));
    fill(image, p.x - 6, y, 6, 1, kInk);
    text(image, p.x - 9, y - kCapital / 2, number(f), Align::right);
  }
  draw_text_upwards(
      image, static_cast<double>(p.x - kLeft + 12),
      static_cast<double>(p.y) + (static_cast<double>(p.side) + text_width(r.y_label, kText)) / 2, r.y_label,
      kText, kInk);
  draw_bar(image, p, r.scale);
}

void draw_curve(Image& image, const Place& p, const Curve& curve, const Scale& scale, const Colour& c) {
  const auto n = static_cast<double>(curve.values.size());
  std::int64_t last = -1;
  for (std::int64_t x = 0; x < p.side; ++x) {
    // Each pixel column takes the largest of the points that fall on it, or the line between two.
    const double at = static_cast<double>(x) / static_cast<double>(p.side - 1) * n,
                 until = static_cast<double>(x + 1) / static_cast<double>(p.side - 1) * n;
    const auto i = static_cast<std::size_t>(at);
    if (at > n - 1) break;
    double v = curve.values[i];
    if (i + 1 < curve.values.size()) v += (at - static_cast<double>(i)) * (curve.values[i + 1] - v);
    for (auto j = static_cast<std::size_t>(std::ceil(at)); static_cast<double>(j) < std::min(until, n); ++j)
      v = std::max(v, curve.values[j]);
    const auto y = p.y + std::lround((1 - scale.fraction(v)) * static_cast<double>(p.side - 1));
    const auto from = last < 0 ? y : std::min(y, last), to = last < 0 ? y : std::max(y, last);
    fill(image, p.x + x, from, 2, to - from + 2, c);
    last = y;
  }
}

void draw_chart(Image& image, const Place& p, const Chart& chart) {
  text(image, p.x + p.side / 2, p.y - kLine, chart.title, Align::centre);
  for (const double v : marks(chart.scale)) {
    const auto y = p.y + std::lround((1 - chart.scale.fraction(v)) * static_cast<double>(p.side - 1));
    fill(image, p.x, y, p.side, 1, kGrid);
    text(image, p.x - 6, y - kCapital / 2, number(v), Align::right);
  }
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Colour& c = kCurves[i % kCurves.size()];
    draw_curve(image, p, chart.curves[i], chart.scale, c);
    const std::int64_t y = p.y + kLine * static_cast<std::int64_t>(i), x = p.x + p.side + 8;
    fill(image, x, y + kCapital / 2 - 1, 16, 4, c);
    text(image, x + 22, y, chart.curves[i].label, Align::left);
  }
  frame(image, p.x - 1, p.y - 1, p.side + 2, p.side + 2, kInk);
  frequency_axis(image, p, chart.x_label, 0);
}

template <class Panel, class Draw>
Image layout(const std::string& title, const std::vector<std::vector<Panel>>& rows,
             const std::vector<std::string>& paragraphs, std::int64_t side, Draw&& draw_panel) {
  std::size_t most = 1;
  for (const auto& row : rows) most = std::max(most, row.size());
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  const auto caption = wrapped(paragraphs, static_cast<double>(count(most) * cell_width(side)), kText);
  const std::int64_t head = kEdge + kLine + 10;
  Image image =
      blank(2 * kEdge + count(most) * cell_width(side),
            head + count(rows.size()) * cell_height(side) + count(caption.size()) * kLine + kEdge, kPaper);
  text(image, kEdge, kEdge, title, Align::left);
  std::int64_t top = head;
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i)
      draw_panel(image, Place{kEdge + count(i) * cell_width(side) + kLeft, top + kTop, side}, row[i]);
    top += cell_height(side);
  }
  for (const auto& line : caption) {
    text(image, kEdge, top, line, Align::left);
    top += kLine;
  }
  return image;
}

}  // namespace

double Scale::fraction(double v) const {
  // NaN takes the low end; nothing here produces one.
  if (!(v > low)) return 0;
  const double f = logarithmic ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
  return std::min(f, 1.0);
}

double Scale::value(double f) const {
  return logarithmic ? low * std::pow(high / low, f) : low + f * (high - low);
}

std::array<std::uint8_t, 3> colour(double fraction) {
  static constexpr std::array<std::array<double, 3>, 9> stops{{{68, 1, 84},
                                                               {71, 44, 122},
                                                               {59, 81, 139},
                                                               {44, 113, 142},
                                                               {33, 144, 141},
                                                               {39, 173, 129},
                                                               {92, 200, 99},
                                                               {170, 220, 50},
                                                               {253, 231, 37}}};
  const double x = std::clamp(fraction, 0.0, 1.0) * (stops.size() - 1);
  const auto i = std::min<std::size_t>(stops.size() - 2, static_cast<std::size_t>(x));
  const double t = x - static_cast<double>(i);
  Colour c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = static_cast<std::uint8_t>(std::lround((1 - t) * stops[i][k] + t * stops[i + 1][k]));
  return c;
}

Image draw(const std::string& title, const std::vector<std::vector<Raster>>& rows,
           const std::vector<std::string>& caption) {
  return layout(title, rows, caption, rows.at(0).at(0).side, draw_raster);
}

Image draw(const std::string& title, const std::vector<Chart>& charts,
           const std::vector<std::string>& caption) {
  constexpr std::int64_t side = 400;
  return layout(title, std::vector<std::vector<Chart>>{charts}, caption, side, draw_chart);
}

std::vector<double> paired(const std::vector<double>& coefficients) {
  std::vector<double> out;
  for (std::size_t m = 0; m < coefficients.size(); m += 2)
    out.push_back(std::max(coefficients[m], coefficients[std::min(m + 1, coefficients.size() - 1)]));
  return out;
}

std::vector<double> mirrored(const std::vector<double>& coefficients, std::int64_t n_x, std::int64_t n_y,
                             std::int64_t side) {
  // Coefficient m of n stands for frequencies around m / n of Nyquist.
  const auto covered = [side](std::int64_t pixel, std::int64_t n) {
    const double centre = static_cast<double>(side - 1) / 2,
                 at = std::abs(static_cast<double>(pixel) - centre);
    const auto m = [&](double p) {
      return std::clamp<std::int64_t>(std::llround(p / centre * static_cast<double>(n)), 0, n - 1);
    };
    std::int64_t low = m(at), high = low;
    if (n > side / 2) {
      low = m(std::max(0.0, at - 0.5));
      high = m(at + 0.5);
    }
    return std::pair{low & ~std::int64_t{1}, std::min(high | 1, n - 1)};
  };
  std::vector<double> out(static_cast<std::size_t>(side * side));
  for (std::int64_t y = 0; y < side; ++y) {
    const auto [y0, y1] = covered(y, n_y);
    for (std::int64_t x = 0; x < side; ++x) {
      const auto [x0, x1] = covered(x, n_x);
      double largest = 0;
      for (std::int64_t j = y0; j <= y1; ++j)
        for (std::int64_t i = x0; i <= x1; ++i)
          largest = std::max(largest, coefficients[static_cast<std::size_t>(j * n_x + i)]);
      out[static_cast<std::size_t>(y * side + x)] = largest;
    }
  }
  return out;
}

}  // namespace vdvr::figure
