// The ways to ramp-filter rows. Calls kernels/field/fbp/filter_rows_fft.cl with clFFT,
// kernels/field/fbp/filter_rows.cl, or host_fft.cpp.
#include "host/field/fbp/filter_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <type_traits>

#include "host/base/opencl/column_tuning.hpp"
#include "host/base/opencl/fft.hpp"
#include "host/base/opencl/host_fft.hpp"
#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "shared/filter_rows.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrFilteredRows) == 48);

namespace {

constexpr double smallest_normal = 0x1p-126;

template <class Real>
constexpr bool is_double = std::is_same_v<Real, double>;
template <class Real>
constexpr double unit_roundoff = is_double<Real> ? 0x1p-53 : 0x1p-24;

// What the one rounding to the sample that is stored adds where all before it was in double precision.
template <class Real>
double stored_rounding(double largest) {
  constexpr double u = unit_roundoff<float>;
  return is_double<Real> ? u / (1 - u) * largest : 0.0;
}

cl_int checked_int(std::int64_t n) {
  if (n > INT32_MAX) throw InputError(fmt::format("a size of {} passes 2^31", n));
  return static_cast<cl_int>(n);
}

// Columns on the device are cut into chunks of 16 samples.
std::int64_t to_chunks(std::int64_t rows) {
  return static_cast<std::int64_t>(opencl::round_up(count(rows), 16));
}

// Views filtered at once: bounded memory, and one FFT plan for all chunks.
std::int64_t views_per_chunk(const ParallelGeometry& g, std::int64_t bytes_per_view) {
  return std::clamp<std::int64_t>((std::int64_t{64} << 20) / std::max<std::int64_t>(bytes_per_view, 1), 1,
                                  g.views());
}

// The real spectrum of the even kernel, of length n/2 + 1: sums in double precision.
std::vector<double> kernel_spectrum(const std::vector<double>& g, std::int64_t length) {
  std::vector<double> cosine(static_cast<std::size_t>(length));
  for (std::size_t i = 0; i < cosine.size(); ++i)
    cosine[i] = std::cos(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length));
  std::vector<double> spectrum(static_cast<std::size_t>(length / 2 + 1));
  parallel_for(length / 2 + 1, {}, "", [&](std::int64_t bin) {
    const auto k = static_cast<std::size_t>(bin);
    double sum = g[0];
    for (std::size_t j = 1; j < g.size(); ++j)
      sum += 2 * g[j] * cosine[k * j % static_cast<std::size_t>(length)];
    spectrum[k] = sum;
  });
  return spectrum;
}

// What a transform, the product with the kernel's spectrum and the inverse err (docs/error-bounds.md, section
// 7).
class FourierError {
 public:
  FourierError(const std::vector<double>& kernel, const std::vector<double>& spectrum, std::int64_t length)
      : length_(static_cast<double>(length)), taps_(static_cast<double>(kernel.size())) {
    for (std::size_t i = 0; i < kernel.size(); ++i) kernel_sum_ += (i == 0 ? 1 : 2) * std::abs(kernel[i]);
    for (const double s : spectrum) spectrum_max_ = std::max(spectrum_max_, std::abs(s));
  }

  // Of a filtered sample before the weight, for arithmetic that rounds by u.
  [[nodiscard]] double operator()(double u, double smallest, double row_norm) const {
    // A stage of radix 16 errs by at most 512 u, its twiddles by 124 u; one stage more packs real rows.
    const double transform = 700 * u * (std::log2(length_) + 1);
    // The spectrum: its sum in double precision, and what rounds once.
    const double spectrum = (taps_ + 40) * 0x1p-53 * kernel_sum_ + u * spectrum_max_;
    // Two rows can share a transform, whose norm is then that of both.
    const double relative =
        std::numbers::sqrt2 * 1.01 * ((2 * transform + 4 * u) * spectrum_max_ + spectrum) * row_norm;
    // Below the smallest normal number nothing is relative: about ten operations a stage and element lose
    // that much, and later stages sum up n of them, twice.
    return relative + 20 * length_ * (std::log2(length_) + 1) * (1 + spectrum_max_) * smallest;
  }

 private:
  double length_, taps_, kernel_sum_ = 0, spectrum_max_ = 0;
};

