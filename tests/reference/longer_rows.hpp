// Rows of half acquisition and of padding, written from docs/geometry.md: the factor of every column by
// itself, in double precision; and F of a parallel scan of rows that are longer, as a sum over views whose
// weights add to 2 pi.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace vdvr::reference {

/// m at t columns from the axis towards the longer side, h columns from it to the nearer edge.
inline double share_of_view(double t, double h) {
  if (t <= -h) return 0;
  if (t >= h) return 1;
  // The integral of 15/16 (1 - s^2)^2 from -1 to t / h, by Gauss's rule of three points: exact to degree 5.
  const double x = t / h, middle = 0.5 * (x - 1), half = 0.5 * (x + 1), node = std::sqrt(0.6);
  const auto f = [](double s) { return 15.0 / 16 * (1 - s * s) * (1 - s * s); };
  return half * (5.0 / 9 * f(middle - node * half) + 8.0 / 9 * f(middle) + 5.0 / 9 * f(middle + node * half));
}

struct LongerRows {
  std::int64_t before = 0, after = 0;
  std::vector<double> row(const std::vector<double>& p, double center, bool half, int pad) {
    const auto U = static_cast<std::int64_t>(p.size());
    const double below = center + 0.5, above = static_cast<double>(U) - 0.5 - center;
    const double far_side = above >= below ? 1 : -1, h = std::min(below, above);
    std::vector<double> own(p);
    if (half)
      for (std::int64_t i = 0; i < U; ++i)
        own[static_cast<std::size_t>(i)] *=
            2 * share_of_view(far_side * (static_cast<double>(i) - center), h);
    const std::int64_t zeros = half ? static_cast<std::int64_t>(std::ceil(std::abs(above - below))) : 0,
                       more = pad > 0 ? (U + 1) / 2 : 0;
    before = half && far_side > 0 ? zeros : more;
    after = half && far_side < 0 ? zeros : more;
    std::vector<double> out(static_cast<std::size_t>(before + U + after), 0.0);
    std::copy(own.begin(), own.end(), out.begin() + before);
    for (std::int64_t j = 1; j <= more; ++j) {
      const double taper =
          1 - share_of_view(2 * static_cast<double>(j) / static_cast<double>(more + 1) - 1, 1);
      const std::int64_t inwards = pad == 2 ? j - 1 : 0;
      if (!(half && far_side > 0))
        out[static_cast<std::size_t>(before - j)] = taper * own[static_cast<std::size_t>(inwards)];
      if (!(half && far_side < 0))
        out[static_cast<std::size_t>(before + U - 1 + j)] =
            taper * own[static_cast<std::size_t>(U - 1 - inwards)];
    }
    return out;
  }
};

}  // namespace vdvr::reference
