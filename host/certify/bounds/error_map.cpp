// Bounds of the interpolation error of a plane wave, and the launcher of kernels/certify/bounds/error_map.cl.
// The theorems are in docs/error-bounds.md, section 3: with r_j = |chord| / |arc| and phi_j its phase, R =
// prod r_j, C = prod cos(kappa_j / 2), the worst error is max |1 - R exp(i sum phi_j)|.
#include "vdvr/expert/error_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/base/opencl/kernel.hpp"
#include "host/certify/bounds/wave_error.hpp"
#include "shared/error_map.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrFrequencies) == 44);

namespace {

using std::numbers::pi;
constexpr int kTableSteps = 256;
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

/// Bounds for 2 and for 3 axes at C = i / kTableSteps * kExactProduct. They fall with C: a smaller C admits
/// every R and every phase that a larger one does.
struct Bounds {
  std::array<double, 4> largest{};  ///< by the number of axes
  std::array<std::array<double, kTableSteps + 1>, 2> table{};

  Bounds() {
    largest[1] = 1;
    for (int axes = 2; axes <= 3; ++axes) {
      const auto a = static_cast<std::size_t>(axes);
      largest[a] = product_bound(0, axes, 1 << 16);
      for (int i = 0; i <= kTableSteps; ++i)
        table[a - 2][static_cast<std::size_t>(i)] =
            std::min(largest[a], product_bound(kExactProduct * i / kTableSteps, axes, 4096));
    }
  }
};

const Bounds& bounds() {
  static const Bounds made;
  return made;
}

double table_bound(double C, int axes) {
  const auto i = std::clamp(static_cast<int>(C / kExactProduct * kTableSteps - 0x1p-30), 0, kTableSteps);
  return bounds().table[static_cast<std::size_t>(axes) - 2][static_cast<std::size_t>(i)];
}

void check_axis(const FrequencyAxis& axis) {
  constexpr std::int64_t most = 1 << 24;  // integers that fp32 holds exactly
  const double first = static_cast<double>(axis.first) * axis.step,
               last = static_cast<double>(axis.first + axis.count - 1) * axis.step;
  if (axis.count < 1 || axis.count > most || std::abs(axis.first) > most || beyond_nyquist(first) ||
      beyond_nyquist(last))
    throw InputError(
        fmt::format("error map: {} frequencies from {:.6g} to {:.6g} radians per sample; they have to lie "
                    "within [-pi, pi]",
                    axis.count, first, last));
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

ErrorMap error_map(Device& device, const std::array<FrequencyAxis, 3>& axes, int rate) {
  if (rate < 1) throw InputError(fmt::format("error map: rate {}; the least is 1", rate));
  ErrorMap map;
  std::uint64_t entries = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    check_axis(axes[a]);
    map.size[a] = axes[a].count;
    const auto n = static_cast<std::uint64_t>(axes[a].count);
    if (n > UINT64_MAX / 16 / entries)
      throw ResourceError(fmt::format("error map: {} x {} x {} frequencies pass 2^64 bytes", axes[0].count,
                                      axes[1].count, axes[2].count));
    entries *= n;
  }
  // Rounding: kappa 2 u, sine 4 ulp, both doubled by the square, and three sums and products: below 64 u.
  constexpr double margin = 1 + 0x1p-17;
  std::vector<float> table;
  for (const auto& of_axes : bounds().table)
    for (const double b : of_axes) table.push_back(static_cast<float>(b * (1 + 0x1p-23)));
  opencl::State& state = device.state();
  const opencl::DeviceArray<float> beyond(state, std::span<const float>(table), "bounds of the wave error");
  const opencl::DeviceArray<float> centre(state, entries, "error map"), bound(state, entries, "error map");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrFrequencies> kernel(
      state, "certify/bounds/error_map", "error_map", {{"VDVR_TABLE_STEPS", std::to_string(kTableSteps)}});
  const auto n = [&](std::size_t a) { return static_cast<std::uint64_t>(axes[a].count); };
  const auto first = [&](std::size_t a) { return static_cast<cl_int>(axes[a].first); };
  const auto count = [&](std::size_t a) { return static_cast<cl_int>(axes[a].count); };
  const auto step = [&](std::size_t a) { return static_cast<cl_float>(axes[a].step / rate); };
  const VdvrFrequencies frequencies{.first_x = first(0),
                                    .first_y = first(1),
                                    .first_z = first(2),
                                    .count_x = count(0),
                                    .count_y = count(1),
                                    .count_z = count(2),
                                    .step_x = step(0),
                                    .step_y = step(1),
                                    .step_z = step(2),
                                    .exact_product = static_cast<cl_float>(kExactProduct),
                                    .margin = static_cast<cl_float>(margin)};
  kernel({{n(0), n(1), n(2)}, {64, 1, 1}}, centre.buffer(), bound.buffer(), beyond.buffer(), frequencies);
  opencl::finish(state, "error map");
  map.centre = centre.to_host();
  map.bound = bound.to_host();
  return map;
}

}  // namespace vdvr
