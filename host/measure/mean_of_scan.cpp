// Views in groups, each with sums of its own, which are added in their order: sums do not depend on threads.
#include "vdvr/expert/mean_of_scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/noise/field_variance.hpp"
#include "host/measure/mean_weights.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t most_groups = 16, most_lags = 4;
// Views whose weights' spectrum is looked at, and its frequencies.
constexpr std::int64_t looked_at = 16, frequencies = 512;

struct Sums {
  double mean = 0, variance = 0;
  std::vector<double> of_pixel;             ///< of the detector: the sum of what its samples weigh
  std::array<double, most_lags + 1> lag{};  ///< of weights of rows so far apart
  double passed = 0, white = 0;             ///< power of weights with the noise's spectrum, and without
};

// A view's share of the power that a noise of this spectrum has among white noise's: the row that weighs
// most.
void add_powers(const std::vector<double>& weight, std::int64_t columns, std::span<const float> spectrum,
                Sums& sums) {
  const auto energy = [&](std::int64_t r) {
    double sum = 0;
    for (std::int64_t i = 0; i < columns; ++i)
      sum += weight[at(r * columns + i)] * weight[at(r * columns + i)];
    return sum;
  };
  std::int64_t best = 0;
  double most = 0;
  for (std::int64_t r = 0; r < std::ssize(weight) / columns; ++r)
    if (const double e = energy(r); e > most) most = e, best = r;
  for (std::int64_t f = 0; f < frequencies; ++f) {
    const double step = std::numbers::pi * (static_cast<double>(f) + 0.5) / static_cast<double>(frequencies);
    std::complex<double> sum;
    for (std::int64_t i = 0; i < columns; ++i)
      sum += weight[at(best * columns + i)] * std::polar(1.0, step * static_cast<double>(i));
    const double power = std::norm(sum);
    sums.white += power;
    sums.passed += power * static_cast<double>(spectrum[at(f * std::ssize(spectrum) / frequencies)]);
  }
}

class MeanSumsOfViews {
 public:
  MeanSumsOfViews(const ProjectionSet& scan, const measured::MeanWeights& weights, const MeanNoise& noise)
      : scan_(scan), weights_(weights), noise_(noise) {
    if (!noise.model) return;
    variance_.emplace(scan.geometry, *noise.model);
  }

  void add(std::int64_t k, std::vector<double>& weight, Sums& sums) const {
    const std::int64_t columns = scan_.geometry.columns, pixels = columns * scan_.geometry.rows;
    weights_.of_view(k, weight);
    const float* sample = scan_.data.data() + k * pixels;
    for (std::int64_t i = 0; i < pixels; ++i) sums.mean += weight[at(i)] * static_cast<double>(sample[i]);
    if (!variance_) return;
    for (std::int64_t i = 0; i < pixels; ++i) {
      const double w = weight[at(i)];
      sums.variance += w * w * variance_->of_sample(k, i, sample[i]);
      variance_->for_each_pixel(k, i / columns, i % columns, [&](std::int64_t pixel, double factor) {
        sums.of_pixel[at(pixel)] += w * factor;
      });
    }
    if (!noise_.model->row_correlation.empty())
      for (std::int64_t lag = 0; lag <= most_lags; ++lag)
        for (std::int64_t i = lag * columns; i < pixels; ++i)
          sums.lag[at(lag)] += weight[at(i)] * weight[at(i - lag * columns)];
    const std::int64_t step = std::max<std::int64_t>(1, scan_.geometry.views() / looked_at);
    if (!noise_.model->spectrum.empty() && k % step == 0)
      add_powers(weight, columns, noise_.model->spectrum, sums);
  }

  [[nodiscard]] std::int64_t detector_pixels() const { return variance_ ? variance_->pixels() : 0; }

  // Of the noise that is common to all views. Where stripes were taken off, it went with them.
  [[nodiscard]] double of_flats(const Sums& sums) const {
    const LineIntegralNoise& model = *noise_.model;
    if (noise_.flats < 1 || model.photon.empty() || scan_.report.preparation.stripes) return 0;
    LineIntegralNoise counted = model;
    counted.constant = 0;
    const SampleVariance of_flat(scan_.geometry, counted);
    double sum = 0;
    // A flat's pixel counts what a view's does where the line integral is 0.
    for (std::int64_t i = 0; i < std::ssize(sums.of_pixel); ++i)
      sum += sums.of_pixel[at(i)] * sums.of_pixel[at(i)] * of_flat.of_open_pixel(i);
    return sum / static_cast<double>(noise_.flats);
  }

  // What a preparation left of white noise, in this mean.
  [[nodiscard]] double passed(const Sums& sums) const {
    double share = sums.white > 0 ? sums.passed / sums.white : 1, with_rows = 1;
    const auto& correlation = noise_.model->row_correlation;
    for (std::int64_t lag = 1; lag <= std::min(most_lags, std::ssize(correlation)) && sums.lag[0] > 0; ++lag)
      with_rows += 2 * static_cast<double>(correlation[at(lag - 1)]) * sums.lag[at(lag)] / sums.lag[0];
    return share * std::max(0.0, with_rows);
  }

 private:
  const ProjectionSet& scan_;
  const measured::MeanWeights& weights_;
  const MeanNoise& noise_;
  std::optional<SampleVariance> variance_;
};

}  // namespace

MeanOfScan mean_of_scan(const ProjectionSet& scan, const FieldOptions& field, const MeasuredRegion& region,
                        const MeanNoise& noise, std::uint64_t max_memory_bytes, const Progress& progress) {
  const measured::MeanWeights weights(scan, field, region, max_memory_bytes);
  const MeanSumsOfViews views(scan, weights, noise);
  const std::int64_t K = scan.geometry.views(), pixels = scan.geometry.rows * scan.geometry.columns,
                     groups = std::min(K, most_groups);
  io::require_memory(
      scan.data.resident_bytes() + count(groups) * (weights.bytes_of_view() + sizeof(double) * count(pixels)),
      max_memory_bytes, "the weights of a mean");
  std::vector<Sums> sums(at(groups));
  parallel_for(groups, progress, "mean", [&](std::int64_t group) {
    std::vector<double> weight;
    sums[at(group)].of_pixel.assign(at(views.detector_pixels()), 0.0);
    for (std::int64_t k = group * K / groups; k < (group + 1) * K / groups; ++k)
      views.add(k, weight, sums[at(group)]);
  });
  Sums& all = sums.front();
  for (std::int64_t g = 1; g < groups; ++g) {
    const Sums& one = sums[at(g)];
    all.mean += one.mean;
    all.variance += one.variance;
    all.white += one.white;
    all.passed += one.passed;
    for (std::size_t l = 0; l < all.lag.size(); ++l) all.lag[l] += one.lag[l];
    for (std::size_t i = 0; i < all.of_pixel.size(); ++i) all.of_pixel[i] += one.of_pixel[i];
  }
  MeanOfScan out;
  out.mean = all.mean;
  if (!noise.model) return out;
  const double share = views.passed(all), rings = views.of_flats(all) * share,
               variance = all.variance * share + rings;
  out.sigma = std::sqrt(variance);
  out.of_flats = variance > 0 ? rings / variance : 0;
  return out;
}

}  // namespace vdvr
