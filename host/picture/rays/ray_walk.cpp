#include "host/picture/rays/ray_walk.hpp"

#include <limits>

#include "host/scan/geometry/vectors.hpp"

namespace vdvr {
namespace {

Vec3 unit(const Vec3& a) {
  const double n = std::hypot(a[0], a[1], a[2]);
  return {a[0] / n, a[1] / n, a[2] / n};
}

// Of lengths and values: far above what double precision loses on a ray, far below any bound.
constexpr double inward = 1e-10, rounding = 0x1p-36;

}  // namespace

WorldRay pixel_ray(const Camera& c, std::int64_t width, std::int64_t height, std::int64_t x, std::int64_t y) {
  Vec3 forward{};
  for (std::size_t a = 0; a < 3; ++a) forward[a] = c.focal_point[a] - c.position[a];
  forward = unit(forward);
  const Vec3 right = unit(cross(forward, c.view_up)), up = cross(right, forward);
  const double half = std::tan(c.view_angle_deg * std::acos(-1.0) / 360), w = static_cast<double>(width),
               h = static_cast<double>(height),
               sx = (2 * (static_cast<double>(x) + 0.5) / w - 1) * half * w / h,
               sy = (1 - 2 * (static_cast<double>(y) + 0.5) / h) * half;
  Vec3 direction{};
  for (std::size_t a = 0; a < 3; ++a) direction[a] = forward[a] + sx * right[a] + sy * up[a];
  return {c.position, unit(direction)};
}

RayField::RayField(const MixedVolume& volume, const std::vector<float>& bounds, const Coverage& coverage,
                   const std::optional<std::array<double, 6>>& roi)
    : volume_(volume), bounds_(bounds), bricks_(volume.bricks()), radius_(coverage.inner_radius()) {
  const Grid& g = volume.grid;
  cell_ = std::min({g.spacing[0], g.spacing[1], g.spacing[2]});
  for (std::size_t a = 0; a < 3; ++a) {
    box_[a] = g.origin[a];
    box_[a + 3] = g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a];
    if (!roi) continue;
    box_[a] = std::max(box_[a], (*roi)[a]);
    box_[a + 3] = std::min(box_[a + 3], (*roi)[a + 3]);
  }
  box_[2] = std::max(box_[2], coverage.heights().first);
  box_[5] = std::min(box_[5], coverage.heights().second);
}

RayField::RayField(const MixedVolume& volume, const std::vector<float>& bounds, const Clip& clip)
    : volume_(volume), bounds_(bounds), bricks_(volume.bricks()), axis_(clip.axis), radius_(clip.radius) {
  const Grid& g = volume.grid;
  cell_ = std::min({g.spacing[0], g.spacing[1], g.spacing[2]});
  for (std::size_t a = 0; a < 3; ++a) {
    box_[a] = std::max(clip.low[a], g.origin[a]);
    box_[a + 3] = std::min(clip.high[a], g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a]);
  }
}

std::pair<double, double> RayField::clipped(const WorldRay& ray) const {
  double first = 0, last = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    const double o = ray.origin[a], d = ray.direction[a];
    if (d == 0) {
      if (!(o >= box_[a] && o <= box_[a + 3])) return {0, 0};
      continue;
    }
    const double p = (box_[a] - o) / d, q = (box_[a + 3] - o) / d;
    first = std::max(first, std::min(p, q));
    last = std::min(last, std::max(p, q));
  }
  // The cylinder about the axis: |o + t d| <= radius across z.
  const double ox = ray.origin[0] - axis_[0], oy = ray.origin[1] - axis_[1],
               dd = ray.direction[0] * ray.direction[0] + ray.direction[1] * ray.direction[1],
               od = ox * ray.direction[0] + oy * ray.direction[1],
               rest = ox * ox + oy * oy - radius_ * radius_;
  if (!std::isfinite(radius_)) {
    const double slack = inward * (std::abs(last) + cell_);
    return {first > 0 ? first + slack : first, last - slack};
  }
  if (dd < 1e-24) {
    if (rest > 0) return {0, 0};
  } else {
    const double root = od * od - dd * rest;
    if (!(root > 0)) return {0, 0};
    first = std::max(first, (-od - std::sqrt(root)) / dd);
    last = std::min(last, (-od + std::sqrt(root)) / dd);
  }
  const double slack = inward * (std::abs(last) + radius_);
  return {first > 0 ? first + slack : first, last - slack};
}

