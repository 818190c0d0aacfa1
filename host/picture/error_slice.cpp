#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/error_slice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/picture/canvas.hpp"
#include "host/picture/text.hpp"
#include "host/picture/ticks.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/region_of_interest.hpp"
#include "vdvr/expert/slice_frame.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

constexpr Colour kDark{24, 24, 24}, kLight{230, 230, 230}, kNotCompared{64, 64, 64};
constexpr Colour kAbove{0, 255, 255};  // above the tolerance: a hue that the map does not have
constexpr std::int64_t kMargin = 8, kBar = 10;

/// From 0 to epsilon.
std::vector<TransferPoint> error_colours(double epsilon) {
  std::vector<TransferPoint> points;
  for (std::size_t i = 0; i < kErrorStops.size(); ++i)
    points.push_back({epsilon * static_cast<double>(i) / 4,
                      {kErrorStops[i][0] / 255, kErrorStops[i][1] / 255, kErrorStops[i][2] / 255},
                      1});
  return points;
}

void put(Image& image, std::int64_t x, std::int64_t y, const Colour& colour) {
  std::copy(colour.begin(), colour.end(), image.rgb.begin() + (y * image.width + x) * 3);
}

/// The slice's own axes as the slice pictures have them: across z, x to the right and y down; otherwise z
/// down.
struct Axes {
  std::size_t across, down, normal;
};
Axes axes_of(int axis) {
  if (axis == 2) return {0, 1, 2};
  return axis == 1 ? Axes{0, 2, 1} : Axes{1, 2, 0};
}

/// Pixels of the slice, as the samples of a grid that is one thin cell thick.
struct PixelGrid {
  Grid grid;
  std::int64_t width = 0, height = 0;
  std::size_t plane = 0;  ///< 0 or 1: which of the grid's two planes is the slice
};

SliceFrame frame_of(const Grid& volume, const ErrorSliceOptions& o, double end,
                    BrickQuantity quantity = BrickQuantity::bound) {
  SliceFrame f;
  f.grid = volume;
  f.axis = o.axis;
  f.position = o.position;
  f.colours = error_colours(end);
  f.quantity = quantity == BrickQuantity::bound   ? "|V − F|"
               : quantity == BrickQuantity::sigma ? "sigma"
                                                  : "|V − F| / sigma";
  if (quantity != BrickQuantity::bound_in_sigma) f.unit = per_unit(volume.unit);
  // What the caption says is known only when the slice is done.
  f.caption_lines = o.width < 400 ? 4 : 2;
  return f;
}

PixelGrid pixel_grid(const Grid& volume, const ErrorSliceOptions& o, const SlicePlace& place) {
  const Axes a = axes_of(o.axis);
  const auto length = [&](std::size_t k) { return static_cast<double>(volume.cells[k]) * volume.spacing[k]; };
  const double lo = volume.origin[a.normal], hi = lo + length(a.normal);
  if (!(o.position >= lo && o.position <= hi))
    throw InputError(
        fmt::format("the slice at {} misses the volume, which reaches from {} to {}", o.position, lo, hi));
  const std::int64_t wide = place.width, high = place.height;
  const double pixel =
      std::max(length(a.across) / static_cast<double>(wide), length(a.down) / static_cast<double>(high));
  const auto count = [&](std::size_t k) {
    return std::max<std::int64_t>(2, std::llround(length(k) / pixel));
  };
  PixelGrid p;
  p.width = std::min(wide, count(a.across));
  p.height = std::min(high, count(a.down));
  p.grid.unit = volume.unit;
  const auto lay = [&](std::size_t k, std::int64_t n) {
    // Pixel centres, half a pixel inside the box.
    p.grid.spacing[k] = length(k) / static_cast<double>(n);
    p.grid.origin[k] = volume.origin[k] + 0.5 * p.grid.spacing[k];
    p.grid.cells[k] = n - 1;
  };
  lay(a.across, p.width);
  lay(a.down, p.height);
  p.grid.cells[a.normal] = 1;
  p.grid.spacing[a.normal] = std::min(pixel, 0.5 * (hi - lo));
  p.plane = o.position + p.grid.spacing[a.normal] > hi ? 1 : 0;
  p.grid.origin[a.normal] = o.position - static_cast<double>(p.plane) * p.grid.spacing[a.normal];
  return p;
}

