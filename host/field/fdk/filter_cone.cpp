// Cone-beam projections weighed and ramp-filtered. Calls fdk_weights.cpp and filter_rows.cpp.
#include "host/field/fdk/filter_cone.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/opencl/fft.hpp"
#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/huge_pages.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/field/fdk/fdk_weights.hpp"

namespace vdvr {

ConeGeometry used_cone(const ProjectionSet& scan, const FieldOptions& field) {
  ConeGeometry cone = *scan.cone;
  if (!field.center) return cone;
  // All views move alike: what they differ by is known, where the axis lies among them is not.
  const double shift = *field.center - scan.geometry.center;
  for (ViewMatrix& matrix : cone.views) matrix = recentred(matrix, matrix[0][3] / matrix[2][3] + shift);
  return cone;
}

namespace {

ViewMatrix padded(const ViewMatrix& matrix, const FdkWeights& weights) {
  return recentred(matrix, matrix[0][3] / matrix[2][3] + static_cast<double>(weights.pad_before()));
}

// The matrices with the columns that a displaced detector is padded with, and how many these are.
struct Padded {
  Padded(const ProjectionSet& scan, const FieldOptions& field) : views(used_cone(scan, field).views) {
    const FdkWeights weights({views, scan.cone->redundancy}, scan.geometry.columns, scan.geometry.rows);
    for (ViewMatrix& matrix : views) matrix = padded(matrix, weights);
    columns = scan.geometry.columns + weights.pad_before() + weights.pad_after();
  }
  std::vector<ViewMatrix> views;
  std::int64_t columns = 0;
};

// The largest 2-norm of a row of a view, float [v][u].
double largest_row_norm(std::span<const float> view, const ParallelGeometry& g) {
  double largest = 0;
  for (std::int64_t v = 0; v < g.rows; ++v) {
    double sum = 0;
    for (const float p : view.subspan(at(v * g.columns), at(g.columns)))
      sum += static_cast<double>(p) * static_cast<double>(p);
    largest = std::max(largest, std::sqrt(sum));
  }
  return largest;
}

}  // namespace

ConeCoverage cone_coverage(const ProjectionSet& scan, const FieldOptions& field) {
  const Padded detector(scan, field);
  return {detector.views, detector.columns, scan.geometry.rows};
}

Coverage certified_coverage(const ProjectionSet& scan, const FieldOptions& field) {
  ParallelGeometry g = scan.geometry;
  g.center = center_of(field, g);
  if (!scan.cone) return Coverage(g);
  const Padded detector(scan, field);
  g.columns = detector.columns;
  return {g, detector.views};
}

ViewMatrix from_world(ViewMatrix matrix, const Units& units) {
  for (auto& row : matrix)
    for (std::size_t a = 0; a < 3; ++a) row[a] = std::ldexp(row[a], a == 2 ? units.along : units.across);
  return matrix;
}

ConeFrame::ConeFrame(const ProjectionSet& scan, const FieldOptions& field, const Units& units)
    : cone(used_cone(scan, field)), weights(cone, scan.geometry.columns, scan.geometry.rows) {
  const ParallelGeometry& detector = scan.geometry;
  filtered.geometry = parallel_limit(cone, detector.columns + weights.pad_before() + weights.pad_after(),
                                     detector.rows, detector.unit);
  ParallelGeometry& g = filtered.geometry;
  g.center += static_cast<double>(weights.pad_before());
  g.pitch_u = std::ldexp(g.pitch_u, -units.across);
  g.pitch_v = std::ldexp(g.pitch_v, -units.along);
  for (std::size_t k = 0; k < cone.views.size(); ++k) {
    ViewMatrix matrix = padded(cone.views[k], weights);
    // Vectors of z read rows that grow with z.
    flipped.push_back(weights.view(k).along_v[2] < 0);
    if (flipped.back())
      for (std::size_t j = 0; j < 4; ++j)
        matrix[1][j] = static_cast<double>(detector.rows - 1) * matrix[2][j] - matrix[1][j];
    filtered.views.push_back(from_world(matrix, units));
    // The ramp's is 1 over the pitch; line integrals and pitches are those of computation.
    of_view.push_back(std::ldexp(weights.of_view(k) / weights.view(k).pitch_u, units.across - units.line));
  }
}

FilteredScan filter_cone(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                         const Progress& progress, Precision precision, const Units& units) {
  ConeFrame frame(scan, field, units);
  const ParallelGeometry& detector = scan.geometry;
  const FdkWeights& weights = frame.weights;
  // Samples come to their unit before the filter, so that none of what it makes of them is lost.
  std::vector<double> of_view;
  for (const double w : frame.of_view) of_view.push_back(std::ldexp(w, units.line));
  const double unit = std::ldexp(1.0, -units.line);
  const std::vector<bool>& flipped = frame.flipped;
  FilteredScan out = std::move(frame.filtered);
  out.fft_length = fft::good_length(2 * out.geometry.columns - 1);

  const ParallelGeometry& g = out.geometry;
  const std::int64_t size = g.rows * g.columns, own = detector.rows * detector.columns, views = g.views();
  const auto samples = at(views * size);
  out.samples = scan.data.scratch() ? SampleArray(samples, scan.data.scratch(), "the filtered projections")
                                    : SampleArray(large_zeros(samples));
  out.view_max.assign(at(views), 0.0);
  constexpr std::int64_t together = std::int64_t{64} << 20;  // bytes of a chunk of weighed views
  ParallelGeometry chunk = g;
  const std::vector<double> kernel = ramp_kernel(field, 1.0, g.columns);
  double kernel_norm = 0;
  for (std::size_t d = 0; d < kernel.size(); ++d) kernel_norm += (d == 0 ? 1 : 2) * kernel[d] * kernel[d];
  kernel_norm = std::sqrt(kernel_norm);
  std::vector<double> errors(at(views));
  std::unique_ptr<RowFilter> filter;
  std::vector<float> weighed;
  HostMemory host(state);
  const std::int64_t step = std::clamp<std::int64_t>(together / (size * 4), 1, views);
  for (std::int64_t first = 0; first < views; first += step) {
    const std::int64_t n = std::min(step, views - first);
    if (!filter || chunk.views() != n) {
      chunk.theta_rad.assign(at(n), 0.0);
      filter = make_row_filter(state, chunk, kernel, FilterMethod::automatic, precision);
      if (weighed.empty())
        host.count(sizeof(float) * count(n * size) + 2 * sizeof(double) * count(size), "weighed projections");
      weighed.resize(at(n * size));
    }
    parallel_for(n, {}, "", [&](std::int64_t k) {
      std::vector<double> view(at(size));
      weights.apply(at(first + k), std::span<const float>(scan.data).subspan(at((first + k) * own), at(own)),
                    view);
      for (std::int64_t v = 0; v < g.rows; ++v)
        std::transform(view.begin() + v * g.columns, view.begin() + (v + 1) * g.columns,
                       weighed.begin() + k * size + (flipped[at(first + k)] ? g.rows - 1 - v : v) * g.columns,
                       [&](double p) { return static_cast<float>(p * unit); });
    });
    const std::span<float> target = std::span<float>(out.samples).subspan(at(first * size), at(n * size));
    (*filter)(weighed, std::span<const double>(of_view).subspan(at(first), at(n)), target, {});
    parallel_for(n, {}, "", [&](std::int64_t k) {
      const std::span<const float> view = target.subspan(at(k * size), at(size));
      if (!std::all_of(view.begin(), view.end(), [](float q) { return std::isfinite(q); }))
        throw not_finite(first + k);
      out.view_max[at(first + k)] = static_cast<double>(largest_magnitude(view));
      // Weighed samples were rounded; the filter makes at most its norm times theirs of that.
      const double norm =
                       largest_row_norm(std::span<const float>(weighed).subspan(at(k * size), at(size)), g),
                   weight = of_view[at(first + k)];
      errors[at(first + k)] = filter->error(weight, norm, out.view_max[at(first + k)]) +
                              weight * kernel_norm * norm * (0x1p-24 + 0x1p-48) + 0x1p-126;
    });
    report(progress, "filter", static_cast<double>(first + n) / static_cast<double>(views));
  }
  for (const double e : errors) out.ramp_error += e;
  return out;
}

FilteredScan filter_scan(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                         const Progress& progress, Precision precision, const Units& units) {
  return scan.cone
             ? filter_cone(state, scan, field, progress, precision, units)
             : filter_projections(state, scan, field, progress, FilterMethod::automatic, precision, units);
}

}  // namespace vdvr
