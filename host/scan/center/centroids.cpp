// Centroids: the first-order consistency condition of the Radon transform, its zeroth order being the check
// (Helgason and Ludwig).
#include "host/scan/center/centroids.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/base/system/parallel.hpp"
#include "host/scan/center/row_bands.hpp"

namespace vdvr::center {
namespace {

struct Moments {
  double total = 0, centroid = 0;
  double edge = 0;  // the larger mean magnitude of either edge after the line through both was taken off
  double height = 0;
};

// Of a view summed over its rows. Air that is a straight line from edge to edge is taken off.
Moments moments_of(const ProjectionSet& scan, std::int64_t view) {
  const auto& g = scan.geometry;
  const std::int64_t U = g.columns, E = std::max<std::int64_t>(2, U / 32);
  std::vector<double> sum(static_cast<std::size_t>(U), 0.0);
  for (std::int64_t v = 0; v < g.rows; ++v) {
    const float* row = scan.data.data() + (view * g.rows + v) * U;
    for (std::int64_t i = 0; i < U; ++i) sum[static_cast<std::size_t>(i)] += static_cast<double>(row[i]);
  }
  std::array<double, 2> air{};
  for (std::int64_t i = 0; i < E; ++i) {
    air[0] += sum[static_cast<std::size_t>(i)] / static_cast<double>(E);
    air[1] += sum[static_cast<std::size_t>(U - 1 - i)] / static_cast<double>(E);
  }
  Moments m;
  const double first = 0.5 * static_cast<double>(E - 1), span = static_cast<double>(U - 1) - 2 * first;
  double moment = 0;
  for (std::int64_t i = 0; i < U; ++i) {
    const double at = static_cast<double>(i),
                 p = sum[static_cast<std::size_t>(i)] - air[0] - (air[1] - air[0]) * (at - first) / span;
    m.total += p;
    moment += p * at;
    m.height = std::max(m.height, p);
  }
  m.edge = std::max(std::abs(air[0]), std::abs(air[1]));
  m.centroid = m.total != 0 ? moment / m.total : 0;
  return m;
}

using Row3 = std::array<double, 3>;

// Inverse of a symmetric positive matrix; nothing where its condition is beyond use.
std::optional<std::array<Row3, 3>> inverse(const std::array<Row3, 3>& m) {
  const auto minor = [&](std::size_t i, std::size_t j) {
    const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  };
  const double det = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  if (!(det > 1e-9 * m[0][0] * m[0][0] * m[0][0])) return std::nullopt;
  std::array<Row3, 3> out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out[j][i] = minor(i, j) / det;
  return out;
}

}  // namespace

std::optional<CenterWitness> from_centroids(const ProjectionSet& scan) {
  const auto& g = scan.geometry;
  constexpr std::int64_t fewest_views = 8;
  if (g.views() < fewest_views || g.columns < 16) return std::nullopt;
  std::vector<Moments> views(static_cast<std::size_t>(g.views()));
  parallel_for(g.views(), {}, "",
               [&](std::int64_t k) { views[static_cast<std::size_t>(k)] = moments_of(scan, k); });
  double mean = 0, square = 0, edge = 0, height = 0;
  const auto n = static_cast<double>(g.views());
  for (const Moments& m : views) {
    mean += m.total / n;
    square += m.total * m.total / n;
    edge += m.edge / n;
    height += m.height / n;
  }
  // A cut object or wrong air of 2 % of the total at the detector's edge moves a centroid by 1 % of its
  // width; 5 % of the height at the edges is no air.
  constexpr double steady = 0.02, empty = 0.05;
  if (!(mean > 0) || !(square - mean * mean <= steady * steady * mean * mean) || !(edge <= empty * height))
    return std::nullopt;
  std::array<Row3, 3> normal{};
  Row3 right{};
  const auto terms = [&](std::size_t k) {
    return Row3{1, std::cos(g.theta_rad[k]), std::sin(g.theta_rad[k])};
  };
  for (std::size_t k = 0; k < views.size(); ++k) {
    const Row3 t = terms(k);
    for (std::size_t i = 0; i < 3; ++i) {
      right[i] += t[i] * views[k].centroid;
      for (std::size_t j = 0; j < 3; ++j) normal[i][j] += t[i] * t[j];
    }
  }
  const auto inverted = inverse(normal);
  if (!inverted) return std::nullopt;
  Row3 fit{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) fit[i] += (*inverted)[i][j] * right[j];
  double residual = 0, spread = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const Row3 t = terms(k);
    const double rest = views[k].centroid - fit[0] - fit[1] * t[1] - fit[2] * t[2];
    residual += rest * rest;
    spread += std::pow(views[k].centroid - fit[0], 2);
  }
  if (!(fit[0] > -0.5 && fit[0] < static_cast<double>(g.columns) - 0.5)) return std::nullopt;
  // What the totals vary by lies somewhere on the detector, not only at random: an eighth of it from the
  // axis.
  const double unsteady =
      std::sqrt(std::max(0.0, square / (mean * mean) - 1)) * static_cast<double>(g.columns) / 8;
  return CenterWitness{fit[0], std::hypot(std::sqrt(residual / (n - 3) * (*inverted)[0][0]), unsteady),
                       spread > 0 ? std::clamp(1 - residual / spread, 0.0, 1.0) : 1, "the views' centroids"};
}

}  // namespace vdvr::center
