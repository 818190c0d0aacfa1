#include "host/picture/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace vdvr {

Image blank(std::int64_t width, std::int64_t height, const Colour& colour) {
  Image image{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height))};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = colour[i % 3];
  return image;
}

void blend(Image& image, std::int64_t x, std::int64_t y, const Colour& c, double part) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height || !(part > 0)) return;
  auto* p = &image.rgb[static_cast<std::size_t>(3 * (y * image.width + x))];
  for (std::size_t i = 0; i < 3; ++i)
    p[i] = static_cast<std::uint8_t>(std::lround((1 - part) * p[i] + part * c[i]));
}

void fill(Image& image, std::int64_t x, std::int64_t y, std::int64_t w, std::int64_t h, const Colour& c,
          double part) {
  const std::int64_t right = std::min(x + w, image.width), below = std::min(y + h, image.height);
  for (std::int64_t j = std::max<std::int64_t>(0, y); j < below; ++j)
    for (std::int64_t i = std::max<std::int64_t>(0, x); i < right; ++i) blend(image, i, j, c, part);
}

void frame(Image& image, std::int64_t x, std::int64_t y, std::int64_t w, std::int64_t h, const Colour& c) {
  fill(image, x, y, w, 1, c);
  fill(image, x, y + h - 1, w, 1, c);
  fill(image, x, y, 1, h, c);
  fill(image, x + w - 1, y, 1, h, c);
}

void draw_line(Image& image, glm::dvec2 a, glm::dvec2 b, double width, const Colour& c,
               const std::function<double(std::int64_t, std::int64_t)>& part) {
  // Clip generously to the picture first: an end may lie far outside.
  const glm::dvec2 lo{-8, -8},
      hi{static_cast<double>(image.width) + 8, static_cast<double>(image.height) + 8};
  double t0 = 0, t1 = 1;
  const glm::dvec2 d = b - a;
  for (int k = 0; k < 2; ++k) {
    if (d[k] == 0) {
      if (a[k] < lo[k] || a[k] > hi[k]) return;
      continue;
    }
    const double u = (lo[k] - a[k]) / d[k], v = (hi[k] - a[k]) / d[k];
    t0 = std::max(t0, std::min(u, v));
    t1 = std::min(t1, std::max(u, v));
  }
  if (!(t0 <= t1)) return;
  const glm::dvec2 p = a + t0 * d, q = a + t1 * d, e = q - p;
  const double length2 = glm::dot(e, e), reach = width / 2 + 1;
  // Column by column, or row by row where it is steep: pixels near the line only.
  const int along = std::abs(e.x) >= std::abs(e.y) ? 0 : 1, across = 1 - along;
  const double from = std::min(p[along], q[along]) - reach, to = std::max(p[along], q[along]) + reach;
  for (auto i = static_cast<std::int64_t>(std::floor(from)); i <= static_cast<std::int64_t>(std::ceil(to));
       ++i) {
    const double t =
        e[along] != 0 ? std::clamp((static_cast<double>(i) + 0.5 - p[along]) / e[along], 0.0, 1.0) : 0;
    const double middle = p[across] + t * e[across];
    for (auto j = static_cast<std::int64_t>(std::floor(middle - 2 * reach));
         j <= static_cast<std::int64_t>(std::ceil(middle + 2 * reach)); ++j) {
      const std::int64_t x = along == 0 ? i : j, y = along == 0 ? j : i;
      const glm::dvec2 pixel{static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5};
      const double s = length2 > 0 ? std::clamp(glm::dot(pixel - p, e) / length2, 0.0, 1.0) : 0;
      const double away = glm::distance(pixel, p + s * e);
      blend(image, x, y, c, std::clamp(width / 2 + 0.5 - away, 0.0, 1.0) * part(x, y));
    }
  }
}

void paste(Image& image, std::int64_t x, std::int64_t y, const Image& source) {
  const std::int64_t left = std::max<std::int64_t>(0, -x), right = std::min(source.width, image.width - x);
  if (left >= right) return;
  for (std::int64_t j = std::max<std::int64_t>(0, -y); j < std::min(source.height, image.height - y); ++j)
    std::copy(source.rgb.begin() + 3 * (j * source.width + left),
              source.rgb.begin() + 3 * (j * source.width + right),
              image.rgb.begin() + 3 * ((y + j) * image.width + x + left));
}

}  // namespace vdvr
