#include "vdvr/expert/slice_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/picture/canvas.hpp"
#include "host/picture/text.hpp"
#include "host/picture/ticks.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr Colour kFrame{255, 255, 255}, kFrameInk{25, 25, 25};

/// One axis of the slice: the world's, from one edge of the grid to the other, and how it is shown.
struct Axis {
  double low = 0, length = 0;
  char name = 'x';
  Ticks ticks;
  double factor = 1;  // shown is world times this
};

/// All that the frame is made of, for one size of the picture.
struct FrameLayout {
  SlicePlace place;
  double size = 10;  // of the text
  double gap = 4, tick = 4;
  Axis across, down;
  std::string unit;  // of both axes
  Ticks values;
  std::int64_t bar_left = 0, bar_width = 0;
  std::vector<std::string> caption;
  double caption_top = 0;
};

std::array<std::size_t, 2> shown_axes(int axis) {
  if (axis == 2) return {0, 1};
  return axis == 1 ? std::array<std::size_t, 2>{0, 2} : std::array<std::size_t, 2>{1, 2};
}

Axis world_axis(const Grid& grid, std::size_t a) {
  return {grid.origin[a], static_cast<double>(grid.cells[a]) * grid.spacing[a], "xyz" [a], {}, 1};
}

void set_ticks(Axis& axis, const ShownUnit& unit, double pixels, double apart) {
  axis.factor = unit.factor;
  const int most = std::clamp(static_cast<int>(pixels / apart), 3, 9);
  axis.ticks = round_ticks(axis.low * unit.factor, (axis.low + axis.length) * unit.factor, most);
}

double widest(const Ticks& ticks, double size) {
  double width = 0;
  for (const Tick& t : ticks.ticks) width = std::max(width, text_width(t.label, size));
  return width;
}

std::string axis_label(const Axis& axis, const std::string& unit) {
  const std::string power = times_power(axis.ticks.exponent);
  return fmt::format("{} ({}{}{})", axis.name, power, power.empty() ? "" : " ", unit);
}

std::string bar_label(const SliceFrame& f, const FrameLayout& l) {
  const std::string power = times_power(l.values.exponent);
  const std::string unit = power + (power.empty() || f.unit.empty() ? "" : " ") + f.unit;
  return unit.empty() ? f.quantity : fmt::format("{} ({})", f.quantity, unit);
}

std::string title(const SliceFrame& f, const FrameLayout& l) {
  // The middle of a grid around 0, but for what sums round.
  const bool is_zero = std::abs(f.position) < 1e-9 * f.grid.spacing[static_cast<std::size_t>(f.axis)];
  return fmt::format("{} = {} {}", "xyz"[f.axis], number_text(is_zero ? 0 : f.position * l.across.factor),
                     l.unit);
}

/// Round values between the ends of the window, which stand there as they are.
Ticks values_of(const SliceFrame& f, int most) {
  const double lo = f.colours.front().value, hi = f.colours.back().value;
  const Ticks round = round_ticks(lo, hi, most);
  if (!(hi > lo)) return round;
  const double power = std::pow(10.0, round.exponent), near = 0.7 * (hi - lo) / most;
  Ticks t{{{lo, number_text(lo / power)}}, round.exponent};
  for (const Tick& tick : round.ticks)
    if (tick.value - lo >= near && hi - tick.value >= near) t.ticks.push_back(tick);
  t.ticks.push_back({hi, number_text(hi / power)});
  return t;
}

/// The largest slice of its own proportions in the room that is left.
SlicePlace fit(double left, double top, double room_x, double room_y, const Axis& across, const Axis& down) {
  room_x = std::max(1.0, std::floor(room_x));
  room_y = std::max(1.0, std::floor(room_y));
  const double pixel = std::max(across.length / room_x, down.length / room_y);
  SlicePlace p;
  p.framed = true;
  // Rounded up: no row or column of the place has its middle outside of the grid.
  const auto count = [&](double length, double room) {
    const double pixels = std::ceil(length / pixel * (1 - 1e-12));
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(pixels), 1, static_cast<std::int64_t>(room));
  };
  p.width = count(across.length, room_x);
  p.height = count(down.length, room_y);
  p.left = std::llround(left + (room_x - static_cast<double>(p.width)) / 2);
  p.top = std::llround(top + (room_y - static_cast<double>(p.height)) / 2);
  return p;
}

