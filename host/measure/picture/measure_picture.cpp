#include "vdvr/expert/measure_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/system/casts.hpp"
#include "host/measure/measure_volume.hpp"
#include "host/measure/measured_field.hpp"
#include "host/picture/canvas.hpp"
#include "host/picture/text.hpp"
#include "host/picture/ticks.hpp"
#include "host/volume/brick_layout.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr Colour kPaper{24, 24, 28}, kInk{230, 230, 230}, kBeside{70, 70, 74}, kSure{225, 222, 205},
    kStripe{235, 110, 20}, kBetween{70, 40, 20};
constexpr std::int64_t kLegend = 30, kMargin = 8;
constexpr double kText = 13;

enum class PointClass : std::uint8_t { beside, out, possible, sure };

// The slice's pixels: x to the right and y down; across x and y z down.
struct Pixels {
  std::size_t across = 0, down = 1, normal = 2;
  std::int64_t width = 0, height = 0;
  Vec3 origin{};
  double pixel = 1;

  [[nodiscard]] Vec3 point(std::int64_t x, std::int64_t y) const {
    Vec3 p = origin;
    p[across] += (static_cast<double>(x) + 0.5) * pixel;
    p[down] += (static_cast<double>(y) + 0.5) * pixel;
    return p;
  }
};

void require_size(std::int64_t width, std::int64_t height) {
  constexpr std::int64_t least = 64, most = 16384;
  if (std::min(width, height) < least || std::max(width, height) > most)
    throw InputError(
        fmt::format("a picture of {}x{} pixels: give {} to {} of each", width, height, least, most));
}

Pixels pixels_of(const MeasuredRegion& region, const MeasurePictureOptions& o) {
  require_size(o.width, o.height);
  Pixels p;
  if (o.axis != 2) p = o.axis == 1 ? Pixels{0, 2, 1} : Pixels{1, 2, 0};
  Vec3 low{}, high{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::vector<double> faces = region.faces(a);
    low[a] = faces.front();
    high[a] = faces.back();
  }
  const auto length = [&](std::size_t a) { return high[a] - low[a]; };
  const double position = o.position.value_or(0.5 * (low[p.normal] + high[p.normal]));
  if (!(position >= low[p.normal] && position <= high[p.normal]))
    throw InputError(
        fmt::format("the slice at {} misses what is measured, which reaches from {:.6g} to {:.6g}", position,
                    low[p.normal], high[p.normal]));
  p.pixel = std::max(length(p.across) / static_cast<double>(o.width),
                     length(p.down) / static_cast<double>(o.height - kLegend));
  p.width = std::clamp<std::int64_t>(std::llround(length(p.across) / p.pixel), 1, o.width);
  p.height = std::clamp<std::int64_t>(std::llround(length(p.down) / p.pixel), 1, o.height - kLegend);
  p.origin = low;
  p.origin[p.normal] = position;
  return p;
}

// Whether F is in the range at a point, by V there and the bound of its brick.
PointClass class_of(const measured::Field& field, const ValueRange& range, const Vec3& p) {
  if (!field.region().holds_point(p, p)) return PointClass::beside;
  const Index3 brick = brick_at(field.volume(), p);
  const auto e = static_cast<double>(field.bounds()[at(field.bricks().number(brick))]),
             v = static_cast<double>(sample_at(field.volume(), p));
  if (!std::isfinite(e)) return PointClass::beside;
  if ((range.least && v + e < *range.least) || (range.largest && v - e > *range.largest))
    return PointClass::out;
  const bool sure = (!range.least || v - e >= *range.least) && (!range.largest || v + e <= *range.largest);
  return sure ? PointClass::sure : PointClass::possible;
}

bool on_stripe(std::int64_t x, std::int64_t y) {
  constexpr std::int64_t period = 6, width = 2;
  return (x + y) % period < width;
}

void put(Image& image, std::int64_t x, std::int64_t y, const Colour& colour) {
  std::copy(colour.begin(), colour.end(), image.rgb.begin() + (y * image.width + x) * 3);
}

struct Key {
  Colour colour, stripe;
  std::string text;
};
void draw_legend(Image& image, const std::vector<Key>& keys) {
  const std::int64_t top = image.height - kLegend + kMargin, side = 12;
  std::int64_t x = kMargin;
  for (const Key& key : keys) {
    for (std::int64_t j = 0; j < side; ++j)
      for (std::int64_t i = 0; i < side && x + i < image.width; ++i)
        put(image, x + i, top + j, on_stripe(x + i, top + j) ? key.stripe : key.colour);
    frame(image, x, top, side, side, kInk);
    x += side + 5;
    draw_text(image, static_cast<double>(x), static_cast<double>(top) + 1, key.text, kText, kInk);
    x += std::lround(text_width(key.text, kText)) + 2 * kMargin;
  }
}

// A hue for each number, far from those of its neighbours.
Colour hue_of(std::int64_t number, double light) {
  const double hue = 6 * std::fmod(0.12 + 0.6180339887498949 * static_cast<double>(number), 1.0);
  Colour c{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double place = std::fmod(hue + 6 - 2 * static_cast<double>(k), 6.0),
                 part = std::clamp(std::abs(place - 3) - 1, 0.0, 1.0);
    c[k] = static_cast<std::uint8_t>(std::lround(255 * light * (0.3 + 0.7 * part)));
  }
  return c;
}

