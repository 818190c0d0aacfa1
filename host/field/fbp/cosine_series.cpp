// Matrices of the cosine series.
#include "host/field/fbp/cosine_series.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdvr {
namespace {

using std::numbers::pi;

// The derivative of g at d, by its sum.
double derivative(std::int64_t n, double d, int order, double pitch) {
  double sum = 0;
  for (std::int64_t m = 1; m < n; ++m) {
    const double omega = pi * static_cast<double>(m) / (static_cast<double>(n) * pitch);
    const double phase = pi * static_cast<double>(m) * d / static_cast<double>(n);
    sum += std::pow(omega, order) * (order % 2 == 0 ? std::cos(phase) : std::sin(phase));
  }
  return (order % 4 == 1 || order % 4 == 2 ? -sum : sum) / static_cast<double>(n);
}

}  // namespace

// sin((n - 1/2) t) / (2 n sin(t / 2)), t = pi d / n.
double cosine_kernel(std::int64_t n, double d) {
  const double period = 2.0 * static_cast<double>(n);
  const double reduced = d - period * std::round(d / period);  // the closed form loses digits far from 0
  const double count = static_cast<double>(n), t = pi * reduced / count, s = std::sin(t / 2);
  if (std::abs(s) < 1e-9) return (count - 0.5) / count;
  return std::sin((count - 0.5) * t) / (2 * count * s);
}

double cosine_gain(std::int64_t n) {
  if (n == 1) return 1;
  constexpr std::int64_t density = 8;  // positions to a sample
  std::vector<double> kernel;          // at eighths of a sample, half a period
  for (std::int64_t i = 0; i <= density * n; ++i)
    kernel.push_back(cosine_kernel(n, static_cast<double>(i) / density));
  const auto at = [&](std::int64_t i) {
    const std::int64_t period = 2 * density * n, m = ((i % period) + period) % period;
    return kernel[static_cast<std::size_t>(std::min(m, period - m))];
  };
  double largest = 0;
  // By symmetry half of the positions will do, from the edge at -1/2.
  for (std::int64_t i = 0; i <= (density * n + 1) / 2; ++i) {
    const std::int64_t position = i - density / 2;
    double sum = 0;
    for (std::int64_t r = 0; r < n; ++r)
      sum += std::abs(at(position - density * r) + at(position + density * (r + 1)));
    largest = std::max(largest, sum);
  }
  // A product with a sign pattern is a series of n terms, which rises by no more than this between the
  // positions (Ehlich and Zeller 1964).
  return largest / std::cos(pi / (2.0 * density));
}

UpsampledColumns upsampled_columns(std::int64_t n, int rate, double margin_pixels) {
  UpsampledColumns c;
  c.rate = rate;
  c.first = rate == 1 ? 0.0 : -0.5;
  const double below = c.first + 0.5 + margin_pixels;  // from the first column down to the lowest position
  c.pad = static_cast<std::int64_t>(std::ceil(below * rate)) + 2;
  const double last = static_cast<double>(n) - 0.5 + margin_pixels;
  c.count = static_cast<std::int64_t>(std::ceil((last - c.first) * rate)) + c.pad + 3;
  return c;
}

// The derivative of a series is a series of the same kind: its values at the samples, then these resampled.
// Closed form but for n^2 entries, where the sum at every position would cost n for each.
static std::vector<double> derivatives_anywhere(std::int64_t n, std::span<const double> positions, int order,
                                                double pitch) {
  const auto width = static_cast<std::size_t>(n);
  std::vector<double> samples(width);
  for (std::size_t i = 0; i < width; ++i) samples[i] = static_cast<double>(i);
  const auto at_samples = resampling_matrix(n, samples, order, pitch, 1),
             values = resampling_matrix(n, positions, 0, pitch, 0);
  std::vector<double> matrix(positions.size() * width, 0.0);
  for (std::size_t p = 0; p < positions.size(); ++p)
    for (std::size_t j = 0; j < width; ++j)
      for (std::size_t i = 0; i < width; ++i)
        matrix[p * width + i] += values[p * width + j] * at_samples[j * width + i];
  return matrix;
}

std::vector<double> resampling_matrix(std::int64_t n, std::span<const double> positions, int order,
                                      double pitch, int lattice) {
  const auto width = static_cast<std::size_t>(n);
  if (order > 0 && lattice == 0) return derivatives_anywhere(n, positions, order, pitch);
  std::vector<double> table;  // g on the lattice over one period
  const std::int64_t period = 2 * n * lattice;
  if (order > 0 && lattice > 0) {
    table.resize(static_cast<std::size_t>(period));
    for (std::int64_t j = 0; j <= period / 2; ++j) {
      const double value = derivative(n, static_cast<double>(j) / lattice, order, pitch);
      table[static_cast<std::size_t>((period - j) % period)] = order % 2 == 0 ? value : -value;
      table[static_cast<std::size_t>(j)] = value;
    }
  }
  const auto g = [&](double d) {
    if (order == 0) return cosine_kernel(n, d);
    const auto j = static_cast<std::int64_t>(std::llround(d * lattice));
    return table[static_cast<std::size_t>(((j % period) + period) % period)];
  };
  std::vector<double> matrix(positions.size() * width);
  for (std::size_t p = 0; p < positions.size(); ++p)
    for (std::int64_t i = 0; i < n; ++i)
      matrix[p * width + static_cast<std::size_t>(i)] =
          g(positions[p] - static_cast<double>(i)) + g(positions[p] + static_cast<double>(i) + 1);
  return matrix;
}

std::vector<double> analysis_matrix(std::int64_t n) {
  const auto width = static_cast<std::size_t>(n);
  std::vector<double> matrix(width * width);
  for (std::size_t m = 0; m < width; ++m)
    for (std::size_t i = 0; i < width; ++i)
      matrix[m * width + i] =
          (m == 0 ? 1.0 : 2.0) / static_cast<double>(n) *
          std::cos(pi * static_cast<double>(m) * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
  return matrix;
}

}  // namespace vdvr