FrameLayout lay_out(const SliceFrame& f, std::int64_t width, std::int64_t height) {
  FrameLayout l;
  const double w = static_cast<double>(width), h = static_cast<double>(height);
  l.size = text_size({width, height, {}});
  l.place = {0, 0, width, height, false};
  constexpr double least_across = 20, least_down = 18;
  if (w < least_across * l.size || h < least_down * l.size) return l;
  const double size = l.size, cap = cap_height(size), line = line_height(size);
  l.gap = std::round(0.4 * size);
  l.tick = std::round(0.3 * size);
  const auto axes = shown_axes(f.axis);
  l.across = world_axis(f.grid, axes[0]);
  l.down = world_axis(f.grid, axes[1]);
  const ShownUnit unit = shown_unit(f.grid.unit, std::max(l.across.length, l.down.length));
  l.unit = fitted(unit.name, 6 * l.size, l.size);  // a file may call it anything
  l.bar_width = std::llround(0.9 * size);
  l.caption = wrapped(f.caption, w - 2 * size, 0.85 * size);
  if (f.caption_lines > 0) l.caption.resize(static_cast<std::size_t>(f.caption_lines));
  const double caption = static_cast<double>(l.caption.size()) * line_height(0.85 * size);
  const double top = size + line, bottom = l.tick + l.gap + 2 * line + caption + 0.6 * size;
  const double room_y = h - top - bottom;
  // Labels take room, and room says how many labels there are: once with a guess, once with its outcome.
  double left = 6 * size, right = 7 * size;
  for (int pass = 0; pass < 2; ++pass) {
    l.place = fit(left, top, w - left - right, room_y, l.across, l.down);
    set_ticks(l.across, unit, static_cast<double>(l.place.width), 4.5 * size);
    set_ticks(l.down, unit, static_cast<double>(l.place.height), 2.2 * size);
    l.values = values_of(f, std::clamp(static_cast<int>(room_y / (2.2 * size)), 2, 7));
    left = size + cap + l.gap + widest(l.down.ticks, size) + l.gap + l.tick;
    right = size + static_cast<double>(l.bar_width) + l.tick + l.gap + widest(l.values, size) + 0.6 * size;
  }
  l.place = fit(left, top, w - left - right, room_y, l.across, l.down);
  l.bar_left = l.place.left + l.place.width + std::llround(size);
  l.caption_top = h - caption - 0.4 * size;
  return l;
}

void draw_axes_around(Image& image, const FrameLayout& l) {
  const SlicePlace& p = l.place;
  const auto tick = static_cast<std::int64_t>(l.tick);
  const double size = l.size, cap = cap_height(size);
  frame(image, p.left - 1, p.top - 1, p.width + 2, p.height + 2, kFrameInk);
  const auto along = [](const Axis& a, const Tick& t, std::int64_t pixels) {
    return (t.value / a.factor - a.low) / a.length * static_cast<double>(pixels);
  };
  // A number that would touch the one before is left out; its tick stays.
  double free_from = 0;
  for (const Tick& t : l.across.ticks.ticks) {
    const double x = static_cast<double>(p.left) + along(l.across, t, p.width),
                 wide = text_width(t.label, size);
    fill(image, std::llround(x - 0.5), p.top + p.height + 1, 1, tick, kFrameInk);
    if (x - wide / 2 < free_from) continue;
    draw_text(image, x - wide / 2, static_cast<double>(p.top + p.height) + 1 + l.tick + l.gap, t.label, size,
              kFrameInk);
    free_from = x + wide / 2 + 0.5 * size;
  }
  free_from = 0;
  for (const Tick& t : l.down.ticks.ticks) {
    const double y = static_cast<double>(p.top) + along(l.down, t, p.height);
    fill(image, p.left - 1 - tick, std::llround(y - 0.5), tick, 1, kFrameInk);
    if (y - cap / 2 < free_from) continue;
    free_from = y + cap / 2 + 0.3 * size;
    draw_text(image, static_cast<double>(p.left) - 1 - l.tick - l.gap - text_width(t.label, size),
              y - cap / 2, t.label, size, kFrameInk);
  }
  const std::string below = axis_label(l.across, l.unit), beside = axis_label(l.down, l.unit);
  draw_text(image, static_cast<double>(p.left),
            static_cast<double>(p.top + p.height) + 1 + l.tick + l.gap + line_height(size), below, size,
            kFrameInk);
  // Centred beside the slice, but within the picture.
  const double wide = text_width(beside, size),
               middle = static_cast<double>(p.top) + static_cast<double>(p.height) / 2;
  const double bottom = std::clamp(middle + wide / 2, wide, std::max(wide, l.caption_top));
  draw_text_upwards(image,
                    static_cast<double>(p.left) - 1 - l.tick - 2 * l.gap - widest(l.down.ticks, size) - cap,
                    bottom, beside, size, kFrameInk);
}

