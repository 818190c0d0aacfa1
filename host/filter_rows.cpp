// Both ways to ramp-filter rows. Calls kernels/filter_projections.cl with clFFT, or
// kernels/batched_product.cl.
#include "host/filter_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/batched_product.hpp"
#include "host/column_tuning.hpp"
#include "host/fft/fft.hpp"
#include "host/opencl/kernel.hpp"
#include "host/parallel.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double unit_roundoff = 0x1p-24, smallest_normal = 0x1p-126;

std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }

cl_int to_int(std::int64_t n) {
  if (n > INT32_MAX) throw InputError(fmt::format("a size of {} passes 2^31", n));
  return static_cast<cl_int>(n);
}

// Views filtered at once: bounded memory, and one FFT plan for all chunks.
std::int64_t views_per_chunk(const ParallelGeometry& g, std::int64_t bytes_per_view) {
  return std::clamp<std::int64_t>((std::int64_t{64} << 20) / std::max<std::int64_t>(bytes_per_view, 1), 1,
                                  g.views());
}

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

class FourierFilter : public RowFilter {
 public:
  FourierFilter(opencl::State& state, const ParallelGeometry& g, const std::vector<double>& kernel)
      : state_(state),
        g_(g),
        length_(fft::good_length(2 * g.columns - 1)),
        spectrum_(kernel_spectrum(kernel, length_)),
        spectrum_max_(std::abs(*std::max_element(spectrum_.begin(), spectrum_.end()))) {}

  void operator()(std::span<const float> rows, std::span<const float> weights, std::span<float> out,
                  const Progress& progress) override {
    const std::int64_t bins = length_ / 2 + 1, chunk = views_per_chunk(g_, g_.rows * length_ * 12),
                       row_count = chunk * g_.rows;
    opencl::DeviceArray<float> chunk_rows(state_, count(row_count * g_.columns), "projection chunk");
    opencl::DeviceArray<float> padded(state_, count(row_count * length_), "padded projections");
    opencl::DeviceArray<cl_float2> transformed(state_, count(row_count * bins), "projection spectra");
    const opencl::DeviceArray<float> filter(state_, std::span<const float>(spectrum_), "ramp filter");
    opencl::DeviceArray<float> chunk_weights(state_, count(chunk), "view weights");
    opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> pad(state_, "filter_projections",
                                                                       "pad_rows");
    opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int> multiply(state_, "filter_projections",
                                                                    "multiply_spectrum");
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int> crop(
        state_, "filter_projections", "crop_transposed");
    for (std::int64_t first = 0; first < g_.views(); first += chunk) {
      report(progress, "filter", static_cast<double>(first) / static_cast<double>(g_.views()));
      const std::int64_t views = std::min(chunk, g_.views() - first);
      const std::size_t at = static_cast<std::size_t>(first * g_.rows * g_.columns),
                        n = static_cast<std::size_t>(views * g_.rows * g_.columns);
      chunk_rows.write(rows.subspan(at, n));
      chunk_weights.write(weights.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(views)));
      pad({{count(length_), count(row_count), 1}, {64, 1, 1}}, padded.buffer(), chunk_rows.buffer(),
          to_int(g_.columns), to_int(length_), to_int(row_count));
      fft::forward_real(state_, length_, row_count, padded.buffer(), transformed.buffer());
      multiply({{count(bins), count(row_count), 1}, {64, 1, 1}}, transformed.buffer(), filter.buffer(),
               to_int(bins), to_int(row_count));
      fft::inverse_real(state_, length_, row_count, transformed.buffer(), padded.buffer());
      crop({{count(g_.rows), count(g_.columns), count(views)}, {1, 64, 1}}, chunk_rows.buffer(),
           padded.buffer(), chunk_weights.buffer(), to_int(g_.columns), to_int(g_.rows), to_int(g_.rows),
           to_int(length_), to_int(views));
      chunk_rows.read(out.subspan(at, n));
    }
  }

  // One FFT, a product and an inverse FFT in fp32 err in the 2-norm by at most log2(n) eta each, relative to
  // the result's scale (Higham, theorem 24.2); the largest error of a sample is no more than the 2-norm.
  [[nodiscard]] double error(double row_norm) const override {
    const double gamma4 = 4 * unit_roundoff / (1 - 4 * unit_roundoff);
    const double eta = unit_roundoff + gamma4 * (std::numbers::sqrt2 + unit_roundoff);
    // Radix 3 and 5 stages err less than twice what the radix 2 stages of the same length would; spectrum,
    // product, scaling and weight round once each.
    const double n = static_cast<double>(length_), stages = std::log2(n);
    // Below 2^-126 nothing is relative any more: about ten operations per stage and element lose that much
    // each, and later stages sum up n of them, twice.
    const double underflow = 20 * n * (stages + 1) * (1 + spectrum_max_) * smallest_normal;
    return (4 * stages * eta + 5 * unit_roundoff) * spectrum_max_ * row_norm + underflow;
  }

 private:
  opencl::State& state_;
  const ParallelGeometry& g_;
  std::int64_t length_;
  std::vector<float> spectrum_;
  double spectrum_max_;
};

