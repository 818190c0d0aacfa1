#include "host/base/opencl/host_fft.hpp"

#include <cmath>
#include <numbers>

namespace vdvr::fft {

using Complex = std::complex<double>;

HostFft::HostFft(std::int64_t length) : length_(length) {
  for (std::int64_t j = 0; j < length / 2; ++j) {
    const double angle = 2 * std::numbers::pi * (static_cast<double>(j) / static_cast<double>(length));
    root_.emplace_back(std::cos(angle), -std::sin(angle));
  }
}

void HostFft::forward(std::span<Complex> x) const {
  for (std::size_t size = x.size(), stride = 1; size >= 2; size /= 2, stride *= 2)
    for (std::size_t first = 0; first < x.size(); first += size) {
      Complex *low = x.data() + first, *high = low + size / 2;
      for (std::size_t j = 0; j < size / 2; ++j) {
        const Complex a = low[j], b = high[j];
        low[j] = a + b;
        high[j] = product(a - b, root_[j * stride]);
      }
    }
}

void HostFft::inverse(std::span<Complex> x) const {
  for (std::size_t size = 2, stride = x.size() / 2; size <= x.size(); size *= 2, stride /= 2)
    for (std::size_t first = 0; first < x.size(); first += size) {
      Complex *low = x.data() + first, *high = low + size / 2;
      for (std::size_t j = 0; j < size / 2; ++j) {
        const Complex a = low[j], b = product(high[j], std::conj(root_[j * stride]));
        low[j] = a + b;
        high[j] = a - b;
      }
    }
}

std::int64_t HostFft::bin_at(std::int64_t i) const {
  std::int64_t bin = 0;
  for (std::int64_t bit = 1; bit < length_; bit *= 2) bin = 2 * bin + ((i & bit) != 0 ? 1 : 0);
  return bin;
}

}  // namespace vdvr::fft
