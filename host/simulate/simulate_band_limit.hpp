// The ideal low-pass of `simulate --band-limited`: rows sampled 16 times per pixel become rows of pixels that
// hold nothing above the detector's Nyquist frequency. Called by simulate.cpp.
//
// Fine sample n = 16 i + f of pixel i lies at i - 1/2 + (f + 1/2)/16, n = 0 .. N-1, N = 16 U: symmetric
// within each pixel, covering the detector from edge to edge. With the half-sample mirror extension about
// both edges (the one F is defined by, so that nothing wraps around) a row is the cosine series  sum_m c_m
// cos(pi m (n + 1/2) / N); its terms m < U lie below Nyquist (U is Nyquist itself, and is 0 at every pixel
// centre). Keeping those and evaluating at the centres is
//   out[i] = sum_n w[i][n] in[n],  w[i][n] = (D(b_i - b_n) + D(b_i + b_n)) / (2 N),
//   D(x) = 1 + 2 sum_{m=1}^{U-1} cos(m x) = sin((U - 1/2) x) / sin(x / 2),  b_i = pi (i + 1/2) / U, b_n = pi
//   (n + 1/2) / N.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vdvr {

class BandLimiter {
 public:
  static constexpr std::int64_t rate = 16;  ///< fine samples per pixel

  explicit BandLimiter(std::int64_t columns);

  /// double fine[rows][rate * columns] -> out[rows][columns]. Cost: rows * 8 columns^2 multiplications.
  /// Thread-safe.
  void apply(std::span<const double> fine, std::span<double> out) const;

 private:
  void apply_batch(const double* fine, std::int64_t rows, double* out, std::vector<double>& parts) const;

  std::int64_t columns_;
  std::vector<double> kernel_;  ///< D(pi q / (2 N)) / (2 N) at odd q = 2 j + 1, j = 0 .. 2 N - 1
};

}  // namespace vdvr