// Rows lie as [view][v / 16][u][16] on the device: 16 rows share every element of the matrix.
class ProductFilter : public RowFilter {
 public:
  ProductFilter(opencl::State& state, const ParallelGeometry& g, const std::vector<double>& kernel)
      : state_(state), g_(g), columns_(static_cast<std::size_t>(g.columns)) {
    std::vector<float> toeplitz(columns_ * columns_);
    for (std::size_t i = 0; i < columns_; ++i)
      for (std::size_t j = 0; j < columns_; ++j)
        toeplitz[i * columns_ + j] = static_cast<float>(kernel[i < j ? j - i : i - j]);
    matrix_ = opencl::DeviceArray<float>(state, std::span<const float>(toeplitz), "ramp filter matrix");
    double sum = kernel[0] * kernel[0];
    for (std::size_t j = 1; j < columns_; ++j) {
      sum += 2 * kernel[j] * kernel[j];
    }
    norm_ = std::sqrt(sum);
  }

  void operator()(std::span<const float> rows, std::span<const float> weights, std::span<float> out,
                  const Progress& progress) override {
    const std::int64_t padded = static_cast<std::int64_t>(opencl::round_up(count(g_.rows), 16)),
                       view_size = padded * g_.columns,
                       chunk = views_per_chunk(g_, 2 * view_size * std::int64_t{sizeof(float)});
    opencl::DeviceArray<float> in(state_, count(chunk * view_size), "projection chunk"),
        product(state_, count(chunk * view_size), "filtered chunk");
    const std::size_t per_view = static_cast<std::size_t>(g_.rows) * columns_;
    for (std::int64_t first = 0; first < g_.views(); first += chunk) {
      report(progress, "filter", static_cast<double>(first) / static_cast<double>(g_.views()));
      const std::int64_t views = std::min(chunk, g_.views() - first);
      in.write_mapped([&](std::span<float> target) {
        parallel_for(views, {}, "", [&](std::int64_t k) {
          gather(
              rows.subspan(static_cast<std::size_t>(first + k) * per_view, per_view),
              target.subspan(static_cast<std::size_t>(k * view_size), static_cast<std::size_t>(view_size)));
        });
      });
      batched_product(state_, product, matrix_, in,
                      {.rows = g_.columns,
                       .terms = g_.columns,
                       .z_padded = padded,
                       .batches = views,
                       .out_batch = count(view_size),
                       .out_chunk = count(g_.columns * 16),
                       .v_batch = count(view_size),
                       .v_chunk = count(g_.columns * 16)});
      product.read_mapped([&](std::span<const float> source) {
        parallel_for(views, {}, "", [&](std::int64_t k) {
          scatter(
              source.subspan(static_cast<std::size_t>(k * view_size), static_cast<std::size_t>(view_size)),
              weights[static_cast<std::size_t>(first + k)],
              out.subspan(static_cast<std::size_t>(first + k) * per_view, per_view));
        });
      });
    }
  }

  // A sum in runs of 16 rounds each term at most 16 times within its run and once per run after it; the
  // matrix entry, the weight and the product with it round once each. The sum of |terms| is at most
  // norm(kernel) norm(row).
  [[nodiscard]] double error(double row_norm) const override {
    const double n = 16 + std::ceil(static_cast<double>(columns_) / 16) + 3;
    const double gamma = n * unit_roundoff / (1 - n * unit_roundoff);
    // Each fused operation, and each entry of the matrix, may lose this much.
    const double underflow = (2 + row_norm) * 2 * static_cast<double>(columns_) * smallest_normal;
    return gamma * norm_ * row_norm + underflow;
  }

 private:
  // [v][u] -> [v / 16][u][16], zero beyond the last row.
  void gather(std::span<const float> view, std::span<float> target) const {
    const std::size_t height = static_cast<std::size_t>(g_.rows);
    for (std::size_t v0 = 0; v0 < height; v0 += 16) {
      float* to = target.data() + v0 * columns_;
      const std::size_t n = std::min<std::size_t>(16, height - v0);
      if (n < 16) std::fill(to, to + 16 * columns_, 0.0f);
      for (std::size_t v = 0; v < n; ++v) {
        const float* from = view.data() + (v0 + v) * columns_;
        for (std::size_t u = 0; u < columns_; ++u) to[16 * u + v] = from[u];
      }
    }
  }
  // [v / 16][u][16] -> [u][v], times the weight.
  void scatter(std::span<const float> product, float weight, std::span<float> out) const {
    const std::size_t height = static_cast<std::size_t>(g_.rows);
    for (std::size_t u = 0; u < columns_; ++u)
      for (std::size_t v0 = 0; v0 < height; v0 += 16) {
        const float* from = product.data() + v0 * columns_ + 16 * u;
        float* to = out.data() + u * height + v0;
        const std::size_t n = std::min<std::size_t>(16, height - v0);
        for (std::size_t v = 0; v < n; ++v) to[v] = weight * from[v];
      }
  }

  opencl::State& state_;
  const ParallelGeometry& g_;
  std::size_t columns_;
  opencl::DeviceArray<float> matrix_;
  double norm_ = 0;
};

}  // namespace

std::unique_ptr<RowFilter> make_row_filter(opencl::State& state, const ParallelGeometry& geometry,
                                           const std::vector<double>& kernel, FilterMethod method) {
  if (method == FilterMethod::automatic)
    method = geometry.columns <= column_tuning(state.info).product_columns ? FilterMethod::product
                                                                           : FilterMethod::fourier;
  if (method == FilterMethod::product) return std::make_unique<ProductFilter>(state, geometry, kernel);
  return std::make_unique<FourierFilter>(state, geometry, kernel);
}

}  // namespace vdvr
