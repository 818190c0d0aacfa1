// Opposite views, registered.
#include "host/scan/center/opposite_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/scan/center/mirror_registration.hpp"

namespace vdvr::center {
namespace {

struct Opposite {
  Pair pair;
  double angle = 0, mismatch = 0;  // the second view is at angle + 180 degrees + mismatch, which is positive
};

// Calls `take` for all pairs of views that are opposite to within `tolerance`.
template <typename Take>
void for_opposite_views(const std::vector<double>& theta, double tolerance, const Take& take) {
  for (std::size_t i = 0; i < theta.size(); ++i)
    for (std::size_t j = i + 1; j < theta.size(); ++j) {
      const double mismatch = std::remainder(theta[j] - theta[i] - pi, 2 * pi);
      if (std::abs(mismatch) > tolerance) continue;
      const auto a = static_cast<std::int64_t>(i), b = static_cast<std::int64_t>(j);
      if (mismatch < 0) take(Opposite{{b, a}, theta[j], -mismatch});
      else take(Opposite{{a, b}, theta[i], mismatch});
    }
}

// The best-matching opposite views within half a step, spread evenly over the angles at which they begin.
std::vector<Opposite> opposite_views(const std::vector<double>& theta, std::int64_t most) {
  const double step = median_step(theta);
  constexpr double slack = 1 + 1e-6;  // an odd number of views over a turn is off by half a step to rounding
  // Beyond 5 degrees views are too unlike to be compared.
  const double most_mismatch = std::min(step / 2 * slack, pi / 36);
  double best = most_mismatch;
  for_opposite_views(theta, best, [&](const Opposite& o) { best = std::min(best, o.mismatch); });
  std::vector<Opposite> pairs;
  for_opposite_views(theta, std::min(std::max(best * slack, step / 20), most_mismatch),
                     [&](const Opposite& o) { pairs.push_back(o); });
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Opposite& a, const Opposite& b) { return a.angle < b.angle; });
  const auto count = static_cast<std::int64_t>(pairs.size());
  if (count <= most) return pairs;
  std::vector<Opposite> spread;
  for (std::int64_t k = 0; k < most; ++k) spread.push_back(pairs[static_cast<std::size_t>(k * count / most)]);
  return spread;
}

// A mismatch m moves what lies at depth s by m s: mirrors of pairs that begin at opposite angles are off to
// opposite sides, and of a whole turn nothing is left. What is left of fewer pairs, in radians.
double leaning(const std::vector<Opposite>& pairs) {
  double x = 0, y = 0;
  for (const Opposite& o : pairs) {
    x += o.mismatch * std::cos(o.angle);
    y += o.mismatch * std::sin(o.angle);
  }
  return std::hypot(x, y) / static_cast<double>(pairs.size());
}

}  // namespace

std::optional<OppositeViews> from_opposite_views(const ProjectionSet& scan) {
  constexpr std::int64_t most_pairs = 32, most_bands = 16;
  const auto chosen = opposite_views(scan.geometry.theta_rad, most_pairs);
  if (chosen.empty()) return std::nullopt;
  std::vector<Pair> pairs;
  std::vector<std::int64_t> views;
  for (const Opposite& o : chosen) {
    pairs.push_back({static_cast<std::int64_t>(views.size()), static_cast<std::int64_t>(views.size()) + 1});
    views.insert(views.end(), {o.pair.a, o.pair.b});
  }
  // As if the object's middle lay an eighth of the detector before the axis.
  const double lean = leaning(chosen) * static_cast<double>(scan.geometry.columns) / 8;
  RowBands set = average_rows(scan, views, most_bands);
  smooth_columns(set);
  const auto coarse = search_mirror(set, pairs);
  if (!coarse) return std::nullopt;
  // Half a step of the coarse search to either side, and as much again.
  const double reach = 2 * std::ceil(static_cast<double>(set.columns) / 512) + 1;
  const auto witness = [&](const std::vector<Pair>& of, double sum) {
    const Mirror m = refine_mirror(set, of, sum, reach);
    return CenterWitness{m.sum / 2, std::hypot(m.deviation, lean) / 2,
                         m.correlation > 0 ? m.correlation * m.correlation : 0,
                         fmt::format("{} pair{} of opposite views", of.size(), of.size() == 1 ? "" : "s")};
  };
  OppositeViews found{witness(pairs, coarse->sum), {}, coarse->rival};
  if (pairs.size() > 1)
    for (const std::size_t half : {0u, 1u}) {
      std::vector<Pair> every_other;
      for (std::size_t i = half; i < pairs.size(); i += 2) every_other.push_back(pairs[i]);
      found.halves.push_back(witness(every_other, 2 * found.all.center));
    }
  return found;
}

}  // namespace vdvr::center
