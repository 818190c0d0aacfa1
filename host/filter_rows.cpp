// Both ways to ramp-filter rows. Calls kernels/filter_projections.cl with clFFT, or kernels/filter_rows.cl.
#include "host/filter_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

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

  bool to_device(std::span<const float>, std::span<const float>, const DeviceColumns&,
                 const Progress&) override {
    return false;
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

// Whether all taps at even distances but the centre are zero, as those of the unwindowed ramp are.
bool odd_only(const std::vector<double>& kernel) {
  for (std::size_t i = 2; i < kernel.size(); i += 2)
    if (kernel[i] != 0) return false;
  return true;
}

// Rows lie as [view][v / 16][u][16] on the device: 16 rows share every tap.
class ProductFilter : public RowFilter {
 public:
  ProductFilter(opencl::State& state, const ParallelGeometry& g, const std::vector<double>& kernel)
      : state_(state),
        g_(g),
        columns_(static_cast<std::size_t>(g.columns)),
        step_(odd_only(kernel) ? 2 : 1),
        offset_((g.columns + step_ - 1) / step_ + 1),
        centre_(static_cast<float>(kernel[0])) {
    // Eight columns are summed at once, and the last of them may lie beyond the detector: zeros there.
    std::vector<float> taps(static_cast<std::size_t>(2 * offset_ + 8), 0.0f);
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const std::int64_t e = static_cast<std::int64_t>(i) - offset_, distance = std::abs(step_ * (e + 1) - 1);
      if (distance < g.columns) taps[i] = static_cast<float>(kernel[static_cast<std::size_t>(distance)]);
    }
    taps_ = opencl::DeviceArray<float>(state, std::span<const float>(taps), "ramp filter");
    double sum = kernel[0] * kernel[0];
    for (std::size_t j = 1; j < columns_; ++j) {
      sum += 2 * kernel[j] * kernel[j];
    }
    norm_ = std::sqrt(sum);
  }

  void operator()(std::span<const float> rows, std::span<const float> weights, std::span<float> out,
                  const Progress& progress) override {
    std::vector<std::int64_t> all(static_cast<std::size_t>(g_.rows));
    std::iota(all.begin(), all.end(), 0);
    Chunk chunk(state_, g_, padded(all));
    const std::int64_t view_size = chunk.view_size;
    opencl::DeviceArray<float> product(state_, count(chunk.most_views * view_size), "filtered chunk");
    const std::size_t per_view = static_cast<std::size_t>(g_.rows) * columns_;
    while (next(chunk, rows, weights, all, progress)) {
      launch(chunk, product, 0, g_.columns, 0, view_size, g_.columns * 16);
      product.read_mapped([&](std::span<const float> source) {
        parallel_for(chunk.views, {}, "", [&](std::int64_t k) {
          scatter(
              source.subspan(static_cast<std::size_t>(k * view_size), static_cast<std::size_t>(view_size)),
              out.subspan(static_cast<std::size_t>(chunk.first + k) * per_view, per_view));
        });
      });
    }
  }

  bool to_device(std::span<const float> rows, std::span<const float> weights, const DeviceColumns& target,
                 const Progress& progress) override {
    Chunk chunk(state_, g_, padded(target.rows));
    while (next(chunk, rows, weights, target.rows, progress)) {
      launch(chunk, *target.values, target.first, target.count, chunk.first * target.count * 16,
             target.count * 16, g_.views() * target.count * 16);
      const std::vector<cl_int> broken = chunk.broken.to_host();
      for (std::int64_t k = 0; k < chunk.views; ++k)
        if (broken[static_cast<std::size_t>(k)] != 0) throw not_finite(chunk.first + k);
    }
    return true;
  }

  // A sum in runs of 16 rounds each term at most 16 times within its run and once per run after it; the
  // centre's term, the tap, the weight and the product with it round once each. The sum of |terms| is at most
  // norm(kernel) norm(row).
  [[nodiscard]] double error(double row_norm) const override {
    const double n = 16 + std::ceil(static_cast<double>(columns_) / 16) + 4;
    const double gamma = n * unit_roundoff / (1 - n * unit_roundoff);
    // Each fused operation, and each tap, may lose this much.
    const double underflow = (2 + row_norm) * 2 * static_cast<double>(columns_) * smallest_normal;
    return gamma * norm_ * row_norm + underflow;
  }

 private:
  // Views [first, first + views), as many at once as a cache may hold: what is gathered is filtered at once.
  struct Chunk {
    Chunk(opencl::State& state, const ParallelGeometry& g, std::int64_t rows_padded)
        : z_padded(rows_padded),
          view_size(rows_padded * g.columns),
          most_views(std::clamp<std::int64_t>((std::int64_t{16} << 20) / (4 * view_size), 1, g.views())),
          in(state, count(most_views * view_size), "projection chunk"),
          weights(state, count(most_views), "view weights"),
          broken(state, count(most_views), "views that are not finite") {}
    std::int64_t z_padded, view_size, most_views, first = 0, views = 0;
    opencl::DeviceArray<float> in, weights;
    opencl::DeviceArray<cl_int> broken;
  };

  static std::int64_t padded(std::span<const std::int64_t> rows) {
    return static_cast<std::int64_t>(opencl::round_up(rows.size(), 16));
  }

  // Puts the next views' rows on the device; false after the last.
  bool next(Chunk& chunk, std::span<const float> scan, std::span<const float> weights,
            std::span<const std::int64_t> rows, const Progress& progress) const {
    chunk.first += chunk.views;
    chunk.views = std::min(chunk.most_views, g_.views() - chunk.first);
    if (chunk.views == 0) return false;
    report(progress, "filter", static_cast<double>(chunk.first) / static_cast<double>(g_.views()));
    const std::size_t per_view = static_cast<std::size_t>(g_.rows) * columns_,
                      size = static_cast<std::size_t>(chunk.view_size);
    chunk.in.write_mapped([&](std::span<float> target) {
      parallel_for(chunk.views, {}, "", [&](std::int64_t k) {
        gather(scan.subspan(static_cast<std::size_t>(chunk.first + k) * per_view, per_view), rows,
               target.subspan(static_cast<std::size_t>(k) * size, size));
      });
    });
    chunk.weights.write(
        weights.subspan(static_cast<std::size_t>(chunk.first), static_cast<std::size_t>(chunk.views)));
    chunk.broken.fill(0);
    return true;
  }

  // [v][u] -> [z / 16][u][16] of the detector rows wanted, zero beyond the last.
  void gather(std::span<const float> view, std::span<const std::int64_t> rows,
              std::span<float> target) const {
    for (std::size_t z0 = 0; z0 < rows.size(); z0 += 16) {
      float* to = target.data() + z0 * columns_;
      const std::size_t n = std::min<std::size_t>(16, rows.size() - z0);
      if (n < 16) std::fill(to, to + 16 * columns_, 0.0f);
      for (std::size_t z = 0; z < n; ++z) {
        const float* from = view.data() + static_cast<std::size_t>(rows[z0 + z]) * columns_;
        for (std::size_t u = 0; u < columns_; ++u) to[16 * u + z] = from[u];
      }
    }
  }

  // `out`: columns [out_first, out_first + out_columns) of each view, mirrored beyond the edges.
  void launch(const Chunk& chunk, opencl::DeviceArray<float>& out, std::int64_t out_first,
              std::int64_t out_columns, std::int64_t out_begin, std::int64_t out_view,
              std::int64_t out_chunk) const {
    const ColumnTuning tuning = column_tuning(state_.info);
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int, cl_int,
                   cl_int, cl_int, cl_int, cl_int, cl_ulong, cl_ulong, cl_ulong>
        kernel(state_, "filter_rows", "filter_rows",
               {{"VDVR_LANES", std::to_string(tuning.lanes)}, {"VDVR_STEP", std::to_string(step_)}});
    const std::int64_t groups = (g_.columns + 8 * step_ - 1) / (8 * step_) * step_;
    kernel({{count(chunk.z_padded / tuning.lanes), count(groups), count(chunk.views)},
            {tuning.local[0], tuning.local[1], 1}},
           out.buffer(), chunk.broken.buffer(), chunk.in.buffer(), taps_.buffer(), chunk.weights.buffer(),
           centre_, to_int(offset_), to_int(g_.columns), to_int(chunk.z_padded), to_int(chunk.views),
           to_int(out_first), to_int(out_columns), count(out_begin), count(out_view), count(out_chunk));
  }

  // [v / 16][u][16] -> [u][v].
  void scatter(std::span<const float> product, std::span<float> out) const {
    const std::size_t height = static_cast<std::size_t>(g_.rows);
    for (std::size_t u = 0; u < columns_; ++u)
      for (std::size_t v0 = 0; v0 < height; v0 += 16)
        std::copy_n(product.data() + v0 * columns_ + 16 * u, std::min<std::size_t>(16, height - v0),
                    out.data() + u * height + v0);
  }

  opencl::State& state_;
  const ParallelGeometry& g_;
  std::size_t columns_;
  std::int64_t step_, offset_;
  float centre_;
  opencl::DeviceArray<float> taps_;
  double norm_ = 0;
};

}  // namespace

InputError not_finite(std::int64_t view) {
  return InputError(fmt::format(
      "view {} of the scan is not finite after filtering in fp32; check or scale its line integrals", view));
}

std::unique_ptr<RowFilter> make_row_filter(opencl::State& state, const ParallelGeometry& geometry,
                                           const std::vector<double>& kernel, FilterMethod method) {
  if (method == FilterMethod::automatic)
    method = geometry.columns <= column_tuning(state.info).product_columns ? FilterMethod::product
                                                                           : FilterMethod::fourier;
  if (method == FilterMethod::product) return std::make_unique<ProductFilter>(state, geometry, kernel);
  return std::make_unique<FourierFilter>(state, geometry, kernel);
}

}  // namespace vdvr
