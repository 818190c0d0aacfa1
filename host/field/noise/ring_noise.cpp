// What averaged flats add to the variance of F. An error e_i of column i, the same in all views, has in F at
// a distance r from the axis the weight s_i = (1 / pi) times the integral over a half turn of pi g(r
// cos(theta) - i), and the sum over i of s_i^2 is pi^2 / 12 * (3 / pi^2) / r for r beyond a column or two,
// pi^2 / 12 at the axis. F's variance is pi^2 v / (12 K), so that the share is (3 / pi^2) K / r of e's
// variance over v. Over a full turn each ring is the mean of two columns: half of that.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "vdvr/expert/noise.hpp"

namespace vdvr {

std::optional<RingNoise> ring_noise(const ProjectionSet& scan, std::int64_t flats) {
  if (scan.cone || flats < 1) return std::nullopt;
  const auto& theta = scan.geometry.theta_rad;
  const auto [low, high] = std::minmax_element(theta.begin(), theta.end());
  using std::numbers::pi;
  const double seen_twice = std::clamp((*high - *low) / pi, 1.0, 2.0);
  // A flat's pixel counts what the open beam has, a view's e^-p of that.
  const auto size = static_cast<std::int64_t>(scan.data.size()),
             step = std::max<std::int64_t>(1, size / 1000000);
  double sum = 0;
  std::int64_t n = 0;
  for (std::int64_t i = 0; i < size; i += step, ++n) sum += std::exp(static_cast<double>(scan.data[at(i)]));
  const double share = static_cast<double>(scan.geometry.views()) / static_cast<double>(flats) *
                       (static_cast<double>(n) / sum);
  return RingNoise{flats, share, 3 / (pi * pi) / seen_twice * share};
}

}  // namespace vdvr
