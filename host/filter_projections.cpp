// Ramp filter by clFFT and upsampling by dense cosine-series products. Calls kernels/filter_projections.cl
// and kernels/batched_product.cl.
#include "host/filter_projections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/fft/fft.hpp"
#include "host/opencl/kernel.hpp"
#include "host/parallel.hpp"
#include "host/ramp_kernel.hpp"
#include "host/view_weights.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double unit_roundoff = 0x1p-24;

// The real spectrum of the even kernel, of length n/2 + 1: sums in double precision.
std::vector<float> kernel_spectrum(const std::vector<double>& g, std::int64_t length) {
  std::vector<double> cosine(static_cast<std::size_t>(length));
  for (std::size_t i = 0; i < cosine.size(); ++i)
    cosine[i] = std::cos(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length));
  std::vector<float> spectrum(static_cast<std::size_t>(length / 2 + 1));
  for (std::size_t k = 0; k < spectrum.size(); ++k) {
    double sum = g[0];
    for (std::size_t j = 1; j < g.size(); ++j)
      sum += 2 * g[j] * cosine[k * j % static_cast<std::size_t>(length)];
    spectrum[k] = static_cast<float>(sum);
  }
  return spectrum;
}

// One FFT, a product and an inverse FFT in fp32 err in the 2-norm by at most log2(n) eta each, relative to
// the result's scale (Higham, theorem 24.2); the largest error of a sample is no more than the 2-norm.
double ramp_error_of(double row_norm, double spectrum_max, std::int64_t length) {
  const double gamma4 = 4 * unit_roundoff / (1 - 4 * unit_roundoff);
  const double eta = unit_roundoff + gamma4 * (std::numbers::sqrt2 + unit_roundoff);
  // Radix 3 and 5 stages err less than twice what the radix 2 stages of the same length would; spectrum,
  // product, scaling and weight round once each.
  const double n = static_cast<double>(length), stages = std::log2(n);
  // Below 2^-126 nothing is relative any more: about ten operations per stage and element lose that much
  // each, and later stages sum up n of them, twice.
  const double underflow = 20 * n * (stages + 1) * (1 + spectrum_max) * 0x1p-126;
  return (4 * stages * eta + 5 * unit_roundoff) * spectrum_max * row_norm + underflow;
}

struct FilterKernels {
  explicit FilterKernels(opencl::State& s)
      : pad(s, "filter_projections", "pad_rows"),
        multiply(s, "filter_projections", "multiply_spectrum"),
        crop(s, "filter_projections", "crop_transposed") {}
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> pad;
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int> multiply;
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int> crop;
};

cl_int to_int(std::int64_t n) {
  if (n > INT32_MAX) throw InputError(fmt::format("a size of {} passes 2^31", n));
  return static_cast<cl_int>(n);
}

// Views filtered at once: bounded memory, and one FFT plan for all chunks.
std::int64_t views_per_chunk(const ParallelGeometry& g, std::int64_t length) {
  const std::int64_t per_view = g.rows * length * 12;
  return std::clamp<std::int64_t>((std::int64_t{64} << 20) / std::max<std::int64_t>(per_view, 1), 1,
                                  g.views());
}

}  // namespace