std::string number(double value) { return number_text(value); }

/// Below pictures of rays: the colours from 0 to what `high` says, and a line of text.
void draw_caption(Image& image, const std::string& high, const std::string& line) {
  constexpr double small = 12;
  const std::string low = "0";
  const std::int64_t top = image.height - kErrorCaption + kMargin;
  const auto above = static_cast<double>(top);
  const std::int64_t left = 2 * kMargin + std::lround(text_width(low, small));
  const std::int64_t right = image.width - 2 * kMargin - std::lround(text_width(high, small));
  draw_text(image, kMargin, above, low, small, kLight);
  draw_text(image, static_cast<double>(right + kMargin), above, high, small, kLight);
  for (std::int64_t x = left; x < right; ++x)
    fill(image, x, top, 1, kBar,
         between_stops(kErrorStops, static_cast<double>(x - left) / static_cast<double>(right - left - 1)));
  const auto room = static_cast<double>(image.width - 2 * kMargin);
  const double size = std::clamp(text_size(image), small, 15.0);
  draw_text(image, kMargin, above + kBar + 7,
            text_width(line, size) <= room ? line : fitted(line, room, small),
            text_width(line, size) <= room ? size : small, kLight);
}

ErrorSlice empty_slice(const SlicePlace& place) {
  ErrorSlice s;
  s.image = blank(place.width, place.height, kDark);
  s.errors = {place.width, place.height, {}};
  s.errors.values.assign(static_cast<std::size_t>(place.width * place.height),
                         std::numeric_limits<float>::quiet_NaN());
  return s;
}

/// The frame, where one is wanted and has room.
void put_in_frame(ErrorSlice& slice, SliceFrame frame, const SlicePlace& place, const ErrorSliceOptions& o,
                  const std::string& line, const std::string& key) {
  if (!place.framed) return;
  frame.caption = {line, key};
  slice.image = framed_slice(frame, slice.image, o.width, o.height);
}

SlicePlace place_of(const SliceFrame& frame, const ErrorSliceOptions& o) {
  if (o.width < 1 || o.height < 1)
    throw InputError(fmt::format("an error slice of {}x{} pixels", o.width, o.height));
  if (o.framed) return slice_place(frame, o.width, o.height);
  return {0, 0, o.width, o.height, false};
}

/// Calls for every pixel with its place in the picture, and with the sample and the point that it shows.
template <class Look>
void for_pixels(const ErrorSlice& result, const PixelGrid& pixels, const Axes& axes, Look&& look) {
  const std::int64_t left = (result.image.width - pixels.width) / 2,
                     top = (result.image.height - pixels.height) / 2;
  for (std::int64_t y = 0; y < pixels.height; ++y)
    for (std::int64_t x = 0; x < pixels.width; ++x) {
      Index3 at{};
      at[axes.across] = x;
      at[axes.down] = y;
      at[axes.normal] = static_cast<std::int64_t>(pixels.plane);
      look(left + x, top + y, at, pixels.grid.position(at));
    }
}

