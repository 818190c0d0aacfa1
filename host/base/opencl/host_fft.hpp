// A radix-2 FFT in double precision on the host, for devices without double precision: only what a
// convolution needs, so that no element is ever moved to its place.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

namespace vdvr::fft {

/// std::complex's own product looks for NaN.
inline std::complex<double> product(std::complex<double> a, std::complex<double> b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

class HostFft {
 public:
  /// `length`: a power of two.
  explicit HostFft(std::int64_t length);
  /// The spectrum of x, in place: frequency `bin_at(i)` at element i. Cost: length log2(length).
  void forward(std::span<std::complex<double>> x) const;
  /// `length` times the inverse, from that order.
  void inverse(std::span<std::complex<double>> x) const;
  [[nodiscard]] std::int64_t bin_at(std::int64_t i) const;

 private:
  std::int64_t length_;
  std::vector<std::complex<double>> root_;  // e^(-2 pi i j / length), j < length / 2
};

}  // namespace vdvr::fft
