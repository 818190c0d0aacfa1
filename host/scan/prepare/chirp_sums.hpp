// Trigonometric sums at evenly spaced places that need not fall on a grid (Bluestein 1970; Rabiner, Schafer
// and Rader, Bell System Technical Journal 48, 1969):
//
//   y[j] = sum over m of x[m] e^(2 pi i step m j),   m = first_in .. , j = first_out .. ,
//
// by m j = (m^2 + j^2 - (j - m)^2) / 2 one convolution, which is three FFTs of a power of two. Phases are
// reduced in long double, so that sums are right to a few roundings of double times the root mean square of
// x.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/host_fft.hpp"

namespace vdvr {

struct IndexRange {
  std::int64_t first = 0, count = 0;
};

class ChirpSums {
 public:
  using Complex = std::complex<double>;

  ChirpSums(IndexRange in, IndexRange out, long double step);

  /// Cost: two FFTs of the power of two that holds in.count + out.count - 1. Thread-safe.
  void operator()(std::span<const Complex> x, std::span<Complex> y) const;

 private:
  IndexRange in_, out_;
  fft::HostFft transform_;
  std::vector<Complex> of_in_, of_out_;  ///< e^(i pi step m^2)
  std::vector<Complex> spectrum_;        ///< of e^(-i pi step d^2), over the length
};

}  // namespace vdvr
