// Opposite rays, correlated.
#include "host/scan/center/opposite_rays.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/parallel.hpp"
#include "host/scan/center/mirror_registration.hpp"
#include "host/scan/center/row_bands.hpp"

namespace vdvr::center {
namespace {

// One row of all views, in order of angle modulo a turn.
struct Orbit {
  RowBands rows;
  std::vector<double> angle;  // in [0, 2 pi), rising
  double pitch_over_distance = 0;
};

Orbit orbit_of(const ProjectionSet& scan) {
  const auto& g = scan.geometry;
  double row = 0, ratio = 0;
  for (const ViewMatrix& m : scan.cone->views) {
    const ConeView view = cone_view(m);
    row += view.row / static_cast<double>(g.views());
    ratio += view.pitch_u / view.source_to_axis / static_cast<double>(g.views());
  }
  const auto v =
      static_cast<std::int64_t>(std::lround(std::clamp(row, 0.0, static_cast<double>(g.rows - 1))));
  std::vector<double> turned;
  for (const double t : g.theta_rad) turned.push_back(t - 2 * pi * std::floor(t / (2 * pi)));
  Orbit orbit{{g.views(), 1, g.columns, {}}, {}, ratio};
  for (const std::int64_t k : by_angle(turned)) {
    orbit.angle.push_back(turned[static_cast<std::size_t>(k)]);
    const float* from = scan.data.data() + (k * g.rows + v) * g.columns;
    orbit.rows.data.insert(orbit.rows.data.end(), from, from + g.columns);
  }
  smooth_columns(orbit.rows);
  return orbit;
}

// Linear between the two nearest angles, cubic between columns; nothing beyond the detector.
std::optional<double> sample(const Orbit& orbit, double angle, double column) {
  const auto K = static_cast<std::int64_t>(orbit.angle.size());
  const auto j = static_cast<std::int64_t>(std::floor(column));
  if (j < 1 || j + 2 >= orbit.rows.columns) return std::nullopt;
  angle -= 2 * pi * std::floor(angle / (2 * pi));
  const std::int64_t above =
      std::upper_bound(orbit.angle.begin(), orbit.angle.end(), angle) - orbit.angle.begin();
  const std::int64_t a = (above + K - 1) % K, b = above % K;
  const double from = orbit.angle[static_cast<std::size_t>(a)] - (above == 0 ? 2 * pi : 0),
               to = orbit.angle[static_cast<std::size_t>(b)] + (above == K ? 2 * pi : 0);
  const double part = to > from ? (angle - from) / (to - from) : 0, f = column - static_cast<double>(j);
  return (1 - part) * cubic_at(orbit.rows.row(a, 0), j, f) + part * cubic_at(orbit.rows.row(b, 0), j, f);
}

struct Fit {
  double likelihood = 0, correlation = -1;
};

// Of differences of neighbouring columns, as in mirror_registration.cpp.
Fit fit_at(const Orbit& orbit, const std::vector<std::int64_t>& views, double c) {
  double n = 0, xx = 0, yy = 0, xy = 0;
  for (const std::int64_t k : views) {
    const double* p = orbit.rows.row(k, 0);
    std::optional<double> last;
    for (std::int64_t i = 0; i < orbit.rows.columns; ++i) {
      const double gamma = std::atan((static_cast<double>(i) - c) * orbit.pitch_over_distance);
      const auto b = sample(orbit, orbit.angle[static_cast<std::size_t>(k)] + pi - 2 * gamma,
                            2 * c - static_cast<double>(i));
      if (b && last) {
        const double x = p[i] - p[i - 1], y = *b - *last;
        xx += x * x, yy += y * y, xy += x * y, ++n;
      }
      last = b;
    }
  }
  if (!(n > 0) || !(xx > 0) || !(yy > 0)) return {};
  Fit fit;
  fit.correlation = xy / std::sqrt(xx * yy);
  const double rest = std::max(1 - fit.correlation * fit.correlation, 1e-3);
  fit.likelihood = fit.correlation > 0 ? -0.5 * n / static_cast<double>(views.size()) * std::log(rest) : 0;
  return fit;
}

// The peak near c, and how far off noise may have put it: a correlation r over n samples falls by half of
// (1 - r^2) / n at one standard deviation, n counting what the Gaussian leaves independent.
CenterWitness peak_near(const Orbit& orbit, const std::vector<std::int64_t>& views, double c) {
  constexpr double fine = 1.0 / 8;
  constexpr int steps = 8;
  CenterWitness w{c, static_cast<double>(orbit.rows.columns), 0, "opposite rays of the orbit's plane"};
  double best = -1;
  int at = 0;
  for (int k = -steps; k <= steps; ++k)
    if (const double r = fit_at(orbit, views, c + k * fine).correlation; r > best) best = r, at = k;
  if (std::abs(at) == steps || !(best > 0)) return w;
  const double middle = c + at * fine, before = fit_at(orbit, views, middle - fine).correlation,
               after = fit_at(orbit, views, middle + fine).correlation;
  w.center = middle + fine * parabola_peak(before, best, after);
  w.quality = best * best;
  const double bend = (2 * best - before - after) / (fine * fine),
               n = static_cast<double>(views.size()) * static_cast<double>(orbit.rows.columns) /
                   (4 * std::sqrt(pi));
  if (bend > 0) w.uncertainty = std::sqrt(2 * (1 - best * best) / (n * bend));
  return w;
}

}  // namespace

std::optional<OppositeViews> from_opposite_rays(const ProjectionSet& scan) {
  const auto& g = scan.geometry;
  constexpr std::int64_t most_views = 32, fewest_views = 16, fewest_columns = 16;
  if (!scan.cone || g.views() < fewest_views || g.columns < fewest_columns ||
      natural_redundancy(*scan.cone, g.columns) == Redundancy::short_scan)
    return std::nullopt;
  const Orbit orbit = orbit_of(scan);
  std::vector<std::int64_t> views;
  for (std::int64_t k = 0; k < std::min(most_views, g.views()); ++k)
    views.push_back(k * g.views() / std::min(most_views, g.views()));
  const double reach = static_cast<double>(g.columns) / 4;
  const auto steps = static_cast<std::int64_t>(4 * reach);
  std::vector<double> curve(static_cast<std::size_t>(steps + 1));
  const auto place = [&](std::int64_t i) { return g.center - reach + 0.5 * static_cast<double>(i); };
  parallel_for(steps + 1, {}, "", [&](std::int64_t i) {
    curve[static_cast<std::size_t>(i)] = fit_at(orbit, views, place(i)).likelihood;
  });
  const auto best = std::max_element(curve.begin(), curve.end()) - curve.begin();
  const double most = curve[static_cast<std::size_t>(best)];
  if (!(most > 0)) return std::nullopt;
  OppositeViews found{
      peak_near(orbit, views, place(best)), {}, rival_of(curve, static_cast<std::size_t>(best)) / most};
  for (const std::size_t half : {0u, 1u}) {
    std::vector<std::int64_t> every_other;
    for (std::size_t i = half; i < views.size(); i += 2) every_other.push_back(views[i]);
    found.halves.push_back(peak_near(orbit, every_other, found.all.center));
  }
  return found;
}

}  // namespace vdvr::center
