// Variance of F (the equation at the head of vdvr/expert/noise.hpp). Parallel beam: rows of v filtered by g^2
// at two columns to a pixel, kernels/field/fbp/back_project.cl with squared view weights. Cone beam: v times
// the squares of what samples weigh, filtered alike at the pixels, kernels/field/fdk/cone_back_project.cl
// with lambda^-4.
//
// By Parseval sum_i g(t - i)^2 is the same at every t, so that linear interpolation between half columns
// leaves means as they are. Between rows S_v^2
// does not sum to one: it is summed as it is (parallel beam); of cone beam, whose samples lie between rows
// everywhere, its mean, which is one, is taken.
#include "host/field/noise/field_variance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/field/fdk/reconstruct_cone.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Columns to either side whose g^2 is taken one by one, and columns of a block beyond.
constexpr std::int64_t reach = 12, block = 8;
constexpr std::int64_t rows_together = 16;

double largest_variance(const ProjectionSet& scan, const SampleVariance& variance) {
  const std::int64_t pixels = scan.geometry.rows * scan.geometry.columns;
  std::vector<double> largest(at(scan.geometry.views()), 0.0);
  parallel_for(scan.geometry.views(), {}, "", [&](std::int64_t k) {
    for (std::int64_t i = 0; i < pixels; ++i)
      largest[at(k)] = std::max(largest[at(k)], variance.of_sample(k, i, scan.data[at(k * pixels + i)]));
  });
  const double all = *std::max_element(largest.begin(), largest.end());
  if (!(all > 0) || !std::isfinite(all))
    throw InputError(
        fmt::format("the variance of line integrals reaches {}, which is no number to go by: "
                    "line integrals of up to 300 are needed for it",
                    all));
  return all;
}

// v of some heights of view k, double out[height][column].
void variance_of_rows(std::int64_t k, std::span<const float> view, const ParallelGeometry& g,
                      const SampleVariance& variance, std::span<const std::vector<RowShare>> heights,
                      std::vector<double>& out) {
  std::fill(out.begin(), out.end(), 0.0);
  for (std::size_t h = 0; h < heights.size(); ++h)
    for (const RowShare& share : heights[h])
      for (std::int64_t i = 0; i < g.columns; ++i) {
        out[h * at(g.columns) + at(i)] +=
            share.weight * variance(k, share.row, i, view[at(share.row * g.columns + i)]);
      }
}