FilteredScan filter_projections(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                                const Progress& progress) {
  FilteredScan out;
  out.geometry = scan.geometry;
  if (field.center) out.geometry.center = *field.center;
  const ParallelGeometry& g = out.geometry;
  const ViewWeights weights = view_weights(g.theta_rad);
  out.limited_angle = weights.limited_angle;

  const auto kernel = ramp_kernel(field, g.pitch_u, g.columns);
  const std::int64_t length = fft::good_length(2 * g.columns - 1), bins = length / 2 + 1;
  const auto spectrum = kernel_spectrum(kernel, length);
  out.fft_length = length;
  const double spectrum_max = std::abs(*std::max_element(spectrum.begin(), spectrum.end()));

  const std::int64_t chunk = views_per_chunk(g, length), row_count = chunk * g.rows;
  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  opencl::DeviceArray<float> rows(state, count(row_count * g.columns), "projection chunk");
  opencl::DeviceArray<float> padded(state, count(row_count * length), "padded projections");
  opencl::DeviceArray<cl_float2> transformed(state, count(row_count * bins), "projection spectra");
  const opencl::DeviceArray<float> filter(state, std::span<const float>(spectrum), "ramp filter");
  std::vector<float> view_weight(weights.weight.begin(), weights.weight.end());
  opencl::DeviceArray<float> chunk_weights(state, count(chunk), "view weights");
  FilterKernels kernels(state);

  out.samples.resize(static_cast<std::size_t>(scan.size()));
  out.view_max.assign(static_cast<std::size_t>(g.views()), 0.0);
  for (std::int64_t first = 0; first < g.views(); first += chunk) {
    report(progress, "filter", static_cast<double>(first) / static_cast<double>(g.views()));
    const std::int64_t views = std::min(chunk, g.views() - first), n = views * g.rows;
    rows.write(std::span<const float>(scan.data).subspan(static_cast<std::size_t>(first * g.rows * g.columns),
                                                         static_cast<std::size_t>(n * g.columns)));
    chunk_weights.write(std::span<const float>(view_weight)
                            .subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(views)));
    kernels.pad({{count(length), count(row_count), 1}, {64, 1, 1}}, padded.buffer(), rows.buffer(),
                to_int(g.columns), to_int(length), to_int(row_count));
    fft::forward_real(state, length, row_count, padded.buffer(), transformed.buffer());
    kernels.multiply({{count(bins), count(row_count), 1}, {64, 1, 1}}, transformed.buffer(), filter.buffer(),
                     to_int(bins), to_int(row_count));
    fft::inverse_real(state, length, row_count, transformed.buffer(), padded.buffer());
    kernels.crop({{count(g.rows), count(g.columns), count(views)}, {1, 64, 1}}, rows.buffer(),
                 padded.buffer(), chunk_weights.buffer(), to_int(g.columns), to_int(g.rows), to_int(g.rows),
                 to_int(length), to_int(views));
    rows.read(std::span<float>(out.samples)
                  .subspan(static_cast<std::size_t>(first * g.rows * g.columns),
                           static_cast<std::size_t>(n * g.columns)));
  }

  const std::size_t per_view = static_cast<std::size_t>(g.rows * g.columns);
  for (std::size_t k = 0; k < out.view_max.size(); ++k) {
    double largest_norm = 0;
    for (std::int64_t v = 0; v < g.rows; ++v) {
      double norm = 0;
      for (std::int64_t u = 0; u < g.columns; ++u) {
        const double p = scan.data[k * per_view + static_cast<std::size_t>(v * g.columns + u)];
        norm += p * p;
      }
      largest_norm = std::max(largest_norm, std::sqrt(norm));
    }
    out.ramp_error += weights.weight[k] * ramp_error_of(largest_norm, spectrum_max, length);
    for (std::size_t i = 0; i < per_view; ++i) {
      const double m = std::abs(static_cast<double>(out.samples[k * per_view + i]));
      if (!(m <= out.view_max[k])) out.view_max[k] = m;  // NaN stays
      if (std::isnan(m)) break;
    }
    if (!std::isfinite(out.view_max[k]) || !std::isfinite(largest_norm))
      throw InputError(fmt::format(
          "view {} of the scan is not finite after filtering in fp32; check or scale its line integrals", k));
  }
  return out;
}

