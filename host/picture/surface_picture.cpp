#include "vdvr/expert/surface_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/picture/canvas.hpp"

namespace vdvr {
namespace {

constexpr std::uint8_t possible = 1, sure = 2;
constexpr Colour kNone{24, 24, 28}, kSure{225, 222, 205}, kStripe{235, 110, 20}, kBetween{70, 40, 20};

void put(Image& image, std::size_t pixel, const Colour& colour) {
  std::copy(colour.begin(), colour.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(pixel * 3));
}

/// Dark to light, evenly in perceived lightness: matplotlib's viridis at nine stops.
Colour viridis(double fraction) {
  static constexpr std::array<std::array<double, 3>, 9> stops{{{68, 1, 84},
                                                               {71, 44, 122},
                                                               {59, 81, 139},
                                                               {44, 113, 142},
                                                               {33, 144, 141},
                                                               {39, 173, 129},
                                                               {92, 200, 99},
                                                               {170, 220, 50},
                                                               {253, 231, 37}}};
  return between_stops(stops, fraction);
}

// Of stripes that run to the upper right.
bool on_stripe(std::int64_t x, std::int64_t y) {
  constexpr std::int64_t period = 6, width = 2;
  return (x + y) % period < width;
}

template <class Of>
Image drawn(const SurfaceBounds& b, Of&& colour_of) {
  Image image{b.first.width, b.first.height, std::vector<std::uint8_t>(b.hit.size() * 3)};
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      put(image, i, b.hit[i] == possible ? (on_stripe(x, y) ? kStripe : kBetween) : colour_of(i));
    }
  return image;
}

}  // namespace

void hatch_possible(Image& picture, const SurfaceBounds& b) {
  for (std::int64_t y = 0; y < picture.height; ++y)
    for (std::int64_t x = 0; x < picture.width; ++x) {
      const auto i = static_cast<std::size_t>(y * picture.width + x);
      if (b.hit[i] == possible && on_stripe(x, y)) put(picture, i, kStripe);
    }
}

Image class_picture(const SurfaceBounds& b) {
  return drawn(b, [&](std::size_t i) { return b.hit[i] == sure ? kSure : kNone; });
}

FloatImage band_of(const SurfaceBounds& b) {
  FloatImage out{b.first.width, b.first.height, {}, 1};
  for (std::size_t i = 0; i < b.hit.size(); ++i)
    out.values.push_back(b.hit[i] == sure ? b.last.values[i] - b.first.values[i]
                                          : std::numeric_limits<float>::quiet_NaN());
  return out;
}

Image band_picture(const SurfaceBounds& b, double scale) {
  const FloatImage band = band_of(b);
  return drawn(b, [&](std::size_t i) {
    return b.hit[i] == sure ? viridis(static_cast<double>(band.values[i]) / scale) : kNone;
  });
}

double band_quantile(const SurfaceBounds& b, double share) {
  std::vector<float> depths;
  for (const float depth : band_of(b).values)
    if (!std::isnan(depth)) depths.push_back(depth);
  if (depths.empty()) return 0;
  const auto place =
      depths.begin() +
      static_cast<std::ptrdiff_t>(
          std::min(depths.size() - 1, static_cast<std::size_t>(share * static_cast<double>(depths.size()))));
  std::nth_element(depths.begin(), place, depths.end());
  return static_cast<double>(*place);
}

}  // namespace vdvr
