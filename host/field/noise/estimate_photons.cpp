// Two estimates of photons (docs/noise.md).
#include "host/field/noise/estimate_photons.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "host/base/opencl/host_fft.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
// The median of chi^2 with one degree of freedom.
constexpr double median_of_chi2 = 0.454936423119572;
// As many samples give the median to a few thousandths.
constexpr std::int64_t most_samples = std::int64_t{1} << 21;

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Four-term Blackman-Harris window of n samples (Harris, Proc. IEEE 66, 1978): side lobes below -92 dB.
std::vector<double> blackman_harris(std::int64_t n) {
  std::vector<double> w(at(n));
  for (std::int64_t i = 0; i < n; ++i) {
    const double t = 2 * pi * static_cast<double>(i) / static_cast<double>(n);
    w[at(i)] = 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) - 0.01168 * std::cos(3 * t);
  }
  return w;
}
// From the middle of its main lobe to the first zero, in bins.
constexpr double lobe = 4;

// The step of equally spaced angles, in their order; 0 where they are not.
double even_step(const ProjectionSet& scan, const std::vector<std::int64_t>& order) {
  const auto angle = [&](std::size_t i) { return scan.geometry.theta_rad[at(order[i])]; };
  const double step = (angle(order.size() - 1) - angle(0)) / static_cast<double>(order.size() - 1);
  for (std::size_t i = 1; i < order.size(); ++i)
    if (!(std::abs(angle(i) - angle(i - 1) - step) < 0.05 * std::abs(step))) return 0;
  return std::abs(step);
}

// One over the variance of p, over that of 0.
double share_of_open(double p, Integrals integrals) {
  return integrals == Integrals::logarithms ? std::exp(-p) : 1.0;
}

// Power in the wedge of one row's sinogram, and the mean of e^p under the same windows.
class Wedge {
 public:
  Wedge(const ProjectionSet& scan, std::vector<std::int64_t> order, double step, Integrals integrals)
      : scan_(scan),
        integrals_(integrals),
        order_(std::move(order)),
        views_(std::bit_floor(order_.size())),
        columns_(std::bit_floor(at(scan.geometry.columns))),
        along_views_(static_cast<std::int64_t>(views_)),
        along_columns_(static_cast<std::int64_t>(columns_)),
        window_views_(blackman_harris(static_cast<std::int64_t>(views_))),
        window_columns_(blackman_harris(static_cast<std::int64_t>(columns_))) {
    const ParallelGeometry& g = scan.geometry;
    const double radius = std::max(g.center, static_cast<double>(g.columns - 1) - g.center) + 0.5;
    for (std::size_t k = 0; k < views_; ++k)
      for (std::size_t i = 0; i < columns_; ++i) {
        const double nu = frequency(along_views_.bin_at(static_cast<std::int64_t>(k)), views_),
                     f = frequency(along_columns_.bin_at(static_cast<std::int64_t>(i)), columns_),
                     widened = f + lobe / static_cast<double>(columns_);
        if (nu > radius * widened * step + lobe / static_cast<double>(views_))
          empty_.push_back(k * columns_ + i);
      }
  }
  [[nodiscard]] bool is_wide_enough() const { return empty_.size() >= 100; }

  // Appends power over the mean of e^p, which is 1 / photons times an exponential variate.
  void look(std::int64_t row, std::vector<double>& powers) const {
    const ParallelGeometry& g = scan_.geometry;
    const std::size_t first_view = (order_.size() - views_) / 2,
                      first_column = (at(g.columns) - columns_) / 2;
    std::vector<std::complex<double>> x(views_ * columns_);
    double open = 0;
    for (std::size_t k = 0; k < views_; ++k)
      for (std::size_t i = 0; i < columns_; ++i) {
        const double p = static_cast<double>(
            scan_.data[at((order_[first_view + k] * g.rows + row) * g.columns) + first_column + i]);
        const double w = window_views_[k] * window_columns_[i];
        x[k * columns_ + i] = w * p;
        open += w * w / share_of_open(p, integrals_);
      }
    for (std::size_t k = 0; k < views_; ++k)
      along_columns_.forward(std::span(x).subspan(k * columns_, columns_));
    std::vector<std::complex<double>> column(views_);
    for (std::size_t i = 0; i < columns_; ++i) {
      for (std::size_t k = 0; k < views_; ++k) column[k] = x[k * columns_ + i];
      along_views_.forward(column);
      for (std::size_t k = 0; k < views_; ++k) x[k * columns_ + i] = column[k];
    }
    for (const std::size_t i : empty_) powers.push_back(std::norm(x[i]) / open);
  }