template <class Real>
class FourierFilter : public RowFilter {
 public:
  FourierFilter(opencl::State& state, const ParallelGeometry& g, const std::vector<double>& kernel)
      : state_(state), g_(g), length_(fft::good_length(2 * g.columns - 1)) {
    const std::vector<double> spectrum = kernel_spectrum(kernel, length_);
    spectrum_.assign(spectrum.begin(), spectrum.end());
    error_.emplace(kernel, spectrum, length_);
  }

  void operator()(std::span<const float> rows, std::span<const double> weights, std::span<float> out,
                  const Progress& progress) override {
    Chunk chunk(*this, g_.rows);
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int> crop(
        state_, "field/fbp/filter_rows_fft", "crop_transposed", defines());
    const std::size_t per_view = static_cast<std::size_t>(g_.rows * g_.columns);
    while (chunk.next(weights, progress)) {
      const std::size_t at = static_cast<std::size_t>(chunk.first) * per_view,
                        n = static_cast<std::size_t>(chunk.views) * per_view;
      chunk.rows.write(rows.subspan(at, n));
      chunk.filter();
      crop({{count(g_.rows), count(g_.columns), count(chunk.views)}, {1, 64, 1}}, chunk.rows.buffer(),
           chunk.padded.buffer(), chunk.weights.buffer(), checked_int(g_.columns), checked_int(g_.rows),
           checked_int(length_), checked_int(chunk.views));
      chunk.rows.read(out.subspan(at, n));
    }
  }

  bool to_device(std::span<const float> rows, std::span<const double> weights, const DeviceColumns& target,
                 const Progress& progress) override {
    const auto height = static_cast<std::int64_t>(target.rows.size());
    Chunk chunk(*this, height);
    opencl::DeviceArray<cl_int> broken(state_, count(chunk.most_views), "views that are not finite");
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, VdvrFilteredRows> crop(
        state_, "field/fbp/filter_rows_fft", "crop_to_chunks", defines());
    const std::int64_t z_padded = to_chunks(height);
    while (chunk.next(weights, progress)) {
      chunk.rows.write_mapped([&](std::span<float> mapped) {
        parallel_for(chunk.views, {}, "", [&](std::int64_t k) {
          gather(rows, chunk.first + k, target.rows, mapped.data() + k * height * g_.columns);
        });
      });
      chunk.filter();
      broken.fill(0);
      const VdvrFilteredRows shape{.out = {count(chunk.first * target.count * 16), count(target.count * 16),
                                           count(g_.views() * target.count * 16)},
                                   .columns = checked_int(g_.columns),
                                   .z_padded = checked_int(z_padded),
                                   .views = checked_int(chunk.views),
                                   .offset = 0,
                                   .first_column = checked_int(target.first),
                                   .out_columns = checked_int(target.count)};
      crop({{count(z_padded), count(target.count), count(chunk.views)}, {16, 4, 1}}, target.values->buffer(),
           broken.buffer(), chunk.padded.buffer(), chunk.weights.buffer(), checked_int(height),
           checked_int(length_), shape);
      const std::vector<cl_int> found = broken.to_host();
      for (std::int64_t k = 0; k < chunk.views; ++k)
        if (found[static_cast<std::size_t>(k)] != 0) throw not_finite(chunk.first + k);
    }
    return true;
  }

  [[nodiscard]] double error(double weight, double row_norm, double largest) const override {
    return weight * (*error_)(unit_roundoff<Real>, smallest_normal, row_norm) +
           stored_rounding<Real>(largest);
  }

 private:
  static opencl::Defines defines() { return {{"VDVR_DOUBLE", is_double<Real> ? "1" : "0"}}; }

  // Some views of so many rows each, and their transforms.
  struct Chunk {
    Chunk(const FourierFilter& of, std::int64_t rows_of_view)
        : f(of),
          height(rows_of_view),
          bins(of.length_ / 2 + 1),
          most_views(views_per_chunk(of.g_, height * of.length_ * std::int64_t{3 * sizeof(Real)})),
          rows(of.state_, count(most_views * height * of.g_.columns), "projection chunk"),
          padded(of.state_, count(most_views * height * of.length_), "padded projections"),
          transformed(of.state_, count(most_views * height * bins * 2), "projection spectra"),
          spectrum(of.state_, std::span<const Real>(of.spectrum_), "ramp filter"),
          weights(of.state_, count(most_views), "view weights"),
          pad(of.state_, "field/fbp/filter_rows_fft", "pad_rows", defines()),
          multiply(of.state_, "field/fbp/filter_rows_fft", "multiply_spectrum", defines()) {}

