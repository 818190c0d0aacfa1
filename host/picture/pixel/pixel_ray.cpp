#include "host/picture/pixel/pixel_ray.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "host/picture/render/glm_vectors.hpp"

namespace vdvr {

PixelRay pixel_ray(const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y) {
  const glm::dvec3 eye = to_glm(o.camera.position),
                   forward = glm::normalize(to_glm(o.camera.focal_point) - eye),
                   right = glm::normalize(glm::cross(forward, to_glm(o.camera.view_up))),
                   up = glm::cross(right, forward);
  const double tangent = std::tan(glm::radians(o.camera.view_angle_deg) / 2),
               width = static_cast<double>(o.width), height = static_cast<double>(o.height);
  const double across = (2 * (static_cast<double>(x) + 0.5) / width - 1) * tangent * width / height,
               above = (1 - 2 * (static_cast<double>(y) + 0.5) / height) * tangent;
  const glm::dvec3 direction = glm::normalize(forward + across * right + above * up);
  PixelRay s{
      o.camera.position, {direction.x, direction.y, direction.z}, 0, std::numeric_limits<double>::infinity()};
  const Clip clip = o.clip.value_or(Clip{});
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<glm::length_t>(a);
    const double low = std::max(g.origin[a], clip.low[a]),
                 high = std::min(g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a], clip.high[a]);
    const double p = (low - eye[axis]) / direction[axis], q = (high - eye[axis]) / direction[axis];
    s.first = std::max(s.first, std::min(p, q));
    s.last = std::min(s.last, std::max(p, q));
  }
  if (!std::isfinite(clip.radius)) return s;
  const double px = eye.x - clip.axis[0], py = eye.y - clip.axis[1], dx = direction.x, dy = direction.y,
               a = dx * dx + dy * dy, b = px * dx + py * dy,
               under = b * b - a * (px * px + py * py - clip.radius * clip.radius);
  if (!(under > 0)) {
    s.last = s.first;
    return s;
  }
  s.first = std::max(s.first, (-b - std::sqrt(under)) / a);
  s.last = std::min(s.last, (-b + std::sqrt(under)) / a);
  return s;
}

std::array<double, 3> background_of_pixel(const RenderOptions& o, std::int64_t y) {
  const double f = (static_cast<double>(y) + 0.5) / static_cast<double>(o.height);
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) colour[c] = (1 - f) * o.background_top[c] + f * o.background_bottom[c];
  return colour;
}

}  // namespace vdvr