 private:
  static double frequency(std::int64_t bin, std::size_t n) {
    return static_cast<double>(std::min(bin, static_cast<std::int64_t>(n) - bin)) / static_cast<double>(n);
  }

  const ProjectionSet& scan_;
  Integrals integrals_;
  std::vector<std::int64_t> order_;
  std::size_t views_, columns_;
  fft::HostFft along_views_, along_columns_;
  std::vector<double> window_views_, window_columns_;
  std::vector<std::size_t> empty_;
};

}  // namespace

std::vector<std::int64_t> views_by_angle(const ProjectionSet& scan) {
  const std::vector<double>& theta = scan.geometry.theta_rad;
  std::vector<double> turned(theta.size());
  std::transform(theta.begin(), theta.end(), turned.begin(), [](double t) {
    const double within = std::fmod(t, 2 * pi);
    return within < 0 ? within + 2 * pi : within;
  });
  std::vector<std::int64_t> order(theta.size());
  std::iota(order.begin(), order.end(), std::int64_t{0});
  // Scans of one turn or less stay as they are, wherever they begin.
  const auto [low, high] = std::minmax_element(theta.begin(), theta.end());
  const std::vector<double>& angle = *high - *low <= 2 * pi ? theta : turned;
  // Views at other heights see other parts of the sample: neighbours are of one stand.
  const std::vector<double>& shift = scan.geometry.row_shift;
  const bool moved = !shift.empty() && !scan.geometry.extension.common_heights;
  std::stable_sort(order.begin(), order.end(), [&](std::int64_t a, std::int64_t b) {
    if (moved && shift[at(a)] != shift[at(b)]) return shift[at(a)] < shift[at(b)];
    return angle[at(a)] < angle[at(b)];
  });
  return order;
}

std::optional<double> photons_by_differences(const ProjectionSet& scan, Integrals integrals) {
  const ParallelGeometry& g = scan.geometry;
  if (g.views() < 3 || g.columns < 3) return std::nullopt;
  const std::vector<std::int64_t> order = views_by_angle(scan);
  const std::int64_t all = (g.views() - 2) * g.rows * (g.columns - 2),
                     stride = std::max<std::int64_t>(1, all / most_samples);
  constexpr std::array<double, 3> second{1, -2, 1};
  std::vector<double> shares;
  for (std::int64_t n = 0; n < all; n += stride) {
    const std::int64_t i = n % (g.columns - 2), row = n / (g.columns - 2) % g.rows,
                       k = n / (g.columns - 2) / g.rows;
    double difference = 0, mean = 0;
    for (std::int64_t a = 0; a < 3; ++a)
      for (std::int64_t b = 0; b < 3; ++b) {
        const double p =
            static_cast<double>(scan.data[at((order[at(k + a)] * g.rows + row) * g.columns + i + b)]);
        difference += second[at(a)] * second[at(b)] * p;
        mean += p / 9;
      }
    shares.push_back(difference * difference * share_of_open(mean, integrals) / 36);
  }
  const double share = median_of(shares) / median_of_chi2;
  return share > 0 && std::isfinite(share) ? std::optional(1 / share) : std::nullopt;
}

std::optional<double> photons_by_wedge(const ProjectionSet& scan, Integrals integrals) {
  const ParallelGeometry& g = scan.geometry;
  if (scan.cone || g.views() < 16 || g.columns < 16) return std::nullopt;
  const std::vector<std::int64_t> order = views_by_angle(scan);
  const double step = even_step(scan, order);
  if (!(step > 0)) return std::nullopt;
  const Wedge wedge(scan, order, step, integrals);
  if (!wedge.is_wide_enough()) return std::nullopt;
  std::vector<double> powers;
  const std::int64_t looked_at = std::min<std::int64_t>(8, g.rows);
  for (std::int64_t i = 0; i < looked_at; ++i) wedge.look((2 * i + 1) * g.rows / (2 * looked_at), powers);
  const double share = median_of(powers) / std::numbers::ln2;
  return share > 0 && std::isfinite(share) ? std::optional(1 / share) : std::nullopt;
}

}  // namespace vdvr
