#include "host/field/fdk/region_parts.hpp"

#include <algorithm>

namespace vdvr {
namespace {

constexpr int parts_across = 16, parts_along = 4;

using Polygon = std::vector<std::array<double, 2>>;

// What of a convex polygon lies where sign * (p[axis] - bound) >= 0.
Polygon cut(const Polygon& polygon, std::size_t axis, double bound, double sign) {
  Polygon out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at_p = sign * (p[axis] - bound), at_q = sign * (q[axis] - bound);
    if (at_p >= 0) out.push_back(p);
    if ((at_p < 0) == (at_q < 0)) continue;
    const std::size_t other = 1 - axis;
    std::array<double, 2> corner{};
    corner[axis] = bound;
    corner[other] = p[other] + at_p / (at_p - at_q) * (q[other] - p[other]);
    out.push_back(corner);
  }
  return out;
}

}  // namespace

RegionOutline::RegionOutline(const Coverage& coverage, double reach) : outline_(coverage.outline(reach)) {}

Corners RegionOutline::part(const Vec3& low, const Vec3& high) const {
  Polygon base = outline_;
  for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
    base = cut(base, axis, low[axis], 1);
    base = cut(base, axis, high[axis], -1);
  }
  Corners out;
  for (const auto& [x, y] : base)
    for (const double z : {low[2], high[2]}) out.push_back({x, y, z});
  return out;
}

Corners RegionOutline::whole(const std::pair<double, double>& heights) const {
  Corners out;
  for (const auto& [x, y] : outline_)
    for (const double z : {heights.first, heights.second}) out.push_back({x, y, z});
  return out;
}

std::vector<Corners> RegionOutline::parts(const std::pair<double, double>& heights) const {
  double outer = 0;
  for (const auto& [x, y] : outline_) outer = std::max({outer, std::abs(x), std::abs(y)});
  const double side = 2 * outer / parts_across, tall = (heights.second - heights.first) / parts_along;
  std::vector<Corners> out;
  for (int z = 0; z < parts_along; ++z)
    for (int y = 0; y < parts_across; ++y)
      for (int x = 0; x < parts_across; ++x) {
        const Vec3 low{-outer + x * side, -outer + y * side, heights.first + z * tall};
        Corners corners = part(low, {low[0] + side, low[1] + side, low[2] + tall});
        if (!corners.empty()) out.push_back(std::move(corners));
      }
  return out;
}

}  // namespace vdvr
