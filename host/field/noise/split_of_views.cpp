// Half the difference of F from every other view and F from those between them: F of the same projections
// with alternating signs (docs/noise.md).
#include "host/field/noise/split_of_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/field/noise/estimate_photons.hpp"
#include "host/scan/geometry/views_of_rows.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr std::int64_t planes = 8, most_cells = 128, fewest_samples = 50;
// Pixels about the axis that hold enough samples to go by.
constexpr double least_radius = 5;
// Beyond it a column's median is the object, not its noise or a bent background.
constexpr double share_of_object = 0.05;

double modulo(double theta, double period) {
  const double t = std::fmod(theta, period);
  return t < 0 ? t + period : t;
}

// After which views see the same: opposite ones do, but of half acquisition, where each sees its own side.
double period_of(const ParallelGeometry& g) {
  return g.extension.half_acquisition.value_or(false) ? 2 * pi : pi;
}

// The middle rows of a scan; of noise what belongs to them.
struct Middle {
  ProjectionSet scan;
  LineIntegralNoise noise;
  double height = 0;  // of cone beam, of the row next to the orbit, as seen at the axis, in pixels
};

Middle middle_rows(const ProjectionSet& scan, const LineIntegralNoise& noise) {
  const ParallelGeometry& g = scan.geometry;
  Middle out{{g, scan.cone, {}, {}}, noise};
  // Of cone beam the plane of the orbit alone is looked at, and the rows that see it.
  double row = 0.5 * static_cast<double>(g.rows - 1);
  if (scan.cone) row = cone_view(scan.cone->views.front()).row;
  const std::int64_t rows = std::min(g.rows, planes),
                     first = std::clamp<std::int64_t>(std::llround(row) - rows / 2, 0, g.rows - rows);
  out.scan.geometry.rows = rows;
  out.height = std::round(row) - row;
  if (out.scan.cone)
    for (ViewMatrix& m : out.scan.cone->views)
      for (std::size_t j = 0; j < 4; ++j) m[1][j] -= static_cast<double>(first) * m[2][j];
  std::vector<float> data(at(g.views() * rows * g.columns));
  for (std::int64_t k = 0; k < g.views(); ++k)
    std::copy_n(scan.data.begin() + (k * g.rows + first) * g.columns, rows * g.columns,
                data.begin() + k * rows * g.columns);
  out.scan.data = SampleArray(std::move(data));
  if (!g.series.none()) {
    out.scan.geometry.series.first += first;  // of which the noise is known row by measured row
    return out;
  }
  const std::int64_t own = own_detector(g).columns;
  for (std::vector<float>* values : {&out.noise.photon, &out.noise.read})
    if (values->size() > 1) *values = {values->begin() + first * own, values->begin() + (first + rows) * own};
  return out;
}

// How far from the axis columns see something, as most views have it.
double object_radius(const ProjectionSet& scan, double center) {
  const ParallelGeometry& g = scan.geometry;
  std::vector<double> medians(at(g.columns));
  parallel_for(g.columns, {}, "", [&](std::int64_t i) {
    std::vector<float> seen;
    for (std::int64_t k = 0; k < g.views(); ++k)
      for (std::int64_t r = 0; r < g.rows; ++r)
        seen.push_back(scan.data[at((k * g.rows + r) * g.columns + i)]);
    std::nth_element(seen.begin(), seen.begin() + std::ssize(seen) / 2, seen.end());
    medians[at(i)] = static_cast<double>(seen[seen.size() / 2]);
  });
  const double largest = *std::max_element(medians.begin(), medians.end());
  double radius = 0;
  for (std::int64_t i = 0; i < g.columns; ++i)
    if (medians[at(i)] > share_of_object * largest)
      radius = std::max(radius, std::abs(static_cast<double>(i) - center));
  return radius;
}

// Views in each half, of those that a half turn holds.
double views_of_half(const ProjectionSet& scan, const std::vector<int>& signs) {
  if (scan.cone)
    return 0.5 * static_cast<double>(signs.size()) * pi / std::max(pi, source_arc(*scan.cone).arc_rad);
  std::vector<double> angles;
  const double period = period_of(scan.geometry);
  for (const double t : scan.geometry.theta_rad) angles.push_back(modulo(t, period));
  std::sort(angles.begin(), angles.end());
  const double near = 1e-3 * period / static_cast<double>(angles.size());
  const auto last =
      std::unique(angles.begin(), angles.end(), [&](double a, double b) { return b - a < near; });
  return 0.5 * static_cast<double>(last - angles.begin()) * pi / period;
}

}  // namespace

