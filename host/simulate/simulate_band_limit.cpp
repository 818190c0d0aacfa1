// The ideal low-pass as a matrix product, halved by its symmetry: w[i][n] = w[U-1-i][N-1-n], so the even and
// odd parts of a row about the detector's middle give the even and odd parts of the result. Rows go through
// in batches, so that a row of weights is built once for all of them. Equations in the header; called by
// simulate.cpp.
#include "host/simulate/simulate_band_limit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace vdvr {
namespace {

constexpr std::int64_t batch = 16;  // rows at once: tuning only

using Lane = std::array<double, batch>;

// acc[r] = sum_n weights[n] part[n][r]
Lane product(const std::vector<double>& weights, const double* part) {
  Lane sum{};
  for (const double w : weights) {
    for (std::size_t r = 0; r < batch; ++r) sum[r] += w * part[r];
    part += batch;
  }
  return sum;
}

}  // namespace

BandLimiter::BandLimiter(std::int64_t columns) : columns_(columns) {
  const std::int64_t n = rate * columns;
  kernel_.resize(static_cast<std::size_t>(2 * n));
  for (std::int64_t j = 0; j < 2 * n; ++j) {
    // The numerator's argument pi q (2U - 1) / (4N) is reduced in integers: its sine is right for wide
    // detectors too.
    const std::int64_t q = 2 * j + 1, turn = (q % (8 * n)) * (2 * columns - 1) % (8 * n);
    const double unit = std::numbers::pi / static_cast<double>(4 * n);
    kernel_[static_cast<std::size_t>(j)] =
        std::sin(unit * static_cast<double>(turn)) /
        (std::sin(unit * static_cast<double>(q)) * static_cast<double>(2 * n));
  }
}

void BandLimiter::apply(std::span<const double> fine, std::span<double> out) const {
  const std::int64_t n = rate * columns_, rows = static_cast<std::int64_t>(out.size()) / columns_;
  std::vector<double> parts(static_cast<std::size_t>(n * batch));
  for (std::int64_t row = 0; row < rows; row += batch)
    apply_batch(fine.data() + row * n, std::min(batch, rows - row), out.data() + row * columns_, parts);
}

void BandLimiter::apply_batch(const double* fine, std::int64_t rows, double* out,
                              std::vector<double>& parts) const {
  const std::int64_t n = rate * columns_, half = n / 2;
  double* even = parts.data();
  double* odd = parts.data() + half * batch;
  std::fill(parts.begin(), parts.end(), 0.0);
  for (std::int64_t r = 0; r < rows; ++r)
    for (std::int64_t k = 0; k < half; ++k) {
      const double a = fine[r * n + k], b = fine[r * n + n - 1 - k];
      even[k * batch + r] = (a + b) / 2;
      odd[k * batch + r] = (a - b) / 2;
    }
  std::vector<double> even_weights(static_cast<std::size_t>(half)),
      odd_weights(static_cast<std::size_t>(half));
  const auto kernel = [this](std::int64_t q) {
    return kernel_[static_cast<std::size_t>((std::abs(q) - 1) / 2)];
  };
  const auto weight = [&](std::int64_t i, std::int64_t k) {
    const std::int64_t centre = rate * (2 * i + 1);  // of pixel i, in units of pi / (2 N)
    return kernel(centre - 2 * k - 1) + kernel(centre + 2 * k + 1);
  };
  for (std::int64_t i = 0; i < (columns_ + 1) / 2; ++i) {
    for (std::int64_t k = 0; k < half; ++k) {
      const double a = weight(i, k), b = weight(i, n - 1 - k);
      even_weights[static_cast<std::size_t>(k)] = a + b;
      odd_weights[static_cast<std::size_t>(k)] = a - b;
    }
    const Lane e = product(even_weights, even), o = product(odd_weights, odd);
    for (std::int64_t r = 0; r < rows; ++r) {
      out[r * columns_ + i] = e[static_cast<std::size_t>(r)] + o[static_cast<std::size_t>(r)];
      out[r * columns_ + columns_ - 1 - i] = e[static_cast<std::size_t>(r)] - o[static_cast<std::size_t>(r)];
    }
  }
}

}  // namespace vdvr
