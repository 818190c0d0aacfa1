// Bounds of the interpolation error of a plane wave. The theorems are in docs/error-bounds.md, section 3:
// with r_j = |chord| / |arc| and phi_j its phase, R = prod r_j, C = prod cos(kappa_j / 2), the worst error is
// max |1 - R exp(i sum phi_j)|.
#include "host/certify/bounds/wave_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "vdvr/error.hpp"
#include "vdvr/expert/error_map.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
// (1 - exp(-D))^2 / D is at most 0.40727, at D = 1.2564; twice that bounds phi_j^2 / (L_j (Lambda_j - L_j)).
constexpr double kPhaseFactor = 0.8146;

double axis_error(double kappa) { return 2 * std::pow(std::sin(kappa / 4), 2); }

bool beyond_nyquist(double kappa) { return !(std::abs(kappa) <= pi * (1 + 0x1p-40)); }

// An upper bound of the error while R lies in [low, high] and prod cos is C: each factor is taken at the end
// where it is largest.
double interval_bound(double low, double high, double C, int axes) {
  const double n = axes;
  double phase = n * pi / 2 * (1 - std::pow(low, 1 / n));
  if (C > 0 && low > 0)
    phase = std::min(phase, std::sqrt(kPhaseFactor * std::log(high / C) * -std::log(low)));
  const double s = std::sin(std::min(pi / 2, phase / 2));
  return std::sqrt((1 - low) * (1 - low) + 4 * high * s * s);
}

// The largest over C <= R <= 1, rounded up.
double product_bound(double C, int axes, int intervals) {
  double worst = 0;
  for (int i = 0; i < intervals; ++i) {
    const double low = C + (1 - C) * i / intervals, high = C + (1 - C) * (i + 1) / intervals;
    worst = std::max(worst, interval_bound(low, high, C, axes));
  }
  return worst * (1 + 0x1p-40);
}

/// Bounds for 2 and for 3 axes at C = i / wave_error_steps * kExactProduct. They fall with C: a smaller C
/// admits every R and every phase that a larger one does.
struct Bounds {
  std::array<double, 4> largest{};  ///< by the number of axes
  WaveErrorTable table{};

  Bounds() {
    largest[1] = 1;
    for (int axes = 2; axes <= 3; ++axes) {
      const auto a = static_cast<std::size_t>(axes);
      largest[a] = product_bound(0, axes, 1 << 16);
      for (int i = 0; i <= wave_error_steps; ++i)
        table[a - 2][static_cast<std::size_t>(i)] =
            std::min(largest[a], product_bound(kExactProduct * i / wave_error_steps, axes, 4096));
    }
  }
};

const Bounds& bounds() {
  static const Bounds made;
  return made;
}

double table_bound(double C, int axes) {
  const auto i =
      std::clamp(static_cast<int>(C / kExactProduct * wave_error_steps - 0x1p-30), 0, wave_error_steps);
  return bounds().table[static_cast<std::size_t>(axes) - 2][static_cast<std::size_t>(i)];
}

}  // namespace

double centre_error(std::span<const double> kappa) {
  double e = 0;
  for (const double k : kappa) e += axis_error(k) * (1 - e);
  return e;
}

double largest_wave_error(int axes) {
  if (axes < 1 || axes > 3) throw InputError(fmt::format("wave error: {} axes; there may be 1 to 3", axes));
  return bounds().largest[static_cast<std::size_t>(axes)];
}

const WaveErrorTable& wave_error_table() { return bounds().table; }

double wave_error_of_axis(double kappa) {
  return beyond_nyquist(kappa) ? std::numeric_limits<double>::infinity() : axis_error(kappa);
}

double wave_error_bound_of(const std::array<double, 3>& of_axes) {
  std::array<double, 3> x = of_axes;
  double e = 0;  // as centre_error
  for (const double one : x) e += one * (1 - e);
  std::sort(x.begin(), x.end());
  if (std::isinf(x[2])) return 2;  // the wave aliases: |f| + |Pf| is all there is
  if (x[1] == 0 || 1 - e >= kExactProduct) return e;
  // The largest two axes alone, then the third added; or all three at once.
  const double pair = x[1] + x[2] - x[1] * x[2];
  const double two = 1 - pair >= kExactProduct ? pair : std::min(x[1] + x[2], table_bound(1 - pair, 2));
  return x[0] == 0 ? two : std::min(two + x[0], table_bound(1 - e, 3));
}

double wave_error_bound(std::span<const double> kappa) {
  std::array<double, 3> of_axes{};
  if (kappa.size() > of_axes.size())
    throw InputError(fmt::format("wave error: {} axes; there may be 1 to 3", kappa.size()));
  std::transform(kappa.begin(), kappa.end(), of_axes.begin(), wave_error_of_axis);
  return wave_error_bound_of(of_axes);
}

}  // namespace vdvr