std::vector<int> alternating_signs(const ProjectionSet& scan) {
  const std::vector<double>& theta = scan.geometry.theta_rad;
  std::vector<int> signs(theta.size(), 1);
  if (scan.cone) {
    const std::vector<std::int64_t> order = views_by_angle(scan);
    for (std::size_t i = 0; i < order.size(); ++i) signs[at(order[i])] = i % 2 == 0 ? 1 : -1;
    return signs;
  }
  std::vector<std::pair<double, std::size_t>> angles;
  const double period = period_of(scan.geometry);
  for (std::size_t k = 0; k < theta.size(); ++k) angles.emplace_back(modulo(theta[k], period), k);
  std::sort(angles.begin(), angles.end());
  // Views closer than a thousandth of the mean step see the same.
  const double near = 1e-3 * period / static_cast<double>(theta.size());
  int sign = 1;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    if (i > 0 && angles[i].first - angles[i - 1].first >= near) sign = -sign;
    signs[angles[i].second] = sign;
  }
  return signs;
}

std::optional<SplitOfViews> split_of_views(Device& device, const ProjectionSet& scan,
                                           const FieldOptions& field, const LineIntegralNoise& noise,
                                           const Progress& progress) {
  // No two of them are neighbours at all of their heights.
  if (views_see_parts(scan.geometry)) return std::nullopt;
  Middle middle = middle_rows(scan, noise);
  ParallelGeometry& g = middle.scan.geometry;
  const double center = center_of(field, g);
  const std::vector<int> signs = alternating_signs(scan);
  SplitOfViews out;
  // World lengths, as seen at the axis.
  const double sharp = views_of_half(scan, signs) / pi, close = sharp - object_radius(middle.scan, center);
  out.resolved = close >= least_radius;
  const double radius = std::min((out.resolved ? close : sharp / 2) * g.pitch_u,
                                 certified_coverage(middle.scan, field).inner_radius());
  const Volume expected = [&] {
    GridOptions options;
    const auto cells = std::min(most_cells, static_cast<std::int64_t>(2 * radius / g.pitch_u));
    if (cells < 2) return Volume{};
    options.spacing = g.pitch_u;
    options.spacing_z = g.pitch_v;
    options.size = Index3{cells, cells, std::max<std::int64_t>(1, scan.cone ? 1 : g.rows - 1)};
    if (scan.cone)
      options.origin = Vec3{-0.5 * static_cast<double>(cells) * g.pitch_u,
                            -0.5 * static_cast<double>(cells) * g.pitch_u, middle.height * g.pitch_v};
    const Grid grid = make_grid(middle.scan, options);
    return noise_of_field(device, middle.scan, field, middle.noise, grid, progress);
  }();
  if (expected.samples.empty()) return std::nullopt;
  for (std::int64_t k = 0; k < g.views(); ++k)
    if (signs[at(k)] < 0)
      for (std::int64_t i = 0; i < g.rows * g.columns; ++i) {
        float& p = middle.scan.data[at(k * g.rows * g.columns + i)];
        p = -p;
      }
  ReconstructOptions options;
  options.field = field;
  const Volume difference = reconstruct(device, middle.scan, expected.grid, options, progress);
  double found = 0, predicted = 0;
  const Index3 n = expected.grid.samples();
  for (std::int64_t i = 0; i < expected.grid.sample_count(); ++i) {
    const Vec3 p = expected.grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]});
    const auto sigma = static_cast<double>(expected.samples[at(i)]);
    // Of a scan of one row the other plane of the grid is no measured one.
    if (std::hypot(p[0], p[1]) > radius || !(sigma > 0) || (g.rows == 1 && i >= n[0] * n[1])) continue;
    const auto d = static_cast<double>(difference.samples[at(i)]);
    found += d * d;
    predicted += sigma * sigma;
    ++out.samples;
  }
  if (out.samples < fewest_samples || !(predicted > 0)) return std::nullopt;
  out.sigma = std::sqrt(found / static_cast<double>(out.samples));
  out.predicted = std::sqrt(predicted / static_cast<double>(out.samples));
  return out;
}

}  // namespace vdvr