// Beside a narrow slice the picture is as wide as its legend, where it may be.
template <class Look>
Image slice_of(const Pixels& p, std::int64_t most, const std::vector<Key>& keys, Look&& look) {
  constexpr std::int64_t legend = 420;
  Image image = blank(std::max(p.width, std::min(most, legend)), p.height + kLegend, kPaper);
  fill(image, p.width, 0, image.width - p.width, p.height, kBeside);
  for (std::int64_t y = 0; y < p.height; ++y)
    for (std::int64_t x = 0; x < p.width; ++x) put(image, x, y, look(x, y));
  draw_legend(image, keys);
  return image;
}

}  // namespace

Image class_slice(const Measurement& measurement, const ValueRange& range,
                  const MeasurePictureOptions& options) {
  measured::require_range(range);
  const measured::Field& field = measurement.field();
  const Pixels p = pixels_of(field.region(), options);
  return slice_of(p, options.width,
                  {{kSure, kSure, "surely"},
                   {kBetween, kStripe, "possibly"},
                   {kPaper, kPaper, "surely not"},
                   {kBeside, kBeside, "not measured"}},
                  [&](std::int64_t x, std::int64_t y) {
                    switch (class_of(field, range, p.point(x, y))) {
                      case PointClass::sure:
                        return kSure;
                      case PointClass::possible:
                        return on_stripe(x, y) ? kStripe : kBetween;
                      case PointClass::out:
                        return kPaper;
                      case PointClass::beside:
                        break;
                    }
                    return kBeside;
                  });
}

Image component_slice(const Measurement& measurement, const ValueRange& range,
                      const MeasurePictureOptions& options, const ComponentsOptions& of_components,
                      const Progress& progress) {
  const measured::Field& field = measurement.field();
  const Pixels p = pixels_of(field.region(), options);
  ComponentsOptions asked = of_components;
  asked.least_volume = std::numeric_limits<double>::max();  // no rows
  asked.points.clear();
  for (std::int64_t y = 0; y < p.height; ++y)
    for (std::int64_t x = 0; x < p.width; ++x) asked.points.push_back(p.point(x, y));
  const ComponentTable table = measurement.components(range, asked, progress);
  const Colour example = hue_of(0, 1), dim = hue_of(0, 0.55), dark = hue_of(0, 0.2);
  return slice_of(p, options.width,
                  {{example, example, "surely"},
                   {dim, dim, "possibly"},
                   {dark, example, "may hold none"},
                   {kBeside, kBeside, "not measured"}},
                  [&](std::int64_t x, std::int64_t y) {
                    const PointClass of_point = class_of(field, range, p.point(x, y));
                    if (of_point == PointClass::beside) return kBeside;
                    const ComponentOfPoint& c = table.points[at(y * p.width + x)];
                    if (of_point == PointClass::out || !c.possible) return kPaper;
                    if (!c.certain) return hue_of(*c.possible, on_stripe(x, y) ? 1 : 0.2);
                    return hue_of(*c.possible, of_point == PointClass::sure ? 1 : 0.55);
                  });
}

Image histogram_picture(const Distribution& d, std::int64_t width, std::int64_t height) {
  require_size(width, height);
  const auto bins = std::ssize(d.within);
  double most = 0;
  for (const Interval& i : d.within) most = std::max(most, i.hi);
  Image image = blank(width, height, kPaper);
  constexpr std::int64_t left = kMargin, axis = 24;
  const std::int64_t wide = width - 2 * kMargin, high = height - kLegend - axis - kMargin,
                     bottom = kMargin + high;
  const auto up = [&](double volume) {
    return most > 0 ? std::llround(volume / most * static_cast<double>(high)) : 0;
  };
  for (std::int64_t i = 0; i < bins; ++i) {
    const std::int64_t x = left + i * wide / bins, end = std::max(x + 1, left + (i + 1) * wide / bins);
    const std::int64_t lo = up(d.within[at(i)].lo), hi = up(d.within[at(i)].hi);
    fill(image, x, bottom - lo, end - x, lo, kSure);
    for (std::int64_t y = bottom - hi; y < bottom - lo; ++y)
      for (std::int64_t c = x; c < std::min(end, width); ++c)
        put(image, c, y, on_stripe(c, y) ? kStripe : kBetween);
  }
  fill(image, left, bottom, wide, 1, kInk);
  const double low = d.edges.front(), range = d.edges.back() - low;
  const Ticks ticks = round_ticks(low, d.edges.back(), 6);
  for (const Tick& t : ticks.ticks) {
    const double x = static_cast<double>(left) + (t.value - low) / range * static_cast<double>(wide);
    fill(image, std::lround(x), bottom, 1, 5, kInk);
    const std::string label = t.label + times_power(ticks.exponent);
    const double end = static_cast<double>(width - kMargin) - text_width(label, kText);
    draw_text(image, std::clamp(x - 0.5 * text_width(label, kText), static_cast<double>(left), end),
              static_cast<double>(bottom) + 9, label, kText, kInk);
  }
  draw_text(image, left, kMargin, number_text(most), kText, kInk);
  draw_legend(image, {{kSure, kSure, "surely in the bin"}, {kBetween, kStripe, "possibly"}});
  return image;
}

}  // namespace vdvr