void measure_filter_error(FilteredScan& filtered, const ProjectionSet& scan, const FieldOptions& field) {
  const ParallelGeometry& g = filtered.geometry;
  const double cost = static_cast<double>(scan.size()) * static_cast<double>(g.columns);
  if (cost > 4e9) return;
  const auto kernel = ramp_kernel(field, g.pitch_u, g.columns);
  const ViewWeights weights = view_weights(g.theta_rad);
  const std::size_t U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  std::vector<double> both(2 * U - 1),
      error(static_cast<std::size_t>(g.views()));  // the kernel at -(U-1) .. U-1
  for (std::size_t i = 0; i < both.size(); ++i) both[i] = kernel[i < U ? U - 1 - i : i - U + 1];
  parallel_for(g.views(), {}, "filter error", [&](std::int64_t view) {
    const std::size_t k = static_cast<std::size_t>(view);
    std::vector<double> row(U);
    for (std::size_t v = 0; v < V; ++v) {
      std::fill(row.begin(), row.end(), 0.0);
      for (std::size_t m = 0; m < U; ++m) {
        const double p = static_cast<double>(scan.data[(k * V + v) * U + m]);
        const double* shifted = both.data() + (U - 1 - m);
        for (std::size_t i = 0; i < U; ++i) row[i] += shifted[i] * p;
      }
      for (std::size_t i = 0; i < U; ++i)
        error[k] = std::max(error[k], std::abs(row[i] * weights.weight[k] -
                                               static_cast<double>(filtered.samples[(k * U + i) * V + v])));
    }
  });
  filtered.ramp_error = 0;
  double kernel_sum = 0, largest = 0;
  for (const double g_i : both) kernel_sum += std::abs(g_i);
  for (const float p : scan.data) largest = std::max(largest, std::abs(static_cast<double>(p)));
  for (std::size_t k = 0; k < error.size(); ++k)  // the reference rounds too: U terms of double precision
    filtered.ramp_error +=
        error[k] + static_cast<double>(U) * 0x1p-52 * weights.weight[k] * kernel_sum * largest;
}

ColumnTuning column_tuning(const DeviceInfo& device) {
  ColumnTuning t;
  if (device.is_gpu) {
    // Neighbouring work-items take neighbouring z, so that loads coalesce.
    t.lanes = 1;
    t.local = {32, 4, 2};
  }
  return t;
}

std::uint64_t Upsampler::slab_bytes(const UpsampledColumns& columns, std::int64_t rows) const {
  const auto lanes = static_cast<std::uint64_t>(std::max(column_tuning(state_->info).lanes, 16));
  return static_cast<std::uint64_t>(scan_->geometry.views() * columns.count) *
         opencl::round_up(static_cast<std::uint64_t>(rows), lanes) * sizeof(float);
}

const Upsampler::Matrix& Upsampler::matrix_u(const UpsampledColumns& columns, int order) {
  const std::tuple key{columns.rate, columns.pad, columns.count, order};
  if (const auto found = matrices_.find(key); found != matrices_.end()) return found->second;
  std::vector<double> positions(static_cast<std::size_t>(columns.count));
  for (std::size_t j = 0; j < positions.size(); ++j)
    positions[j] = columns.position(static_cast<std::int64_t>(j));
  const ParallelGeometry& g = scan_->geometry;
  const auto exact = resampling_matrix(g.columns, positions, order, g.pitch_u, columns.rate);
  const std::vector<float> rounded(exact.begin(), exact.end());
  Matrix m{opencl::DeviceArray<float>(*state_, std::span<const float>(rounded), "upsampling matrix"), 0};
  const auto width = static_cast<std::size_t>(g.columns);
  for (std::size_t j = 0; j < positions.size(); ++j) {
    double sum = 0;
    for (std::size_t i = 0; i < width; ++i) sum += std::abs(exact[j * width + i]);
    m.gain = std::max(m.gain, sum);
  }
  return matrices_.emplace(key, std::move(m)).first->second;
}

double Upsampler::gain_u(const UpsampledColumns& columns, int order) { return matrix_u(columns, order).gain; }

