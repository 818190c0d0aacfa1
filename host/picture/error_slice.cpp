#include "vdvr/certified_region.hpp"
#include "vdvr/error_slice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/picture/canvas.hpp"
#include "host/picture/text.hpp"
#include "host/picture/ticks.hpp"
#include "vdvr/error.hpp"
#include "vdvr/reconstruct.hpp"
#include "vdvr/region_of_interest.hpp"
#include "vdvr/slice_frame.hpp"
#include "vdvr/trust.hpp"

namespace vdvr {
namespace {

constexpr Colour kPaper{24, 24, 24}, kInk{230, 230, 230}, kNotCompared{64, 64, 64};
constexpr Colour kAbove{0, 255, 255};  // above the tolerance: a hue that the map does not have
constexpr std::int64_t kMargin = 8, kBar = 10;

/// Dark to light with rising luminance, so that it reads in print too; from 0 to epsilon.
constexpr std::array<std::array<double, 3>, 5> kStops{
    {{0, 0, 8}, {80, 18, 120}, {190, 55, 85}, {248, 142, 10}, {252, 255, 165}}};

Colour error_colour(double e) {
  const double x = std::clamp(e, 0.0, 1.0) * 4;
  const auto i = std::min<std::size_t>(3, static_cast<std::size_t>(x));
  const double t = x - static_cast<double>(i);
  Colour c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = static_cast<std::uint8_t>(std::lround((1 - t) * kStops[i][k] + t * kStops[i + 1][k]));
  return c;
}

std::vector<TransferPoint> error_colours(double epsilon) {
  std::vector<TransferPoint> points;
  for (std::size_t i = 0; i < kStops.size(); ++i)
    points.push_back({epsilon * static_cast<double>(i) / 4,
                      {kStops[i][0] / 255, kStops[i][1] / 255, kStops[i][2] / 255},
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

SliceFrame frame_of(const Grid& volume, const ErrorSliceOptions& o, double epsilon) {
  SliceFrame f;
  f.grid = volume;
  f.axis = o.axis;
  f.position = o.position;
  f.colours = error_colours(epsilon);
  f.quantity = "|V − F|";
  f.unit = per_unit(volume.unit);
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

/// Below pictures of rays: the colours from 0 to epsilon, and a line of text.
void draw_caption(Image& image, double epsilon, const std::string& line) {
  constexpr double small = 12;
  const std::string low = "0", high = fmt::format("epsilon {}", number(epsilon));
  const std::int64_t top = image.height - kErrorCaption + kMargin;
  const auto above = static_cast<double>(top);
  const std::int64_t left = 2 * kMargin + std::lround(text_width(low, small));
  const std::int64_t right = image.width - 2 * kMargin - std::lround(text_width(high, small));
  draw_text(image, kMargin, above, low, small, kInk);
  draw_text(image, static_cast<double>(right + kMargin), above, high, small, kInk);
  for (std::int64_t x = left; x < right; ++x)
    fill(image, x, top, 1, kBar,
         error_colour(static_cast<double>(x - left) / static_cast<double>(right - left - 1)));
  const auto room = static_cast<double>(image.width - 2 * kMargin);
  const double size = std::clamp(text_size(image), small, 15.0);
  draw_text(image, kMargin, above + kBar + 7,
            text_width(line, size) <= room ? line : fitted(line, room, small),
            text_width(line, size) <= room ? size : small, kInk);
}

ErrorSlice empty_slice(const SlicePlace& place) {
  ErrorSlice s;
  s.image = blank(place.width, place.height, kPaper);
  s.errors = {place.width, place.height, {}};
  s.errors.values.assign(static_cast<std::size_t>(place.width * place.height),
                         std::numeric_limits<float>::quiet_NaN());
  return s;
}

/// The frame, where one is wanted and has room.
void put_in_frame(ErrorSlice& slice, SliceFrame frame, const SlicePlace& place, const ErrorSliceOptions& o,
                  const std::string& line) {
  if (!place.framed) return;
  frame.caption = {line, "Grey: not compared. Cyan: above epsilon, the end of the scale."};
  slice.image = framed_slice(frame, slice.image, o.width, o.height);
}

SlicePlace place_of(const SliceFrame& frame, const ErrorSliceOptions& o) {
  if (o.width < 1 || o.height < 1)
    throw InputError(fmt::format("an error slice of {}x{} pixels", o.width, o.height));
  if (o.framed) return slice_place(frame, o.width, o.height);
  return {0, 0, o.width, o.height, false};
}

/// Compares every pixel and colours it.
void compare(ErrorSlice& result, const PixelGrid& pixels, const Axes& axes, const Volume& f,
             const ProjectionSet& scan, const MixedVolume& volume, const Certificate& c) {
  const CertifiedRegion region(scan, c.field);
  const Index3 samples = pixels.grid.samples();
  const std::int64_t left = (result.image.width - pixels.width) / 2;
  const std::int64_t top = (result.image.height - pixels.height) / 2;
  for (std::int64_t y = 0; y < pixels.height; ++y) {
    for (std::int64_t x = 0; x < pixels.width; ++x) {
      Index3 at{};
      at[axes.across] = x;
      at[axes.down] = y;
      at[axes.normal] = static_cast<std::int64_t>(pixels.plane);
      const Vec3 point = pixels.grid.position(at);
      const double truth = static_cast<double>(
          f.samples[static_cast<std::size_t>((at[2] * samples[1] + at[1]) * samples[0] + at[0])]);
      const bool compared = region.contains(point) && is_inside(c.roi, point) &&
                            (!c.window || (truth >= c.window->first && truth <= c.window->second));
      if (!compared) {
        put(result.image, left + x, top + y, kNotCompared);
        continue;
      }
      const double error = std::abs(static_cast<double>(sample_at(volume, point)) - truth);
      ++result.pixels;
      result.errors.values[static_cast<std::size_t>((top + y) * result.errors.width + left + x)] =
          static_cast<float>(error);
      if (std::isnan(error) || error > result.max_error) {  // a NaN stays the largest
        result.max_error = error;
      }
      const bool within = error <= c.epsilon_abs;
      put(result.image, left + x, top + y, within ? error_colour(error / c.epsilon_abs) : kAbove);
    }
  }
}

}  // namespace

ErrorSlice error_slice(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                       const Certificate& certificate, const ErrorSliceOptions& options,
                       const Progress& progress) {
  require_trusted(device, "measuring against F");
  const SliceFrame frame = frame_of(volume.grid, options, certificate.epsilon_abs);
  const SlicePlace place = place_of(frame, options);
  const PixelGrid pixels = pixel_grid(volume.grid, options, place);
  const ReconstructOptions exact{certificate.field, 16,
                                 scan.cone ? Interpolation::linear : Interpolation::cubic};
  const Volume f = reconstruct(device, scan, pixels.grid, exact, progress);
  ErrorSlice result = empty_slice(place);
  compare(result, pixels, axes_of(options.axis), f, scan, volume, certificate);
  put_in_frame(result, frame, place, options,
               fmt::format("Largest |V − F| here = {} = {:.1f} % of epsilon", number(result.max_error),
                           100 * result.max_error / certificate.epsilon_abs));
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

Colour bound_colour(float bound, double epsilon) {
  if (!std::isfinite(bound)) return kNotCompared;
  const auto b = static_cast<double>(bound);
  return b <= epsilon ? error_colour(b / epsilon) : kAbove;
}

std::string share_text(double bound, double epsilon) {
  return fmt::format("|V − F| ≤ {} = {:.1f} % of epsilon", number(bound), 100 * bound / epsilon);
}

}  // namespace

ErrorSlice bound_slice(const MixedVolume& volume, const Certificate& c, bool image3d,
                       const ErrorSliceOptions& options) {
  const std::vector<float> bounds = bounds_of(volume, c, image3d);
  const Index3 n = volume.bricks();
  const SliceFrame frame = frame_of(volume.grid, options, c.epsilon_abs);
  const SlicePlace place = place_of(frame, options);
  const PixelGrid pixels = pixel_grid(volume.grid, options, place);
  const Axes axes = axes_of(options.axis);
  ErrorSlice result = empty_slice(place);
  const std::int64_t left = (result.image.width - pixels.width) / 2;
  const std::int64_t top = (result.image.height - pixels.height) / 2;
  for (std::int64_t y = 0; y < pixels.height; ++y)
    for (std::int64_t x = 0; x < pixels.width; ++x) {
      Index3 at{};
      at[axes.across] = x;
      at[axes.down] = y;
      at[axes.normal] = static_cast<std::int64_t>(pixels.plane);
      const Vec3 point = pixels.grid.position(at);
      const Index3 brick = brick_at(volume, point);
      const float bound =
          is_inside(c.roi, point)
              ? bounds[static_cast<std::size_t>((brick[2] * n[1] + brick[1]) * n[0] + brick[0])]
              : std::numeric_limits<float>::infinity();
      put(result.image, left + x, top + y, bound_colour(bound, c.epsilon_abs));
      if (!std::isfinite(bound)) continue;
      ++result.pixels;
      result.max_error = std::max(result.max_error, static_cast<double>(bound));
      result.errors.values[static_cast<std::size_t>((top + y) * result.errors.width + left + x)] = bound;
    }
  put_in_frame(result, frame, place, options,
               fmt::format("{} where covered, sampler {}", share_text(result.max_error, c.epsilon_abs),
                           image3d ? "image3d" : "buffer"));
  return result;
}

Image bound_picture(const FloatImage& bounds, double epsilon) {
  Image image = blank(bounds.width, bounds.height + kErrorCaption, kPaper);
  double most = 0;
  for (std::int64_t i = 0; i < bounds.width * bounds.height; ++i) {
    const float bound = bounds.values[static_cast<std::size_t>(i)];
    if (std::isnan(bound)) continue;
    put(image, i, 0, bound_colour(bound, epsilon));
    if (std::isfinite(bound)) most = std::max(most, static_cast<double>(bound));
  }
  draw_caption(image, epsilon, share_text(most, epsilon) + " of what is seen");
  return image;
}

}  // namespace vdvr
