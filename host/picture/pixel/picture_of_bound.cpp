// The bound of every pixel as a picture with its scale.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/picture/canvas.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/decorate.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t kMargin = 110, kBelow = 44;
constexpr std::array<std::uint8_t, 3> kPaper{24, 24, 24}, kUntested{120, 120, 120};

/// A root spreads the small bounds, which most pixels have.
std::array<double, 3> colour_of(double level, double most) {
  const double x = most > 0 ? 4 * std::sqrt(std::clamp(level / most, 0.0, 1.0)) : 0;
  const auto i = std::min<std::size_t>(3, static_cast<std::size_t>(x));
  std::array<double, 3> c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = kErrorStops[i][k] + (x - static_cast<double>(i)) * (kErrorStops[i + 1][k] - kErrorStops[i][k]);
  return c;
}

ColourBar bar_of(double most) {
  ColourBar bar;
  bar.opacity = false;
  bar.unit = "levels";
  for (int i = 0; i <= 32; ++i) {
    const double level = most * i * i / 1024.0;
    TransferPoint p{level, colour_of(level, most), 1};
    for (double& c : p.rgb) c /= 255;
    bar.points.push_back(p);
  }
  return bar;
}

}  // namespace

Image picture_of_bound(const PictureBound& bound, const PixelBounds& bounds) {
  const std::int64_t width = bound.levels.width, height = bound.levels.height;
  Image image{width + kMargin, height + kBelow, {}};
  for (std::int64_t i = 0; i < image.width * image.height; ++i)
    image.rgb.insert(image.rgb.end(), kPaper.begin(), kPaper.end());
  const double most = std::max(1.0, bound.max);
  for (std::int64_t y = 0; y < height; ++y)
    for (std::int64_t x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      const auto c = colour_of(static_cast<double>(bound.levels.values[i]), most);
      std::uint8_t* to = &image.rgb[3 * static_cast<std::size_t>(y * image.width + x)];
      for (std::size_t k = 0; k < 3; ++k)
        to[k] = bounds.untested[i] != 0 ? kUntested[k] : static_cast<std::uint8_t>(std::lround(c[k]));
    }
  draw_colour_bar(image, bar_of(most), kBelow);
  draw_caption(image,
               {fmt::format("bound of each pixel, levels of 255: mean {:.1f}, worst {:.1f} at ({}, {})",
                            bound.mean, bound.max, bound.worst[0], bound.worst[1])});
  return image;
}

}  // namespace vdvr