FieldVariance of_parallel(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                          const LineIntegralNoise& noise, const Grid& grid, const Progress& progress) {
  ParallelGeometry g = scan.geometry;
  g.center = center_of(field, g);
  const SquaredFilter filter(field);
  const std::vector<double> weights = view_weights(g).weight;
  const double pitch = 1 / (g.pitch_u * g.pitch_u);
  double heaviest = 0;
  for (const double w : weights) heaviest = std::max(heaviest, w * w);
  FieldVariance out;
  const Index3 n = grid.samples();
  out.samples.assign(at(grid.sample_count()), 0.0f);
  const SampleVariance variance(g, noise);
  const double unit = largest_variance(scan, variance) * filter.at(0) * heaviest;
  out.scale = unit * pitch;
  const std::vector<double> places = detector_rows(g, grid.origin[2], grid.spacing[2], n[2]);
  const UpsampledColumns columns = upsampled_columns(g.columns, 2, 1);
  ColumnBlocks blocks;
  blocks.nx = n[0];
  blocks.ny = n[1];
  blocks.step_x = grid.spacing[0];
  blocks.step_y = grid.spacing[1];
  blocks.first = {{grid.origin[0], grid.origin[1]}};
  for (std::int64_t z = 0; z < n[2]; z += rows_together) {
    report(progress, "noise", static_cast<double>(z) / static_cast<double>(n[2]));
    const std::int64_t heights = std::min(rows_together, n[2] - z);
    std::vector<std::vector<RowShare>> shares;
    for (std::int64_t h = 0; h < heights; ++h)
      shares.push_back(squared_row_shares(places[at(z + h)], g.rows, noise.row_correlation));
    UpsampledSlab slab{{}, columns, 0, g.views(), heights, rows_together};
    slab.values = opencl::DeviceArray<float>(state, count(g.views() * columns.count * rows_together),
                                             "variances of filtered rows");
    slab.values.write_mapped([&](std::span<float> mapped) {
      parallel_for(g.views(), {}, "", [&](std::int64_t k) {
        const std::int64_t pixels = g.rows * g.columns;
        std::vector<double> rows(at(heights * g.columns));
        variance_of_rows(k, std::span<const float>(scan.data).subspan(at(k * pixels), at(pixels)), g,
                         variance, shares, rows);
        const double factor = weights[at(k)] * weights[at(k)] / unit;
        std::vector<std::vector<double>> sums;
        for (std::int64_t h = 0; h < heights; ++h)
          sums.push_back(SquaredFilter::blocks_of(std::span(rows).subspan(at(h * g.columns), at(g.columns))));
        float* to = mapped.data() + k * columns.count * rows_together;
        for (std::int64_t c = 0; c < columns.count; ++c, to += rows_together) {
          const std::int64_t place = std::llround(2 * columns.position(c));
          std::fill(to, to + rows_together, 0.0f);
          for (std::int64_t h = 0; h < heights; ++h)
            to[h] =
                static_cast<float>(factor * filter(std::span(rows).subspan(at(h * g.columns), at(g.columns)),
                                                   sums[at(h)], place));
        }
      });
    });
    opencl::DeviceArray<float> sums(state, count(n[0] * n[1] * column_stride(heights)), "variances of F");
    back_project(state, g, slab, blocks, Interpolation::linear, sums);
    sums.read_mapped([&](std::span<const float> of_columns) {
      for (std::int64_t i = 0; i < n[0] * n[1]; ++i)
        for (std::int64_t h = 0; h < heights; ++h)
          out.samples[at((z + h) * n[0] * n[1] + i)] = of_columns[at(i * column_stride(heights) + h)];
    });
  }
  return out;
}

FieldVariance of_cone(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                      const LineIntegralNoise& noise, const Grid& grid, const Progress& progress) {
  // Lengths of order one; line integrals as they are.
  Units units = units_of(scan);
  units.line = 0;
  ConeFrame frame(scan, field, units);
  FilteredScan& filtered = frame.filtered;
  const ParallelGeometry &detector = scan.geometry, &g = filtered.geometry;
  const SquaredFilter filter(field);
  double heaviest = 0;
  for (const double w : frame.of_view) heaviest = std::max(heaviest, w * w);
  const double unit = largest_variance(scan, SampleVariance(scan.geometry, noise)) * filter.at(0) * heaviest;
  FieldVariance out;
  out.scale = std::ldexp(unit, -2 * units.across);
  HostMemory host(state);
  host.count(sizeof(float) * count(g.views() * g.rows * g.columns), "variances of filtered views");
  filtered.samples = SampleArray(std::vector<float>(at(g.views() * g.rows * g.columns)));
  const PixelVariance variance(noise);
  const std::int64_t own = detector.rows * detector.columns, before = frame.weights.pad_before();
  parallel_for(g.views(), progress, "noise", [&](std::int64_t k) {
    const float* view = scan.data.data() + k * own;
    const double factor = frame.of_view[at(k)] * frame.of_view[at(k)] / unit;
    std::vector<double> row(at(g.columns));
    for (std::int64_t v = 0; v < g.rows; ++v) {
      for (std::int64_t i = 0; i < detector.columns; ++i) {
        const auto column = static_cast<double>(i);
        const double weight = frame.weights.redundancy(at(k), column) *
                              frame.weights.cosine(at(k), column, static_cast<double>(v));
        const std::size_t pixel = at(v * detector.columns + i);
        row[at(before + i)] = factor * weight * weight * variance(pixel, static_cast<double>(view[pixel]));
      }
      const std::int64_t to = frame.flipped[at(k)] ? g.rows - 1 - v : v;
      for (std::int64_t u = 0; u < g.columns; ++u)
        filtered.samples[at((k * g.columns + u) * g.rows + to)] = static_cast<float>(filter(row, {}, 2 * u));
    }
  });
  WholeVolume whole(grid);
  StageWatch watch(nullptr);
  back_project_views(state, filtered, from_world(grid, units), 1, 4, whole.planes(), progress, watch);
  out.samples = whole.take().samples;
  return out;
}

}  // namespace

