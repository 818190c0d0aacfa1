#include "host/verify/residual/covered_chords.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/parallel.hpp"
#include "host/field/fbp/coverage.hpp"

namespace vdvr {

CoveredChords covered_chords(const ParallelGeometry& g) {
  const auto columns = static_cast<std::size_t>(g.columns), views = g.theta_rad.size();
  CoveredChords out;
  std::vector<std::pair<double, double>> strips;  // of t
  for (std::size_t k = 0; k < views; ++k) {
    for (std::size_t i = 0; i < columns; ++i)
      out.u.push_back((static_cast<double>(i) - g.center_of_view(k)) * g.pitch_u);
    ParallelGeometry one = g;
    if (!g.column_shift.empty()) one.column_shift = {g.column_shift[k]};
    const auto [below, above] = seen_columns(one);
    strips.emplace_back(-below * g.pitch_u, above * g.pitch_u);
  }
  out.first.assign(views * columns, -INFINITY);
  out.last.assign(views * columns, INFINITY);
  parallel_for(g.views(), {}, "chords", [&](std::int64_t view) {
    const auto j = static_cast<std::size_t>(view);
    double *first = out.first.data() + j * columns, *last = out.last.data() + j * columns;
    for (std::size_t k = 0; k < views; ++k) {
      const auto [low, high] = strips[k];
      const double turn = g.theta_rad[k] - g.theta_rad[j], c = std::cos(turn), s = std::sin(turn);
      // Rays of this view, or seen from behind: they lie in its strip or beside it, whatever s.
      const bool along = std::abs(s) < 1e-12;
      for (std::size_t i = 0; i < columns; ++i) {
        const double at = out.u[j * columns + i] * c;
        if (along) {
          if (!(at >= low && at <= high)) last[i] = -INFINITY;
          continue;
        }
        const double a = (low - at) / s, b = (high - at) / s;
        first[i] = std::max(first[i], std::min(a, b));
        last[i] = std::min(last[i], std::max(a, b));
      }
    }
    // Views in one direction bound nothing along their rays.
    for (std::size_t i = 0; i < columns; ++i)
      if (!(std::isfinite(first[i]) && std::isfinite(last[i]) && first[i] < last[i])) first[i] = last[i] = 0;
  });
  return out;
}

}  // namespace vdvr
