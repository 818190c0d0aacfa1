#include "host/verify/residual/bounds_along.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {

BoundsAlong::BoundsAlong(const MixedVolume& volume, const std::vector<float>& bounds, double z) {
  const Index3 n = volume.bricks();
  const Grid& g = volume.grid;
  const double brick = static_cast<double>(volume.granularity);
  for (std::size_t a = 0; a < 2; ++a) {
    origin_[a] = g.origin[a];
    side_[a] = g.spacing[a] * brick;
    bricks_[a] = n[a];
    end_[a] = static_cast<double>(g.cells[a]) / brick;
  }
  // A height on the face of two bricks is in both.
  const double at = (z - g.origin[2]) / (g.spacing[2] * brick), slack = 1e-9,
               top = static_cast<double>(g.cells[2]) / brick;
  if (!(at >= -slack && at <= top + slack)) return;
  bound_.assign(static_cast<std::size_t>(n[0] * n[1]), 0.0);
  for (std::int64_t bz = 0; bz < n[2]; ++bz)
    if (at >= static_cast<double>(bz) - slack && at <= static_cast<double>(bz + 1) + slack)
      for (std::size_t i = 0; i < bound_.size(); ++i) {
        const float e = bounds[static_cast<std::size_t>(bz) * bound_.size() + i];
        if (std::isfinite(e)) bound_[i] = std::max(bound_[i], static_cast<double>(e));
      }
}

double BoundsAlong::operator()(double cosine, double sine, double u, double first, double last) const {
  if (bound_.empty() || !(first < last)) return 0;
  // In bricks along x and y, at s = 0 and per unit of s.
  const std::array<double, 2> start{(u * cosine - origin_[0]) / side_[0], (u * sine - origin_[1]) / side_[1]},
      slope{-sine / side_[0], cosine / side_[1]};
  std::vector<double> cuts{first, last};
  for (std::size_t a = 0; a < 2; ++a) {
    if (std::abs(slope[a]) * (last - first) < 1e-12) continue;
    const double from = start[a] + first * slope[a], to = start[a] + last * slope[a],
                 lowest = std::max(0.0, std::ceil(std::min(from, to))),
                 highest = std::min(static_cast<double>(bricks_[a]), std::floor(std::max(from, to)));
    for (double face = lowest; face <= highest; ++face) cuts.push_back((face - start[a]) / slope[a]);
    cuts.push_back((end_[a] - start[a]) / slope[a]);
  }
  std::sort(cuts.begin(), cuts.end());
  double sum = 0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double a = std::max(first, cuts[i]), b = std::min(last, cuts[i + 1]);
    if (!(a < b)) continue;
    const double middle = 0.5 * (a + b), x = start[0] + middle * slope[0], y = start[1] + middle * slope[1];
    if (!(x >= 0 && y >= 0 && x <= end_[0] && y <= end_[1])) continue;
    const auto bx = std::min(bricks_[0] - 1, static_cast<std::int64_t>(x)),
               by = std::min(bricks_[1] - 1, static_cast<std::int64_t>(y));
    sum += (b - a) * bound_[static_cast<std::size_t>(by * bricks_[0] + bx)];
  }
  // Where faces are crossed is rounded.
  return sum * (1 + 1e-9);
}

}  // namespace vdvr