SquaredFilter::SquaredFilter(const FieldOptions& field) {
  // The kernel at half columns is four times that of half the band: w = 2 w' in its integral.
  FieldOptions half = field;
  half.cutoff = field.cutoff / 2;
  kernel_ = ramp_kernel(half, 1.0, 2 * reach + 1);
  double at_columns = 0, between = 0;
  for (std::size_t m = 0; m < kernel_.size(); ++m) {
    kernel_[m] = 16 * kernel_[m] * kernel_[m];
    (m % 2 == 0 ? at_columns : between) += (m == 0 ? 1 : 2) * kernel_[m];
  }
  // The sum of 1 / t^2 over t = reach + 1/2, reach + 3/2, ... on both sides, by its integral from reach on.
  rest_ = std::max(0.0, at_columns - between) * static_cast<double>(reach) / 2;
}

double SquaredFilter::at(std::int64_t half_columns) const {
  return kernel_.at(static_cast<std::size_t>(std::abs(half_columns)));
}

std::vector<double> SquaredFilter::blocks_of(std::span<const double> row) {
  std::vector<double> sums((row.size() + block - 1) / block);
  for (std::size_t i = 0; i < row.size(); ++i) sums[i / block] += row[i];
  return sums;
}

double SquaredFilter::operator()(std::span<const double> row, std::span<const double> blocks,
                                 std::int64_t place) const {
  const std::int64_t low = std::max<std::int64_t>(0, (place - 2 * reach + 1) / 2),
                     high = std::min(std::ssize(row) - 1, (place + 2 * reach) / 2);
  double sum = 0;
  for (std::int64_t i = low; i <= high; ++i) sum += at(place - 2 * i) * row[static_cast<std::size_t>(i)];
  if (place % 2 == 0 || rest_ == 0) return sum;
  const auto beyond = [&](double column, double variance) {
    const double t = 0.5 * static_cast<double>(place) - column;
    sum += rest_ / (t * t) * variance;
  };
  for (std::int64_t b = 0; b < std::ssize(blocks); ++b) {
    const std::int64_t first = b * block, end = std::min(first + block, std::ssize(row));
    if (end <= low || first > high)
      beyond(0.5 * static_cast<double>(first + end - 1), blocks[static_cast<std::size_t>(b)]);
    else
      for (std::int64_t i = first; i < end; ++i)
        if (i < low || i > high) beyond(static_cast<double>(i), row[static_cast<std::size_t>(i)]);
  }
  return sum;
}

double passed_share(const FieldOptions& field, std::span<const float> spectrum) {
  if (spectrum.empty()) return 1;
  // Beyond, the ramp's kernel has 1e-6 of its middle.
  constexpr std::int64_t taps = 256;
  const std::vector<double> kernel = ramp_kernel(field, 1.0, taps);
  double passed = 0, all = 0;
  for (std::size_t m = 0; m < spectrum.size(); ++m) {
    const double omega =
        std::numbers::pi * (static_cast<double>(m) + 0.5) / static_cast<double>(spectrum.size());
    double response = kernel[0];
    for (std::int64_t i = 1; i < taps; ++i)
      response += 2 * kernel[at(i)] * std::cos(omega * static_cast<double>(i));
    passed += response * response * static_cast<double>(spectrum[m]);
    all += response * response;
  }
  return passed / all;
}