UpsampledSlab Upsampler::operator()(const UpsampledColumns& columns, std::span<const double> rows,
                                    int order_u, int order_v, int row_lattice, std::int64_t first_view,
                                    std::int64_t views) {
  const ParallelGeometry& g = scan_->geometry;
  if (views < 0) views = g.views() - first_view;
  const ColumnTuning tuning = column_tuning(state_->info);
  UpsampledSlab slab;
  slab.columns = columns;
  slab.first_view = first_view;
  slab.views = views;
  slab.rows = static_cast<std::int64_t>(rows.size());
  slab.rows_padded = static_cast<std::int64_t>(opencl::round_up(rows.size(), 16));

  // Rows first: v and z lie in the same order everywhere, so the transposed matrix is float [z / 16][v][16].
  const auto exact = resampling_matrix(g.rows, rows, order_v, g.pitch_v, row_lattice);
  std::vector<float> transposed(static_cast<std::size_t>(g.rows * slab.rows_padded), 0.0f);
  for (std::size_t z = 0; z < rows.size(); ++z)
    for (std::size_t v = 0; v < static_cast<std::size_t>(g.rows); ++v)
      transposed[(z / 16 * static_cast<std::size_t>(g.rows) + v) * 16 + z % 16] =
          static_cast<float>(exact[z * static_cast<std::size_t>(g.rows) + v]);
  const opencl::DeviceArray<float> row_matrix(*state_, std::span<const float>(transposed),
                                              "row resampling matrix");
  const Matrix& column_matrix = matrix_u(columns, order_u);

  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  slab.values = opencl::DeviceArray<float>(*state_, count(views * columns.count * slab.rows_padded),
                                           "upsampled projections");
  const std::int64_t per_view = g.columns * (g.rows + slab.rows_padded) * 4;
  const std::int64_t chunk = std::clamp<std::int64_t>((std::int64_t{32} << 20) / per_view, 1, views);
  opencl::DeviceArray<float> filtered(*state_, count(chunk * g.columns * g.rows), "filtered chunk");
  opencl::DeviceArray<float> resampled(*state_, count(chunk * g.columns * slab.rows_padded),
                                       "rows of a slab");

  const int block_rows = 8;  // rows per work-item of the kernel
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_ulong, cl_ulong,
                 cl_ulong, cl_ulong, cl_ulong, cl_ulong>
      product(*state_, "batched_product", "batched_product", {{"VDVR_LANES", std::to_string(tuning.lanes)}});
  const auto range = [&](std::int64_t product_rows, std::int64_t batches) {
    return opencl::Range{{count(slab.rows_padded / tuning.lanes),
                          opencl::round_up(count(product_rows), block_rows) / block_rows, count(batches)},
                         {tuning.local[0], tuning.local[1], 1}};
  };
  for (std::int64_t first = 0; first < views; first += chunk) {
    const std::int64_t n = std::min(chunk, views - first);
    filtered.write(std::span<const float>(scan_->samples)
                       .subspan(static_cast<std::size_t>((first_view + first) * g.columns * g.rows),
                                static_cast<std::size_t>(n * g.columns * g.rows)));
    const std::uint64_t resampled_chunk = count(n * g.columns * 16),
                        slab_chunk = count(views * columns.count * 16);
    product(range(n * g.columns, 1), resampled.buffer(), filtered.buffer(), row_matrix.buffer(),
            to_int(n * g.columns), to_int(g.rows), to_int(slab.rows_padded), 1, cl_ulong{0}, cl_ulong{0},
            resampled_chunk, cl_ulong{0}, cl_ulong{0}, count(g.rows * 16));
    product(range(columns.count, n), slab.values.buffer(), column_matrix.values.buffer(), resampled.buffer(),
            to_int(columns.count), to_int(g.columns), to_int(slab.rows_padded), to_int(n),
            count(first * columns.count * 16), count(columns.count * 16), slab_chunk, cl_ulong{0},
            count(g.columns * 16), resampled_chunk);
  }
  return slab;
}

}  // namespace vdvr
