// The ideal low-pass of `simulate --band-limited`: rows sampled 16 times per pixel become rows of pixels that
// hold nothing above the detector's Nyquist frequency.
//
// Fine sample n = 16 i + f of pixel i lies at i - 1/2 + (f + 1/2)/16, n = 0 .. N-1, N = 16 U: symmetric
// within each pixel, covering the detector from edge to edge. With the half-sample mirror extension about
// both edges (the one F is defined by, so that nothing wraps around) a row is the cosine series  sum_m c_m
// cos(pi m (n + 1/2) / N); its terms m < U lie below Nyquist (U is Nyquist itself, and is 0 at every pixel
// centre). Keeping those and evaluating at the centres is
//   out[i] = sum_n w[i][n] in[n],  w[i][n] = (D(b_i - b_n) + D(b_i + b_n)) / (2 N),
//   D(x) = 1 + 2 sum_{m=1}^{U-1} cos(m x) = sin((U - 1/2) x) / sin(x / 2),  b_i = pi (i + 1/2) / U, b_n = pi
//   (n + 1/2) / N.
// Mirrored beyond the last pixel, samples f of all pixels are a sequence of period 2 U, on which D acts as a
// convolution; samples 15 - f are the same sequence backwards. So eight transforms and one back do two rows.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/host_fft.hpp"

namespace vdvr {

class BandLimiter {
 public:
  static constexpr std::int64_t rate = 16;  ///< fine samples per pixel

  explicit BandLimiter(std::int64_t columns);

  /// double fine[rows][rate * columns] -> out[rows][columns]. Cost: nine transforms of two to six times the
  /// columns for every two rows. Thread-safe.
  void apply(std::span<const double> fine, std::span<double> out) const;

 private:
  using Complex = std::complex<double>;

  [[nodiscard]] std::vector<Complex> spectrum_of(std::int64_t phase) const;
  void apply_pair(const double* fine, bool two, double* out, std::vector<Complex>& phase,
                  std::vector<Complex>& sum) const;

  std::int64_t columns_;
  fft::HostFft transform_;
  std::vector<std::size_t> negated_;  ///< where the spectrum's order has the frequency -k of element i
  std::vector<Complex> forwards_,
      backwards_;  ///< [f < 8][element]: what samples f and 15 - f are multiplied by
};

}  // namespace vdvr
