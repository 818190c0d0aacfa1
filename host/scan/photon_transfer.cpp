#include "host/scan/photon_transfer.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t fewest_flats = 5;

double upper_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Median of chi^2 over its degrees of freedom (Wilson and Hilferty 1931).
double median_of_variance(double n) { return std::pow(1 - 2 / (9 * n), 3); }

using Runs = std::vector<std::vector<std::int64_t>>;

Runs one_run(std::int64_t frames) {
  Runs out(1);
  for (std::int64_t k = 0; k < frames; ++k) out.front().push_back(k);
  return out;
}

struct Moments {
  std::vector<double> mean, variance;  // by pixel; the latter within runs
};

double freedom(const Runs& runs) {
  double n = 0;
  for (const auto& run : runs) n += static_cast<double>(run.size()) - 1;
  return n;
}

// Of frames less `dark`, each times what brings its level to that of all.
Moments moments_of(const io::Frames& frames, const Runs& runs, std::size_t size,
                   const std::vector<double>& dark, bool levelled) {
  Moments out{std::vector<double>(size), std::vector<double>(size)};
  std::vector<double> frame(size), levels;
  if (levelled) {
    for (std::int64_t k = 0; k < frames.count; ++k) {
      frames.read(k, 1, frame.data());
      double level = 0;
      for (std::size_t i = 0; i < size; ++i) level += frame[i] - dark[i];
      levels.push_back(level);
    }
  }
  double all = 0;
  for (const double level : levels) all += level / static_cast<double>(levels.size());
  std::vector<double> mean(size);
  for (const auto& run : runs) {
    std::fill(mean.begin(), mean.end(), 0.0);
    double n = 0;
    for (const std::int64_t k : run) {
      frames.read(k, 1, frame.data());
      const double scale = levelled ? all / levels[at(k)] : 1;
      ++n;
      // Welford 1962.
      for (std::size_t i = 0; i < size; ++i) {
        const double value = scale * (frame[i] - (dark.empty() ? 0 : dark[i])), off = value - mean[i];
        mean[i] += off / n;
        out.variance[i] += off * (value - mean[i]);
      }
    }
    for (std::size_t i = 0; i < size; ++i) out.mean[i] += mean[i] * n / static_cast<double>(frames.count);
  }
  for (double& v : out.variance) v /= std::max(1.0, freedom(runs));
  return out;
}

}  // namespace

std::optional<LineIntegralNoise> photon_transfer(const io::Frames& flats, const io::Frames& darks,
                                                 std::int64_t rows, std::int64_t columns, const Runs& runs) {
  const Runs of_flats = runs.empty() ? one_run(flats.count) : runs;
  if (freedom(of_flats) < fewest_flats - 1) return std::nullopt;
  const std::size_t size = at(rows * columns);
  Moments dark{std::vector<double>(size), {}};
  if (darks.count > 0) dark = moments_of(darks, one_run(darks.count), size, {}, false);
  const double read =
      darks.count > 1 ? upper_median(dark.variance) / median_of_variance(static_cast<double>(darks.count - 1))
                      : 0;
  const Moments flat = moments_of(flats, of_flats, size, dark.mean, true);
  const auto is_usable = [&](std::size_t i) {
    return flat.mean[i] > 0 && std::isfinite(flat.mean[i]) && std::isfinite(flat.variance[i]);
  };
  const double median = median_of_variance(freedom(of_flats));
  std::vector<double> gains, levels;
  for (std::size_t i = 0; i < size; ++i)
    if (is_usable(i)) {
      gains.push_back((flat.variance[i] / median - read) / flat.mean[i]);
      levels.push_back(flat.mean[i]);
    }
  if (gains.empty()) return std::nullopt;
  const double gain = upper_median(std::move(gains)), level = upper_median(std::move(levels));
  if (!(gain > 0) || !std::isfinite(gain)) return std::nullopt;
  LineIntegralNoise out;
  out.source = "flats";
  out.photons = level / gain;
  for (std::size_t i = 0; i < size; ++i) {
    const double open = is_usable(i) ? flat.mean[i] : level;
    out.photon.push_back(static_cast<float>(gain / open));
    out.read.push_back(static_cast<float>(read / open / open));
  }
  return out;
}

LineIntegralNoise binned(const LineIntegralNoise& noise, std::int64_t rows, std::int64_t columns,
                         int binning) {
  if (binning == 1) return noise;
  LineIntegralNoise out = noise;
  const double pixels = static_cast<double>(binning) * binning;
  out.photons *= pixels;
  out.constant /= pixels;
  for (std::vector<float>* values : {&out.photon, &out.read}) {
    if (values->size() < 2) {
      for (float& v : *values) v = static_cast<float>(static_cast<double>(v) / pixels);
      continue;
    }
    const std::vector<float> fine = std::move(*values);
    values->assign(at(rows / binning * (columns / binning)), 0.0f);
    // The variance of a mean of n is the mean of theirs over n.
    for (std::int64_t v = 0; v < rows / binning * binning; ++v)
      for (std::int64_t u = 0; u < columns / binning * binning; ++u)
        (*values)[at(v / binning * (columns / binning) + u / binning)] +=
            static_cast<float>(static_cast<double>(fine[at(v * columns + u)]) / (pixels * pixels));
  }
  return out;
}

}  // namespace vdvr