/// Compares every pixel and colours it.
void compare(ErrorSlice& result, const PixelGrid& pixels, const Axes& axes, const Volume& f,
             const ProjectionSet& scan, const MixedVolume& volume, const Certificate& c) {
  const CertifiedRegion region(scan, c.field);
  const Index3 samples = pixels.grid.samples();
  for_pixels(result, pixels, axes, [&](std::int64_t x, std::int64_t y, const Index3& at, const Vec3& point) {
    const double truth = static_cast<double>(
        f.samples[static_cast<std::size_t>((at[2] * samples[1] + at[1]) * samples[0] + at[0])]);
    const bool compared = region.contains(point) && is_inside(c.roi, point) &&
                          (!c.window || (truth >= c.window->first && truth <= c.window->second));
    if (!compared) {
      put(result.image, x, y, kNotCompared);
      return;
    }
    const double error = std::abs(static_cast<double>(sample_at(volume, point)) - truth);
    ++result.pixels;
    result.errors.values[static_cast<std::size_t>(y * result.errors.width + x)] = static_cast<float>(error);
    if (std::isnan(error) || error > result.max_error) {  // a NaN stays the largest
      result.max_error = error;
    }
    const bool within = error <= c.epsilon_abs;
    put(result.image, x, y, within ? between_stops(kErrorStops, error / c.epsilon_abs) : kAbove);
  });
}

}  // namespace

ErrorSlice error_slice(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                       const Certificate& certificate, const ErrorSliceOptions& options,
                       const Progress& progress) {
  require_trusted(device, "measuring against F");
  SliceFrame frame = frame_of(volume.grid, options, certificate.epsilon_abs);
  const std::string difference = fmt::format("|{} − F|", options.volume);
  frame.quantity = difference;
  const SlicePlace place = place_of(frame, options);
  const PixelGrid pixels = pixel_grid(volume.grid, options, place);
  const ReconstructOptions exact{certificate.field, 16,
                                 scan.cone ? Interpolation::linear : Interpolation::cubic};
  const Volume f = reconstruct(device, scan, pixels.grid, exact, progress);
  ErrorSlice result = empty_slice(place);
  compare(result, pixels, axes_of(options.axis), f, scan, volume, certificate);
  put_in_frame(result, frame, place, options,
               fmt::format("Largest {} here = {} = {:.1f} % of {}", difference, number(result.max_error),
                           100 * result.max_error / certificate.epsilon_abs, options.end),
               fmt::format("Grey: not compared. Cyan: above {}, the end of the scale.", options.end));
  return result;
}

namespace {

/// By brick, or of all bricks alike; infinite where nothing is known.
std::vector<float> bounds_of(const MixedVolume& volume, const Certificate& c, bool image3d) {
  if (image3d && !c.total_image3d)
    throw InputError("the certificate says nothing of the image3d sampler; take `sampler` buffer");
  if (!c.brick_totals.empty()) return brick_bounds(c, image3d);
  return std::vector<float>(volume.level.size(),
                            static_cast<float>(image3d ? *c.total_image3d : c.total_buffer));
}

float largest_of(const std::vector<float>& values) {
  float largest = 0;
  for (const float v : values)
    if (std::isfinite(v)) largest = std::max(largest, v);
  return largest;
}

/// A share of the scale's end.
Colour value_colour(float value, double end) {
  if (!std::isfinite(value)) return kNotCompared;
  const auto v = static_cast<double>(value);
  return v <= end ? between_stops(kErrorStops, end > 0 ? v / end : 0) : kAbove;
}

std::string end_text(BrickQuantity quantity, double end) {
  switch (quantity) {
    case BrickQuantity::bound:
      return fmt::format("epsilon {}", number(end));
    case BrickQuantity::sigma:
      return number(end);
    case BrickQuantity::bound_in_sigma:
      return fmt::format("{} sigma", number(end));
  }
  return {};
}

/// What is said of the largest value that a picture shows.
std::string largest_text(BrickQuantity quantity, double end, double largest) {
  switch (quantity) {
    case BrickQuantity::bound:
      return fmt::format("|V − F| ≤ {} = {:.1f} % of epsilon", number(largest), 100 * largest / end);
    case BrickQuantity::sigma:
      return fmt::format("Noise of F (estimated): sigma ≤ {}", number(largest));
    case BrickQuantity::bound_in_sigma:
      return fmt::format("|V − F| ≤ {} sigma of F's noise (estimated)", number(largest));
  }
  return {};
}

}  // namespace