/// Below the slice, at its right end, in the line of the axis' name.
void draw_scale_bar(Image& image, const FrameLayout& l) {
  const SlicePlace& p = l.place;
  const double shown = l.across.length * l.across.factor, length = round_length(0.3 * shown);
  const auto pixels = std::max<std::int64_t>(1, std::llround(length / shown * static_cast<double>(p.width)));
  const std::string label = fmt::format("{} {}", number_text(length), l.unit);
  const double size = l.size,
               top = static_cast<double>(p.top + p.height) + 1 + l.tick + l.gap + line_height(size);
  const double name = text_width(axis_label(l.across, l.unit), size), wide = text_width(label, size);
  const double left = static_cast<double>(p.left + p.width - pixels) - l.gap - wide;
  if (left < static_cast<double>(p.left) + name + size) return;  // a narrow slice has its axis
  draw_text(image, left, top, label, size, kFrameInk);
  const auto thick = std::max<std::int64_t>(2, std::llround(size / 6));
  fill(image, p.left + p.width - pixels, std::llround(top + cap_height(size) / 2) - thick / 2, pixels, thick,
       kFrameInk);
}

void draw_bar(Image& image, const SliceFrame& f, const FrameLayout& l, std::int64_t width) {
  // As high as the slice, and never so flat that its numbers touch.
  const double size = l.size, cap = cap_height(size);
  const auto least = std::llround(2.2 * size * static_cast<double>(l.values.ticks.size()));
  const std::int64_t height = std::max<std::int64_t>(l.place.height, least);
  const std::int64_t top = l.place.top + l.place.height / 2 - height / 2;
  const double lo = f.colours.front().value, hi = f.colours.back().value;
  for (std::int64_t j = 0; j < height; ++j) {
    const double part = 1 - (static_cast<double>(j) + 0.5) / static_cast<double>(height);
    const TransferPoint p = transfer_at(f.colours, lo + part * (hi - lo));
    Colour c{};
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(p.rgb[k], 0.0, 1.0)));
    fill(image, l.bar_left, top + j, l.bar_width, 1, c);
  }
  frame(image, l.bar_left - 1, top - 1, l.bar_width + 2, height + 2, kFrameInk);
  for (const Tick& t : l.values.ticks) {
    const double part = hi > lo ? (t.value - lo) / (hi - lo) : 0.5;
    const double y = static_cast<double>(top) + (1 - part) * static_cast<double>(height);
    const std::int64_t x = l.bar_left + l.bar_width + 1;
    fill(image, x, std::llround(y - 0.5), static_cast<std::int64_t>(l.tick), 1, kFrameInk);
    draw_text(image, static_cast<double>(x) + l.tick + l.gap, y - cap / 2, t.label, size, kFrameInk);
  }
  // Beside the title.
  const double room = static_cast<double>(width - l.place.left) - text_width(title(f, l), size) - 2 * size;
  const std::string label = fitted(bar_label(f, l), room, size);
  draw_text(image, static_cast<double>(width) - 0.6 * size - text_width(label, size),
            std::max(0.4 * size, static_cast<double>(top) - line_height(size) - l.gap), label, size,
            kFrameInk);
}

}  // namespace

SlicePlace slice_place(const SliceFrame& frame, std::int64_t width, std::int64_t height) {
  return lay_out(frame, width, height).place;
}

Image framed_slice(const SliceFrame& f, const Image& slice, std::int64_t width, std::int64_t height) {
  const FrameLayout l = lay_out(f, width, height);
  if (slice.width != l.place.width || slice.height != l.place.height)
    throw InputError(fmt::format("a slice of {}x{} pixels in a picture of {}x{}, which has room for {}x{}",
                                 slice.width, slice.height, width, height, l.place.width, l.place.height));
  if (!l.place.framed) return slice;
  Image image = blank(width, height, kFrame);
  draw_axes_around(image, l);
  draw_scale_bar(image, l);
  draw_bar(image, f, l, width);
  draw_text(image, static_cast<double>(l.place.left),
            std::max(0.4 * l.size, static_cast<double>(l.place.top) - line_height(l.size) - l.gap),
            title(f, l), l.size, kFrameInk);
  for (std::size_t i = 0; i < l.caption.size(); ++i)
    draw_text(image, l.size, l.caption_top + static_cast<double>(i) * line_height(0.85 * l.size),
              l.caption[i], 0.85 * l.size, kFrameInk);
  paste(image, l.place.left, l.place.top, slice);
  return image;
}

std::vector<TransferPoint> grey_window(const std::pair<double, double>& window) {
  return {{window.first, {0, 0, 0}, 1}, {window.second, {1, 1, 1}, 1}};
}

}  // namespace vdvr