RayField::Steps::Steps(const RayField& field, const WorldRay& ray, double first, double last)
    : Steps({field.volume_.grid.origin[0], field.volume_.grid.origin[1], field.volume_.grid.origin[2]},
            {field.volume_.grid.spacing[0] * field.volume_.granularity,
             field.volume_.grid.spacing[1] * field.volume_.granularity,
             field.volume_.grid.spacing[2] * field.volume_.granularity},
            field.bricks_, ray, first, last) {}

RayField::Steps::Steps(const std::array<double, 3>& low, const std::array<double, 3>& side,
                       const Index3& count, const WorldRay& ray, double first, double last)
    : count_(count), low_(low), side_(side), ray_(ray), begin_(first), last_(last) {
  const Vec3 start = ray.at(first);
  for (std::size_t a = 0; a < 3; ++a) {
    const double place = (start[a] - low[a]) / side[a], whole = std::floor(place);
    index_[a] = static_cast<std::int64_t>(whole);
    // On a face, the box that the ray goes into.
    if (ray.direction[a] < 0 && place == whole) --index_[a];
    index_[a] = std::clamp<std::int64_t>(index_[a], 0, count[a] - 1);
    set_exit(a);
  }
}

void RayField::Steps::set_exit(std::size_t a) {
  const double d = ray_.direction[a];
  if (d == 0) {
    exit_[a] = std::numeric_limits<double>::infinity();
    return;
  }
  const double face = low_[a] + static_cast<double>(index_[a] + (d > 0 ? 1 : 0)) * side_[a];
  exit_[a] = (face - ray_.origin[a]) / d;
  // Rounding at the first face must not turn the ray back.
  exit_[a] = std::max(exit_[a], begin_);
}

bool RayField::Steps::next() {
  const std::size_t a =
      exit_[0] <= exit_[1] ? (exit_[0] <= exit_[2] ? 0 : 2) : (exit_[1] <= exit_[2] ? 1 : 2);
  begin_ = end();
  if (!(begin_ < last_)) return false;
  index_[a] += ray_.direction[a] > 0 ? 1 : -1;
  if (index_[a] < 0 || index_[a] >= count_[a]) {
    // Past the last box by rounding alone: it takes what is left.
    index_[a] = std::clamp<std::int64_t>(index_[a], 0, count_[a] - 1);
    exit_[a] = std::numeric_limits<double>::infinity();
    return true;
  }
  set_exit(a);
  return true;
}

std::size_t RayField::number_of(const Index3& brick) const {
  return static_cast<std::size_t>((brick[2] * bricks_[1] + brick[1]) * bricks_[0] + brick[0]);
}

// Corners of the box that the piece spans, by the trilinear polynomial of its cell: its blossom.
RayPiece RayField::piece_of(const BrickSamples& samples, const Index3& cell, const std::array<double, 3>& low,
                            const std::array<double, 3>& side, const WorldRay& ray, double first, double last,
                            std::size_t brick) const {
  std::array<std::array<double, 2>, 3> place{};
  const Vec3 from = ray.at(first), to = ray.at(last);
  for (std::size_t a = 0; a < 3; ++a) {
    const double start = low[a] + static_cast<double>(cell[a]) * side[a];
    place[a] = {std::clamp((from[a] - start) / side[a], 0.0, 1.0),
                std::clamp((to[a] - start) / side[a], 0.0, 1.0)};
  }
  const Index3& end = samples.end();
  std::array<double, 8> corner{};
  double magnitude = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    corner[i] = static_cast<double>(samples(std::min(end[0], cell[0] + static_cast<std::int64_t>(i & 1)),
                                            std::min(end[1], cell[1] + static_cast<std::int64_t>(i >> 1 & 1)),
                                            std::min(end[2], cell[2] + static_cast<std::int64_t>(i >> 2))));
    magnitude = std::max(magnitude, std::abs(corner[i]));
  }
  const auto f = [&](std::size_t x, std::size_t y, std::size_t z) {
    const auto mix = [](double p, double q, double part) { return (1 - part) * p + part * q; };
    const double fx = place[0][x], fy = place[1][y], fz = place[2][z];
    return mix(mix(mix(corner[0], corner[1], fx), mix(corner[2], corner[3], fx), fy),
               mix(mix(corner[4], corner[5], fx), mix(corner[6], corner[7], fx), fy), fz);
  };
  return {first,
          last,
          {f(0, 0, 0), (f(1, 0, 0) + f(0, 1, 0) + f(0, 0, 1)) / 3, (f(1, 1, 0) + f(1, 0, 1) + f(0, 1, 1)) / 3,
           f(1, 1, 1)},
          brick,
          static_cast<double>(bounds_[brick]) + rounding * magnitude};
}

}  // namespace vdvr