BrickValues brick_values(const MixedVolume& volume, const Certificate& c, bool image3d,
                         BrickQuantity quantity) {
  BrickValues out;
  out.quantity = quantity;
  if (quantity != BrickQuantity::bound && (!c.noise || c.brick_sigma.size() != volume.level.size()))
    throw InputError(
        "the certificate does not know the scan's noise: build it with `epsilon` in sigma, or state "
        "`photons` "
        "or `sigma_p`");
  out.values = quantity == BrickQuantity::sigma ? c.brick_sigma : bounds_of(volume, c, image3d);
  for (std::size_t b = 0; b < out.values.size(); ++b) {
    if (quantity == BrickQuantity::bound_in_sigma) out.values[b] /= c.brick_sigma[b];
    // Of bricks that no view sees sigma is made up.
    if (quantity == BrickQuantity::sigma && !c.brick_totals.empty() && c.brick_totals[b] < 0)
      out.values[b] = std::numeric_limits<float>::infinity();
  }
  out.end = quantity == BrickQuantity::bound ? c.epsilon_abs : static_cast<double>(largest_of(out.values));
  if (quantity == BrickQuantity::bound_in_sigma && c.noise->tolerance_sigmas)
    out.end = *c.noise->tolerance_sigmas;
  return out;
}

ErrorSlice bound_slice(const MixedVolume& volume, const Certificate& c, bool image3d,
                       const ErrorSliceOptions& options, BrickQuantity quantity) {
  const BrickValues shown = brick_values(volume, c, image3d, quantity);
  const Index3 n = volume.bricks();
  const SliceFrame frame = frame_of(volume.grid, options, shown.end, quantity);
  const SlicePlace place = place_of(frame, options);
  const PixelGrid pixels = pixel_grid(volume.grid, options, place);
  const Axes axes = axes_of(options.axis);
  ErrorSlice result = empty_slice(place);
  for_pixels(result, pixels, axes, [&](std::int64_t x, std::int64_t y, const Index3&, const Vec3& point) {
    const Index3 brick = brick_at(volume, point);
    const float value =
        is_inside(c.roi, point)
            ? shown.values[static_cast<std::size_t>((brick[2] * n[1] + brick[1]) * n[0] + brick[0])]
            : std::numeric_limits<float>::infinity();
    put(result.image, x, y, value_colour(value, shown.end));
    if (!std::isfinite(value)) return;
    ++result.pixels;
    result.max_error = std::max(result.max_error, static_cast<double>(value));
    result.errors.values[static_cast<std::size_t>(y * result.errors.width + x)] = value;
  });
  const std::string sampler = quantity == BrickQuantity::sigma
                                  ? ""
                                  : fmt::format(" where covered, sampler {}", image3d ? "image3d" : "buffer");
  put_in_frame(result, frame, place, options, largest_text(quantity, shown.end, result.max_error) + sampler,
               fmt::format("Grey: nothing is known. Cyan: above {}, the end of the scale.",
                           end_text(quantity, shown.end)));
  return result;
}

Image bound_picture(const FloatImage& shown, double end, BrickQuantity quantity) {
  Image image = blank(shown.width, shown.height + kErrorCaption, kDark);
  double most = 0;
  for (std::int64_t i = 0; i < shown.width * shown.height; ++i) {
    const float value = shown.values[static_cast<std::size_t>(i)];
    if (std::isnan(value)) continue;
    put(image, i, 0, value_colour(value, end));
    if (std::isfinite(value)) most = std::max(most, static_cast<double>(value));
  }
  draw_caption(image, end_text(quantity, end), largest_text(quantity, end, most) + " of what is seen");
  return image;
}

}  // namespace vdvr
