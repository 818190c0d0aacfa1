#include "host/line_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/page.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double kWidth = 760, kHeight = 430, kLeft = 76, kRight = 190, kTop = 40, kBottom = 54;
// Apart in lightness as well as in hue.
constexpr std::array<const char*, 6> kColours{"#0a4f9e", "#c8102e", "#000000",
                                              "#d98200", "#4c8c2b", "#7b4fa3"};

struct Axis {
  double low = 0, high = 1, first = 0, length = 1;  ///< first: where low lies on the page
  bool logarithmic = false;

  [[nodiscard]] double at(double value) const {
    const auto scale = [&](double v) { return logarithmic ? std::log10(v) : v; };
    return first + length * (scale(value) - scale(low)) / (scale(high) - scale(low));
  }
};

/// A step of 1, 2 or 5 times a power of ten that leaves about five marks.
double step_for(double extent) {
  const double raw = extent / 5, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double s : {1.0, 2.0, 5.0})
    if (s * power >= raw) return s * power;
  return 10 * power;
}

std::vector<double> marks_of(const Axis& axis) {
  std::vector<double> marks;
  if (axis.logarithmic) {
    for (double d = std::floor(std::log10(axis.low)); d <= std::log10(axis.high) + 1e-9; ++d)
      if (std::pow(10, d) >= axis.low * (1 - 1e-9)) marks.push_back(std::pow(10, d));
    return marks;
  }
  const double step = step_for(axis.high - axis.low);
  for (double k = std::ceil(axis.low / step); k * step <= axis.high + 1e-9 * step; ++k)
    marks.push_back(k * step);
  return marks;
}

bool shown(const LinePlot& plot, const std::array<double, 2>& p) {
  return std::isfinite(p[0]) && std::isfinite(p[1]) && (!plot.logarithmic || p[1] > 0);
}

/// x and y, over all points; y from 0 or from a power of ten.
std::array<Axis, 2> axes_for(const LinePlot& plot) {
  constexpr double none = std::numeric_limits<double>::infinity();
  double x_low = none, x_high = -none, y_low = none, y_high = -none;
  for (const auto& curve : plot.curves)
    for (const auto& p : curve.points) {
      if (!shown(plot, p)) continue;
      x_low = std::min(x_low, p[0]);
      x_high = std::max(x_high, p[0]);
      y_low = std::min(y_low, p[1]);
      y_high = std::max(y_high, p[1]);
    }
  if (!(x_low <= x_high)) throw InputError(fmt::format("the plot '{}' has no point to show", plot.title));
  if (x_low == x_high) x_high = x_low + 1;
  if (plot.logarithmic) {
    y_low = std::pow(10, std::floor(std::log10(y_low)));
    y_high = std::pow(10, std::ceil(std::log10(y_high) + 1e-9));
  } else {
    y_low = std::min(0.0, y_low);
    y_high = y_high > y_low ? y_high + 0.05 * (y_high - y_low) : y_low + 1;
  }
  return {Axis{x_low, x_high, kLeft, kWidth - kLeft - kRight, false},
          Axis{y_low, y_high, kHeight - kBottom, -(kHeight - kTop - kBottom), plot.logarithmic}};
}

std::string line(double x0, double y0, double x1, double y1, const char* colour) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x0,
                     y0, x1, y1, colour);
}
std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     escaped(text));
}

std::string frame_svg(const LinePlot& plot, const Axis& x, const Axis& y) {
  const double right = kWidth - kRight, bottom = kHeight - kBottom;
  std::string out;
  for (const double v : marks_of(y)) {
    out += line(kLeft, y.at(v), right, y.at(v), "#ddd");
    out += label(kLeft - 8, y.at(v) + 4, "end", fmt::format("{:.4g}", v));
  }
  for (const double v : marks_of(x)) {
    out += line(x.at(v), bottom, x.at(v), bottom + 5, "#222");
    out += label(x.at(v), bottom + 20, "middle", fmt::format("{:.4g}", v));
  }
  out += line(kLeft, bottom, right, bottom, "#222") + line(kLeft, kTop, kLeft, bottom, "#222");
  out += label((kLeft + right) / 2, kHeight - 12, "middle", plot.x_label);
  out +=
      fmt::format("<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                  (kTop + bottom) / 2, escaped(plot.y_label));
  return out + fmt::format("<text x=\"{:.1f}\" y=\"22\" font-weight=\"bold\">{}</text>\n", kLeft,
                           escaped(plot.title));
}

std::string curve_svg(const LinePlot& plot, std::size_t index, const Axis& x, const Axis& y) {
  const LineCurve& curve = plot.curves[index];
  const char* colour = kColours[index % kColours.size()];
  const char* dash = curve.dashed ? " stroke-dasharray=\"6 4\"" : "";
  std::string path, dots;
  for (const auto& p : curve.points) {
    if (!shown(plot, p)) continue;
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x.at(p[0]), y.at(p[1]));
    if (plot.marks)
      dots += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.2\" fill=\"{}\"><title>{}: {:.6g}, "
          "{:.6g}</title></circle>\n",
          x.at(p[0]), y.at(p[1]), colour, escaped(curve.label), p[0], p[1]);
  }
  const double key = kTop + 12 + 22 * static_cast<double>(index), left = kWidth - kRight + 14;
  return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>\n", path, colour,
                     dash) +
         dots +
         fmt::format(
             "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{2:.1f}\" y2=\"{1:.1f}\" stroke=\"{3}\" "
             "stroke-width=\"2\"{4}/>\n",
             left, key, left + 24, colour, dash) +
         label(left + 30, key + 4, "start", curve.label);
}

}  // namespace

std::string svg(const LinePlot& plot) {
  const auto [x, y] = axes_for(plot);
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" font-family=\"system-ui, sans-serif\" font-size=\"13\" fill=\"#222\">\n",
      kWidth, kHeight);
  out += frame_svg(plot, x, y);
  for (std::size_t i = 0; i < plot.curves.size(); ++i) out += curve_svg(plot, i, x, y);
  return out + "</svg>\n";
}

}  // namespace vdvr