    // On to the next views; false after the last.
    bool next(std::span<const double> all_weights, const Progress& progress) {
      first += views;
      views = std::min(most_views, f.g_.views() - first);
      if (views == 0) return false;
      report(progress, "filter", static_cast<double>(first) / static_cast<double>(f.g_.views()));
      const std::vector<Real> rounded(all_weights.begin() + first, all_weights.begin() + first + views);
      weights.write(rounded);
      return true;
    }
    // From `rows` to `padded`: all of a chunk, also where fewer views are left, for a plan is made once.
    void filter() {
      constexpr auto precision = is_double<Real> ? Precision::fp64 : Precision::fp32;
      const std::int64_t n = most_views * height;
      pad({{count(f.length_), count(n), 1}, {64, 1, 1}}, padded.buffer(), rows.buffer(),
          checked_int(f.g_.columns), checked_int(f.length_), checked_int(n));
      fft::forward_real(f.state_, precision, f.length_, n, padded.buffer(), transformed.buffer());
      multiply({{count(bins), count(n), 1}, {64, 1, 1}}, transformed.buffer(), spectrum.buffer(),
               checked_int(bins), checked_int(n));
      fft::inverse_real(f.state_, precision, f.length_, n, transformed.buffer(), padded.buffer());
    }

    const FourierFilter& f;
    std::int64_t height, bins, most_views, first = 0, views = 0;
    opencl::DeviceArray<float> rows;
    opencl::DeviceArray<Real> padded, transformed, spectrum, weights;
    opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> pad;
    opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int> multiply;
  };

  // [view][v][u] -> [z][u] of the rows wanted.
  void gather(std::span<const float> scan, std::int64_t view, std::span<const std::int64_t> wanted,
              float* target) const {
    for (const std::int64_t v : wanted) {
      std::copy_n(scan.data() + (view * g_.rows + v) * g_.columns, g_.columns, target);
      target += g_.columns;
    }
  }

  opencl::State& state_;
  const ParallelGeometry& g_;
  std::int64_t length_;
  std::vector<Real> spectrum_;
  std::optional<FourierError> error_;
};

// On the host, in double precision; two rows are one complex row.
class HostFilter : public RowFilter {
 public:
  HostFilter(const ParallelGeometry& g, const std::vector<double>& kernel)
      : g_(g),
        length_(static_cast<std::int64_t>(std::bit_ceil(count(2 * g.columns - 1)))),
        transform_(length_),
        spectrum_(static_cast<std::size_t>(length_)) {
    const std::vector<double> half = kernel_spectrum(kernel, length_);
    for (std::int64_t i = 0; i < length_; ++i) {
      const std::int64_t bin = transform_.bin_at(i);
      // The inverse's 1 / length, a power of two, goes with it.
      spectrum_[static_cast<std::size_t>(i)] =
          half[static_cast<std::size_t>(std::min(bin, length_ - bin))] / static_cast<double>(length_);
    }
    error_.emplace(kernel, half, length_);
  }

  void operator()(std::span<const float> rows, std::span<const double> weights, std::span<float> out,
                  const Progress& progress) override {
    const auto columns = static_cast<std::size_t>(g_.columns), height = static_cast<std::size_t>(g_.rows);
    parallel_for(g_.views(), progress, "filter", [&](std::int64_t view) {
      const auto k = static_cast<std::size_t>(view);
      const float* from = rows.data() + k * height * columns;
      float* to = out.data() + k * height * columns;
      std::vector<std::complex<double>> x(static_cast<std::size_t>(length_));
      for (std::size_t v = 0; v < height; v += 2) {
        const bool two = v + 1 < height;
        for (std::size_t u = 0; u < columns; ++u)
          x[u] = {static_cast<double>(from[v * columns + u]),
                  two ? static_cast<double>(from[(v + 1) * columns + u]) : 0.0};
        std::fill(x.begin() + g_.columns, x.end(), 0.0);
        transform_.forward(x);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] *= spectrum_[i];
        transform_.inverse(x);
        for (std::size_t u = 0; u < columns; ++u) {
          to[u * height + v] = static_cast<float>(weights[k] * x[u].real());
          if (two) to[u * height + v + 1] = static_cast<float>(weights[k] * x[u].imag());
        }
      }
    });
  }

  bool to_device(std::span<const float>, std::span<const double>, const DeviceColumns&,
                 const Progress&) override {
    return false;
  }

  [[nodiscard]] double error(double weight, double row_norm, double largest) const override {
    return weight * (*error_)(unit_roundoff<double>, std::numeric_limits<double>::min(), row_norm) +
           stored_rounding<double>(largest);
  }

 private:
  const ParallelGeometry& g_;
  std::int64_t length_;
  fft::HostFft transform_;
  std::vector<double> spectrum_;
  std::optional<FourierError> error_;
};

