// Registration of mirrored rows: first by whole steps of the mirror's double column, on differences binned to
// 512 columns at most, all overlaps compared by their likelihood; then by interpolation on the rows
// themselves. The search of the whole detector is what Vo et al. (Optics Express 29, 2021, 17849) do for
// half acquisition. Deviation: theirs compares windows of two sinograms by correlation; here overlaps of all
// widths compete, by the likelihood that Gaussian noise gives a correlation over so many samples.
#include "host/scan/center/mirror_registration.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/parallel.hpp"

namespace vdvr::center {
namespace {

struct Window {
  std::int64_t first = 0, last = -1;
};

// Sums over a window of all pairs, the mirrored row interpolated at s - i.
struct Sums {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  double slope = 0;  // of squares of the mirrored row's derivative
  [[nodiscard]] double spread_x() const { return xx - x * x / n; }
  [[nodiscard]] double spread_y() const { return yy - y * y / n; }
  [[nodiscard]] double correlation() const {
    const double spread = spread_x() * spread_y();
    return n > 0 && spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : -1;
  }
};

Sums sums_at(const RowBands& set, const std::vector<Pair>& pairs, double s, const Window& window) {
  const auto whole = static_cast<std::int64_t>(std::floor(s));
  const double f = s - static_cast<double>(whole);
  Sums sums;
  for (const Pair& pair : pairs)
    for (std::int64_t band = 0; band < set.bands; ++band) {
      const double *p = set.row(pair.a, band), *q = set.row(pair.b, band);
      for (std::int64_t i = window.first; i <= window.last; ++i) {
        const double a = p[i], b = cubic_at(q, whole - i, f), d = 0.5 * (q[whole - i + 1] - q[whole - i - 1]);
        sums.x += a, sums.y += b, sums.xx += a * a, sums.yy += b * b, sums.xy += a * b;
        sums.slope += d * d;
      }
      sums.n += static_cast<double>(std::max<std::int64_t>(0, window.last - window.first + 1));
    }
  return sums;
}

// Logarithm of the likelihood ratio of a correlation r of n samples with Gaussian noise, over the pairs.
double likelihood(const RowBands& d, const std::vector<Pair>& pairs, std::int64_t s) {
  const std::int64_t W = d.columns, first = std::max<std::int64_t>(0, s - (W - 1)), last = std::min(W - 1, s);
  double xx = 0, yy = 0, xy = 0;
  for (const Pair& pair : pairs)
    for (std::int64_t band = 0; band < d.bands; ++band) {
      const double *p = d.row(pair.a, band), *q = d.row(pair.b, band);
      for (std::int64_t i = first; i <= last; ++i) {
        const double a = p[i], b = -q[s - i];
        xx += a * a, yy += b * b, xy += a * b;
      }
    }
  // Of rows without noise a thousandth is left by interpolation and edges, wherever they fit.
  constexpr double least_rest = 1e-3;
  if (!(xy > 0) || !(xx > 0) || !(yy > 0)) return 0;
  const double r2 = xy / xx * (xy / yy);
  return -0.5 * static_cast<double>(last - first + 1) * std::log(std::max(1 - r2, least_rest));
}

}  // namespace

double cubic_at(const double* p, std::int64_t j, double f) {
  const double a = p[j - 1], b = p[j], c = p[j + 1], d = p[j + 2];
  return b + 0.5 * f * (c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a)));
}

double rival_of(const std::vector<double>& curve, std::size_t best) {
  const auto valley = [&](std::ptrdiff_t step) {
    auto i = static_cast<std::ptrdiff_t>(best);
    const auto n = static_cast<std::ptrdiff_t>(curve.size());
    constexpr std::ptrdiff_t least = 4;  // a ripple at the top is no valley
    while (i + step >= 0 && i + step < n &&
           (std::abs(i - static_cast<std::ptrdiff_t>(best)) < least ||
            curve[static_cast<std::size_t>(i + step)] <= curve[static_cast<std::size_t>(i)]))
      i += step;
    return i;
  };
  const std::ptrdiff_t low = valley(-1), high = valley(1);
  double most = 0;
  for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(curve.size()); ++i)
    if (i < low || i > high) most = std::max(most, curve[static_cast<std::size_t>(i)]);
  return most;
}

std::optional<CoarseMirror> search_mirror(const RowBands& set, const std::vector<Pair>& pairs) {
  constexpr std::int64_t most_columns = 512, fewest_columns = 8;
  const std::int64_t bin = (set.columns + most_columns - 1) / most_columns;
  if (pairs.empty() || set.columns < 2 * fewest_columns) return std::nullopt;
  const RowBands d = differences(bin > 1 ? binned_columns(set, bin) : set);
  const std::int64_t W = d.columns, overlap = std::max(fewest_columns, W / 24), first = overlap - 1,
                     last = 2 * (W - 1) - first;
  if (last <= first) return std::nullopt;
  std::vector<double> curve(static_cast<std::size_t>(last - first + 1));
  parallel_for(last - first + 1, {}, "",
               [&](std::int64_t i) { curve[static_cast<std::size_t>(i)] = likelihood(d, pairs, first + i); });
  const auto best = static_cast<std::size_t>(std::max_element(curve.begin(), curve.end()) - curve.begin());
  if (!(curve[best] > 0)) return std::nullopt;
  // Difference i lies half a bin after bin i, whose middle is column (i + 1/2) bin - 1/2.
  const double at = static_cast<double>(first) + static_cast<double>(best), b = static_cast<double>(bin);
  return CoarseMirror{b * (at + 2) - 1, rival_of(curve, best) / curve[best]};
}

Mirror refine_mirror(const RowBands& set, const std::vector<Pair>& pairs, double sum, double reach) {
  const std::int64_t U = set.columns;
  // One window for all places, so that none gains by leaving columns out.
  const std::int64_t margin = static_cast<std::int64_t>(std::ceil(reach)) + 3, whole = std::lround(sum);
  const Window window{std::max<std::int64_t>(0, whole - (U - 1) + margin), std::min(U - 1, whole - margin)};
  Mirror found{sum, -1, static_cast<double>(U)};
  if (window.last - window.first < 4) return found;
  const auto correlation = [&](double s) { return sums_at(set, pairs, s, window).correlation(); };
  constexpr double fine = 1.0 / 8;
  const auto steps = static_cast<std::int64_t>(reach / fine);
  std::int64_t at = 0;
  for (std::int64_t k = -steps; k <= steps; ++k)
    if (const double r = correlation(sum + static_cast<double>(k) * fine); r > found.correlation)
      found.correlation = r, at = k;
  if (std::abs(at) == steps) return found;  // the peak lies elsewhere
  found.sum = sum + static_cast<double>(at) * fine;
  found.sum +=
      fine * parabola_peak(correlation(found.sum - fine), found.correlation, correlation(found.sum + fine));
  const Sums sums = sums_at(set, pairs, found.sum, window);
  found.correlation = sums.correlation();
  // Least squares: variance of the residual over the squares of the slope. Neighbours share their noise
  // through the Gaussian, whose autocorrelation is 2 sqrt(pi) columns wide.
  const double residual = sums.spread_y() * std::max(0.0, 1 - found.correlation * found.correlation) / sums.n;
  if (sums.slope > 0) found.deviation = std::sqrt(residual * 2 * std::sqrt(pi) * 2 / sums.slope);
  return found;
}

}  // namespace vdvr::center