std::vector<RowShare> squared_row_shares(double place, std::int64_t rows,
                                         std::span<const float> correlation) {
  const double nearest = std::round(place);
  // As far as 1e-6 of a row S_v is 1 there and 0 elsewhere to 1e-6.
  if (std::abs(place - nearest) < 1e-6 && nearest >= 0 && nearest < static_cast<double>(rows))
    return {{static_cast<std::int64_t>(nearest), 1.0}};
  const std::vector<double> matrix = resampling_matrix(rows, std::span(&place, 1), 0, 1.0, 0);
  double all = 0, with_products = 0;
  for (const double s : matrix) all += s * s;
  for (std::int64_t lag = 1; lag <= std::min(std::ssize(correlation), rows - 1); ++lag)
    for (std::int64_t r = lag; r < rows; ++r)
      with_products +=
          2 * static_cast<double>(correlation[at(lag - 1)]) * matrix[at(r)] * matrix[at(r - lag)];
  const double factor = std::max(0.0, 1 + with_products / all);
  std::vector<RowShare> shares;
  for (std::int64_t r = 0; r < rows; ++r)
    // A thousandth of the whole, spread over all rows, is left out at most.
    if (const double weight = matrix[at(r)] * matrix[at(r)]; weight * static_cast<double>(rows) > 1e-3 * all)
      shares.push_back({r, factor * weight});
  return shares;
}

double PixelVariance::operator()(std::size_t pixel, double p) const {
  const auto of = [&](const std::vector<float>& values) {
    return values.empty() ? 0.0 : static_cast<double>(values.size() == 1 ? values[0] : values[pixel]);
  };
  double v = noise_.constant;
  if (noise_.photon.empty() && noise_.read.empty()) return v;
  const double open = std::exp(p);
  v += of(noise_.photon) * open;
  if (!noise_.read.empty()) v += of(noise_.read) * open * open;
  return v;
}

SampleVariance::SampleVariance(const ParallelGeometry& g, const LineIntegralNoise& noise)
    : variance_(noise),
      factors_(row_factors(g)),
      columns_(g.columns),
      own_(own_detector(g).columns),
      before_(g.extension.before),
      first_(g.series.first),
      measured_rows_(g.series.none() ? g.rows : g.series.rows) {
  if (!g.series.none()) series_ = std::make_shared<const WeightsByHeight>(g.series);
}

std::int64_t SampleVariance::nearest_row(std::int64_t measured_view, std::int64_t height) const {
  return std::clamp<std::int64_t>(std::llround(series_->place(measured_view, height)), 0, measured_rows_ - 1);
}

namespace {

// The sum of squares of S_v(place, r) over rows, which noise of rows passes by; 1 where a row is hit.
double squares_of_rows(double place, std::int64_t rows) {
  if (std::abs(place - std::round(place)) <= 1e-9) return 1;
  const auto n = static_cast<double>(rows);
  const double x = 2 * std::numbers::pi * (place + 0.5) / n, half = std::sin(0.5 * x);
  // Dirichlet's sum of cos(m x), m = 1 .. n - 1.
  const double sum = std::abs(half) < 1e-12 ? n - 1 : std::sin((n - 0.5) * x) / (2 * half) - 0.5;
  return 1 + sum / n;
}

}  // namespace

double SampleVariance::of_series(std::int64_t view, std::int64_t row, std::int64_t column, double sum) const {
  const std::int64_t height = first_ + row;
  const double shares = series_->shares(view, height);
  if (!(shares > 0)) return 0;
  double v = 0;
  for (const std::int64_t k : series_->measured(view))
    if (const double share = series_->share(k, height); share != 0)
      v += share * share * squares_of_rows(series_->place(k, height), measured_rows_) *
           variance_(pixel_of(nearest_row(k, height), column), sum / shares);
  return v;
}

FieldVariance field_variance(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                             const LineIntegralNoise& noise, const Grid& grid, const Progress& progress) {
  FieldVariance out = scan.cone ? of_cone(state, scan, field, noise, grid, progress)
                                : of_parallel(state, scan, field, noise, grid, progress);
  out.scale *= passed_share(field, noise.spectrum);
  return out;
}

}  // namespace vdvr