// Whether all taps at even distances but the centre are zero, as those of the unwindowed ramp are.
bool odd_only(const std::vector<double>& kernel) {
  for (std::size_t i = 2; i < kernel.size(); i += 2)
    if (kernel[i] != 0) return false;
  return true;
}

// Rows lie as [view][v / 16][u][16] on the device: 16 rows share every tap.
template <class Real>
class ProductFilter : public RowFilter {
 public:
  ProductFilter(opencl::State& state, const ParallelGeometry& g, const std::vector<double>& kernel)
      : state_(state),
        g_(g),
        columns_(static_cast<std::size_t>(g.columns)),
        step_(odd_only(kernel) ? 2 : 1),
        offset_((g.columns + step_ - 1) / step_ + 1),
        centre_(static_cast<Real>(kernel[0])) {
    // Eight columns are summed at once, and the last of them may lie beyond the detector: zeros there.
    std::vector<Real> taps(static_cast<std::size_t>(2 * offset_ + 8), Real{0});
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const std::int64_t e = static_cast<std::int64_t>(i) - offset_, distance = std::abs(step_ * (e + 1) - 1);
      if (distance < g.columns) taps[i] = static_cast<Real>(kernel[static_cast<std::size_t>(distance)]);
    }
    taps_ = opencl::DeviceArray<Real>(state, std::span<const Real>(taps), "ramp filter");
    double sum = kernel[0] * kernel[0];
    for (std::size_t j = 1; j < columns_; ++j) sum += 2 * kernel[j] * kernel[j];
    norm_ = std::sqrt(sum);
  }

  void operator()(std::span<const float> rows, std::span<const double> weights, std::span<float> out,
                  const Progress& progress) override {
    std::vector<std::int64_t> all(static_cast<std::size_t>(g_.rows));
    std::iota(all.begin(), all.end(), 0);
    Chunk chunk(state_, g_, to_chunks(g_.rows));
    const std::int64_t view_size = chunk.view_size;
    opencl::DeviceArray<float> product(state_, count(chunk.most_views * view_size), "filtered chunk");
    const std::size_t per_view = static_cast<std::size_t>(g_.rows) * columns_;
    while (next(chunk, rows, weights, all, progress)) {
      launch(chunk, product, 0, g_.columns, {0, count(view_size), count(g_.columns * 16)});
      product.read_mapped([&](std::span<const float> source) {
        parallel_for(chunk.views, {}, "", [&](std::int64_t k) {
          scatter(
              source.subspan(static_cast<std::size_t>(k * view_size), static_cast<std::size_t>(view_size)),
              out.subspan(static_cast<std::size_t>(chunk.first + k) * per_view, per_view));
        });
      });
    }
  }

  bool to_device(std::span<const float> rows, std::span<const double> weights, const DeviceColumns& target,
                 const Progress& progress) override {
    Chunk chunk(state_, g_, to_chunks(static_cast<std::int64_t>(target.rows.size())));
    while (next(chunk, rows, weights, target.rows, progress)) {
      launch(chunk, *target.values, target.first, target.count,
             {count(chunk.first * target.count * 16), count(target.count * 16),
              count(g_.views() * target.count * 16)});
      const std::vector<cl_int> broken = chunk.broken.to_host();
      for (std::int64_t k = 0; k < chunk.views; ++k)
        if (broken[static_cast<std::size_t>(k)] != 0) throw not_finite(chunk.first + k);
    }
    return true;
  }

  // A sum in runs of 16 rounds each term at most 16 times within its run and once per run after it; the
  // centre's term, the tap, the weight and the product with it round once each, and the tap in double
  // precision at most 8 times before. The sum of |terms| is at most norm(kernel) norm(row).
  [[nodiscard]] double error(double weight, double row_norm, double largest) const override {
    const double n = 16 + std::ceil(static_cast<double>(columns_) / 16) + 12;
    const double gamma = n * unit_roundoff<Real> / (1 - n * unit_roundoff<Real>);
    // Each fused operation, and each tap, may lose this much.
    const double underflow = (2 + row_norm) * 2 * static_cast<double>(columns_) * smallest_normal;
    return weight * (gamma * norm_ * row_norm + underflow) + stored_rounding<Real>(largest);
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
    opencl::DeviceArray<float> in;
    opencl::DeviceArray<Real> weights;
    opencl::DeviceArray<cl_int> broken;
  };

  // Puts the next views' rows on the device; false after the last.
  bool next(Chunk& chunk, std::span<const float> scan, std::span<const double> weights,
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
    const std::vector<Real> rounded(weights.begin() + chunk.first,
                                    weights.begin() + chunk.first + chunk.views);
    chunk.weights.write(rounded);
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

  // `out`: columns [first_column, first_column + out_columns) of each view, mirrored beyond the edges.
  void launch(const Chunk& chunk, opencl::DeviceArray<float>& out, std::int64_t first_column,
              std::int64_t out_columns, const VdvrChunks& places) const {
    const ColumnTuning tuning = column_tuning(state_.info);
    // As many bytes in a vector of sums; of two lanes there is no vector.
    const int lanes = is_double<Real> ? opencl::lanes_of(state_.info, tuning.lanes / 2) : tuning.lanes;
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, Real, VdvrFilteredRows> kernel(
        state_, "field/fbp/filter_rows", "filter_rows",
        {{"VDVR_LANES", std::to_string(lanes)},
         {"VDVR_STEP", std::to_string(step_)},
         {"VDVR_DOUBLE", is_double<Real> ? "1" : "0"}});
    const VdvrFilteredRows shape{.out = places,
                                 .columns = checked_int(g_.columns),
                                 .z_padded = checked_int(chunk.z_padded),
                                 .views = checked_int(chunk.views),
                                 .offset = checked_int(offset_),
                                 .first_column = checked_int(first_column),
                                 .out_columns = checked_int(out_columns)};
    const std::int64_t groups = (g_.columns + 8 * step_ - 1) / (8 * step_) * step_;
    kernel({{count(chunk.z_padded / lanes), count(groups), count(chunk.views)},
            {tuning.local[0], tuning.local[1], 1}},
           out.buffer(), chunk.broken.buffer(), chunk.in.buffer(), taps_.buffer(), chunk.weights.buffer(),
           centre_, shape);
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
  Real centre_;
  opencl::DeviceArray<Real> taps_;
  double norm_ = 0;
};

}  // namespace

