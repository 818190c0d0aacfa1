// A pixel of the ideal picture from F itself, in double precision.
#include <algorithm>
#include <cmath>

#include "host/picture/pixel/pixel_ray.hpp"
#include "host/picture/rays/light_range.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {
namespace {

/// Back to front over values, and light where there is any, in the middles of steps of `length` base cells.
std::array<double, 3> seen(const std::vector<double>& values, const std::vector<Light>& lights,
                           std::size_t stride, double length, const RenderOptions& o, std::int64_t y) {
  std::array<double, 3> colour = background_of_pixel(o, y);
  for (std::size_t i = values.size(); i-- > 0;) {
    if (i % stride != stride / 2) continue;
    const TransferPoint p = transfer_at(o.transfer.points, values[i]);
    const double passes = std::pow(1 - p.opacity, length * static_cast<double>(stride));
    for (std::size_t c = 0; c < 3; ++c) {
      const double own =
          lights.empty() ? p.rgb[c]
                         : lit_colour(p.rgb[c], lights[i].strength, lights[i].diffuse, lights[i].highlight);
      colour[c] = own + (colour[c] - own) * passes;
    }
  }
  return colour;
}

IdealPixel summed(const RaySteps& s, const std::vector<double>& values, const std::vector<Light>& lights,
                  const RenderOptions& o, const Grid& g, std::int64_t y) {
  IdealPixel pixel;
  pixel.points = s.points.size();
  pixel.rgb = seen(values, lights, 1, s.length / length_unit(g), o, y);
  const auto coarse = seen(values, lights, 3, s.length / length_unit(g), o, y);
  for (std::size_t c = 0; c < 3; ++c)
    pixel.quadrature = std::max(pixel.quadrature, std::abs(coarse[c] - pixel.rgb[c]));
  return pixel;
}

using Field = std::function<std::vector<double>(const std::vector<Vec3>&)>;

/// Per length along the world axes: differences over one base cell.
std::vector<Vec3> differences(const Field& field, const std::vector<Vec3>& points, const Grid& g) {
  std::vector<Vec3> gradients(points.size());
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<Vec3> low = points, high = points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      low[i][a] -= 0.5 * g.spacing[a];
      high[i][a] += 0.5 * g.spacing[a];
    }
    const std::vector<double> below = field(low), above = field(high);
    for (std::size_t i = 0; i < points.size(); ++i)
      gradients[i][a] = (above[i] - below[i]) * length_unit(g) / g.spacing[a];
  }
  return gradients;
}

}  // namespace

RaySteps steps_of_pixel(const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y, double step) {
  const PixelRay s = pixel_ray(o, g, x, y);
  RaySteps steps{s.from, s.direction, s.first, s.last, 0, {}};
  if (!(s.first < s.last)) return steps;
  const double unit = length_unit(g);
  // Every third middle is a middle of steps three times as long.
  const auto count = 3 * static_cast<std::size_t>(std::ceil((s.last - s.first) / (3 * step * unit)));
  steps.length = (s.last - s.first) / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i)
    steps.points.push_back(s.at(s.first + (static_cast<double>(i) + 0.5) * steps.length));
  return steps;
}

IdealPixel ideal_pixel(const Field& field, const RenderOptions& o, const Grid& g, std::int64_t x,
                       std::int64_t y, double step) {
  const RaySteps s = steps_of_pixel(o, g, x, y, step);
  return summed(s, s.points.empty() ? std::vector<double>{} : field(s.points), {}, o, g, y);
}

IdealPixel ideal_lit_pixel(const Field& field, const std::pair<float, float>& value_range,
                           const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y,
                           double step) {
  const RaySteps s = steps_of_pixel(o, g, x, y, step);
  if (s.points.empty()) return summed(s, {}, {}, o, g, y);
  const Lights light(o, full_gradient(value_range));
  std::vector<Light> lights;
  for (const Vec3& gradient : differences(field, s.points, g))
    lights.push_back(light.at(gradient, s.direction));
  return summed(s, field(s.points), lights, o, g, y);
}

}  // namespace vdvr
