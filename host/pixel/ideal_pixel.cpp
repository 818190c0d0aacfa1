// A pixel of the ideal picture from F itself, in double precision. Called by the verify command.
#include <algorithm>
#include <cmath>

#include "host/pixel/pixel_ray.hpp"
#include "host/rays/light_range.hpp"
#include "vdvr/certify_picture.hpp"

namespace vdvr {
namespace {

/// Back to front over values in the middles of steps of `length` base cells.
std::array<double, 3> seen(const std::vector<double>& values, std::size_t stride, double length,
                           const RenderOptions& o, std::int64_t y) {
  std::array<double, 3> colour = background_of_pixel(o, y);
  for (std::size_t i = values.size(); i-- > 0;) {
    if (i % stride != stride / 2) continue;
    const TransferPoint p = transfer_at(o.transfer.points, values[i]);
    const double passes = std::pow(1 - p.opacity, length * static_cast<double>(stride));
    for (std::size_t c = 0; c < 3; ++c) colour[c] = p.rgb[c] + (colour[c] - p.rgb[c]) * passes;
  }
  return colour;
}

}  // namespace

RaySteps steps_of_pixel(const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y, double step) {
  const PixelRay s = pixel_ray(o, g, x, y);
  RaySteps steps{s.from, s.direction, s.first, s.last, 0, {}};
  if (!(s.first < s.last)) return steps;
  const double unit = *std::min_element(g.spacing.begin(), g.spacing.end());
  // Every third middle is a middle of steps three times as long.
  const auto count = 3 * static_cast<std::size_t>(std::ceil((s.last - s.first) / (3 * step * unit)));
  steps.length = (s.last - s.first) / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i)
    steps.points.push_back(s.at(s.first + (static_cast<double>(i) + 0.5) * steps.length));
  return steps;
}

IdealPixel ideal_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                       const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y, double step) {
  const RaySteps s = steps_of_pixel(o, g, x, y, step);
  const std::vector<Vec3>& points = s.points;
  const double unit = *std::min_element(g.spacing.begin(), g.spacing.end()), h = s.length;
  IdealPixel pixel;
  const std::vector<double> values = points.empty() ? std::vector<double>{} : field(points);
  pixel.rgb = seen(values, 1, h / unit, o, y);
  pixel.points = points.size();
  const auto coarse = seen(values, 3, h / unit, o, y);
  for (std::size_t c = 0; c < 3; ++c)
    pixel.quadrature = std::max(pixel.quadrature, std::abs(coarse[c] - pixel.rgb[c]));
  return pixel;
}

namespace {

/// As seen(), of values and of light in the middles of steps.
std::array<double, 3> seen_lit(const std::vector<double>& values, const std::vector<Light>& lights,
                               std::size_t stride, double length, const RenderOptions& o, std::int64_t y) {
  std::array<double, 3> colour = background_of_pixel(o, y);
  for (std::size_t i = values.size(); i-- > 0;) {
    if (i % stride != stride / 2) continue;
    const TransferPoint p = transfer_at(o.transfer.points, values[i]);
    const Light& l = lights[i];
    const double passes = std::pow(1 - p.opacity, length * static_cast<double>(stride));
    for (std::size_t c = 0; c < 3; ++c) {
      const double own = lit_colour(p.rgb[c], l.strength, l.diffuse, l.highlight);
      colour[c] = own + (colour[c] - own) * passes;
    }
  }
  return colour;
}

}  // namespace

IdealPixel ideal_lit_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                           const std::pair<float, float>& value_range, const RenderOptions& o, const Grid& g,
                           std::int64_t x, std::int64_t y, double step) {
  const RaySteps s = steps_of_pixel(o, g, x, y, step);
  IdealPixel pixel;
  pixel.points = s.points.size();
  const double unit = *std::min_element(g.spacing.begin(), g.spacing.end());
  std::vector<double> values;
  std::vector<Light> lights;
  if (!s.points.empty()) {
    values = field(s.points);
    std::vector<Vec3> gradients(s.points.size());
    for (std::size_t a = 0; a < 3; ++a) {
      std::vector<Vec3> low = s.points, high = s.points;
      for (std::size_t i = 0; i < low.size(); ++i) {
        low[i][a] -= 0.5 * g.spacing[a];
        high[i][a] += 0.5 * g.spacing[a];
      }
      const std::vector<double> below = field(low), above = field(high);
      for (std::size_t i = 0; i < low.size(); ++i)
        gradients[i][a] = (above[i] - below[i]) * unit / g.spacing[a];
    }
    const Lights light(o, full_gradient(value_range));
    for (const Vec3& gradient : gradients) lights.push_back(light.at(gradient, s.direction));
  }
  pixel.rgb = seen_lit(values, lights, 1, s.length / unit, o, y);
  const auto coarse = seen_lit(values, lights, 3, s.length / unit, o, y);
  for (std::size_t c = 0; c < 3; ++c)
    pixel.quadrature = std::max(pixel.quadrature, std::abs(coarse[c] - pixel.rgb[c]));
  return pixel;
}

}  // namespace vdvr