bool has_transform(const DeviceInfo& device, std::int64_t columns, Precision precision) {
  return device.is_cpu || fft::good_length(2 * columns - 1) <= fft::longest_in_one_kernel(precision);
}

InputError not_finite(std::int64_t view) {
  return InputError(fmt::format(
      "view {} of the scan is not finite after filtering in fp32; check or scale its line integrals", view));
}

std::unique_ptr<RowFilter> make_row_filter(opencl::State& state, const ParallelGeometry& geometry,
                                           const std::vector<double>& kernel, FilterMethod method,
                                           Precision precision) {
  const bool has_double = state.device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
  if (precision == Precision::fp64 && !has_double) method = FilterMethod::host;
  if (method == FilterMethod::automatic)
    method = geometry.columns <= column_tuning(state.info).product_columns ||
                     !has_transform(state.info, geometry.columns, precision)
                 ? FilterMethod::product
                 : FilterMethod::fourier;
  if (method == FilterMethod::host) return std::make_unique<HostFilter>(geometry, kernel);
  const auto made = [&]<class Real>(Real) -> std::unique_ptr<RowFilter> {
    if (method == FilterMethod::product)
      return std::make_unique<ProductFilter<Real>>(state, geometry, kernel);
    return std::make_unique<FourierFilter<Real>>(state, geometry, kernel);
  };
  return precision == Precision::fp64 ? made(double{}) : made(float{});
}

}  // namespace vdvr
