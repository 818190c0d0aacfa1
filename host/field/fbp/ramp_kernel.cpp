// Ramp kernels in double precision: closed form for Ram-Lak, Gauss-Legendre quadrature of the windowed ramp
// otherwise.
#include "host/field/fbp/ramp_kernel.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

// The window at a fraction r of the cutoff frequency, 0 <= r <= 1.
std::function<double(double)> window(RampWindow of) {
  switch (of) {
    case RampWindow::shepp_logan:
      return [](double r) { return r == 0 ? 1.0 : std::sin(pi * r / 2) / (pi * r / 2); };
    case RampWindow::cosine:
      return [](double r) { return std::cos(pi * r / 2); };
    case RampWindow::hamming:
      return [](double r) { return 0.54 + 0.46 * std::cos(pi * r); };
    case RampWindow::hann:
      return [](double r) { return 0.5 + 0.5 * std::cos(pi * r); };
    default:
      return [](double) { return 1.0; };
  }
}

// Nodes and weights of the 8-point Gauss-Legendre rule on [-1, 1] (Abramowitz and Stegun, table 25.4).
constexpr std::array<double, 4> gauss_node{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                           0.9602898564975363};
constexpr std::array<double, 4> gauss_weight{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                             0.1012285362903763};

// (1 / (2 pi^2)) integral over [0, cutoff pi] of w W(w / (cutoff pi)) cos(n w) dw, panels shorter than half
// an oscillation.
double windowed(std::int64_t n, double cutoff, const std::function<double(double)>& w) {
  const double end = cutoff * pi;
  const auto panels = static_cast<std::int64_t>(std::ceil(static_cast<double>(n) * cutoff)) + 4;
  const double half = end / static_cast<double>(2 * panels);
  double sum = 0;
  for (std::int64_t p = 0; p < panels; ++p) {
    const double middle = (2 * static_cast<double>(p) + 1) * half;
    for (std::size_t i = 0; i < gauss_node.size(); ++i)
      for (const double side : {-1.0, 1.0}) {
        const double omega = middle + side * gauss_node[i] * half;
        sum += gauss_weight[i] * omega * w(omega / end) * std::cos(static_cast<double>(n) * omega);
      }
  }
  return sum * half / (2 * pi * pi);
}

}  // namespace

std::vector<double> ramp_kernel(const FieldOptions& field, double pitch, std::int64_t n) {
  const auto w = window(field.filter);
  if (!(field.cutoff > 0 && field.cutoff <= 1))
    throw InputError(fmt::format("`filter_cutoff` {} must be above 0 and at most 1 (Nyquist)", field.cutoff));
  const bool closed_form = field.filter == RampWindow::ram_lak && field.cutoff == 1.0;
  std::vector<double> g(static_cast<std::size_t>(n));
  for (std::int64_t i = 0; i < n; ++i) {
    double value = 0;
    if (!closed_form) value = windowed(i, field.cutoff, w);
    else if (i == 0) value = 0.25;
    else if (i % 2 == 1) value = -1.0 / (pi * pi * static_cast<double>(i) * static_cast<double>(i));
    g[static_cast<std::size_t>(i)] = value / pitch;
  }
  return g;
}

}  // namespace vdvr
