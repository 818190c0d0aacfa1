// A pixel of the ideal picture from F itself, in double precision. Called by the verify command.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "host/render/glm_vectors.hpp"
#include "vdvr/certify_picture.hpp"

namespace vdvr {
namespace {

struct Segment {
  glm::dvec3 from, direction;
  double first = 0, last = 0;
};

/// The ray of a pixel inside the grid and the clip.
Segment segment_of(const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y) {
  const glm::dvec3 eye = to_glm(o.camera.position),
                   forward = glm::normalize(to_glm(o.camera.focal_point) - eye),
                   right = glm::normalize(glm::cross(forward, to_glm(o.camera.view_up))),
                   up = glm::cross(right, forward);
  const double tangent = std::tan(glm::radians(o.camera.view_angle_deg) / 2),
               width = static_cast<double>(o.width), height = static_cast<double>(o.height);
  const double across = (2 * (static_cast<double>(x) + 0.5) / width - 1) * tangent * width / height,
               above = (1 - 2 * (static_cast<double>(y) + 0.5) / height) * tangent;
  Segment s{eye, glm::normalize(forward + across * right + above * up), 0,
            std::numeric_limits<double>::infinity()};
  const Clip clip = o.clip.value_or(Clip{});
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<glm::length_t>(a);
    const double low = std::max(g.origin[a], clip.low[a]),
                 high = std::min(g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a], clip.high[a]);
    const double p = (low - eye[axis]) / s.direction[axis], q = (high - eye[axis]) / s.direction[axis];
    s.first = std::max(s.first, std::min(p, q));
    s.last = std::min(s.last, std::max(p, q));
  }
  if (!std::isfinite(clip.radius)) return s;
  const double px = eye.x - clip.axis[0], py = eye.y - clip.axis[1], dx = s.direction.x, dy = s.direction.y,
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

/// Back to front over values in the middles of steps of `length` base cells.
std::array<double, 3> seen(const std::vector<double>& values, std::size_t stride, double length,
                           const RenderOptions& o, std::int64_t y) {
  const double f = (static_cast<double>(y) + 0.5) / static_cast<double>(o.height);
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) colour[c] = (1 - f) * o.background_top[c] + f * o.background_bottom[c];
  for (std::size_t i = values.size(); i-- > 0;) {
    if (i % stride != stride / 2) continue;
    const TransferPoint p = transfer_at(o.transfer.points, values[i]);
    const double passes = std::pow(1 - p.opacity, length * static_cast<double>(stride));
    for (std::size_t c = 0; c < 3; ++c) colour[c] = p.rgb[c] + (colour[c] - p.rgb[c]) * passes;
  }
  return colour;
}

}  // namespace

IdealPixel ideal_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                       const RenderOptions& o, const Grid& g, std::int64_t x, std::int64_t y, double step) {
  const Segment s = segment_of(o, g, x, y);
  const double unit = *std::min_element(g.spacing.begin(), g.spacing.end());
  IdealPixel pixel;
  std::vector<Vec3> points;
  double h = 0;
  if (s.first < s.last) {
    // Thrice an odd number would do as well: every third middle is a middle of steps three times as long.
    const auto count = 3 * static_cast<std::size_t>(std::ceil((s.last - s.first) / (3 * step * unit)));
    h = (s.last - s.first) / static_cast<double>(count);
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 p = s.from + s.direction * (s.first + (static_cast<double>(i) + 0.5) * h);
      points.push_back({p.x, p.y, p.z});
    }
  }
  const std::vector<double> values = points.empty() ? std::vector<double>{} : field(points);
  pixel.rgb = seen(values, 1, h / unit, o, y);
  pixel.points = points.size();
  const auto coarse = seen(values, 3, h / unit, o, y);
  for (std::size_t c = 0; c < 3; ++c)
    pixel.quadrature = std::max(pixel.quadrature, std::abs(coarse[c] - pixel.rgb[c]));
  return pixel;
}

}  // namespace vdvr
