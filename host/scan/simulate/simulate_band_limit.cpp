// The ideal low-pass by transforms. Equations in the header.
#include "host/scan/simulate/simulate_band_limit.hpp"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using fft::product;
using std::numbers::pi;
using Complex = std::complex<double>;

// Two phases, f and 15 - f, share a transform.
constexpr std::int64_t pairs = BandLimiter::rate / 2;

// The period itself where it is a power of two; else whatever holds every distance of a pixel from a sample.
std::int64_t transform_length(std::int64_t columns) {
  const std::uint64_t period = count(2 * columns);
  return static_cast<std::int64_t>(std::has_single_bit(period) ? period
                                                               : std::bit_ceil(count(3 * columns - 1)));
}

// D(pi q / (2 N)) / (2 N) at odd q.
double dirichlet(std::int64_t q, std::int64_t columns) {
  const std::int64_t n = BandLimiter::rate * columns;
  // Even, and of period 4 N. The numerator's argument pi q (2U - 1) / (4N) is reduced in integers: its sine
  // is right for wide detectors too.
  q = std::abs(q) % (4 * n);
  const std::int64_t turn = q * (2 * columns - 1) % (8 * n);
  const double unit = pi / static_cast<double>(4 * n);
  return std::sin(unit * static_cast<double>(turn)) /
         (std::sin(unit * static_cast<double>(q)) * static_cast<double>(2 * n));
}

}  // namespace

BandLimiter::BandLimiter(std::int64_t columns) : columns_(columns), transform_(transform_length(columns)) {
  const std::int64_t length = transform_length(columns);
  std::vector<std::size_t> element(at(length));  // by frequency
  for (std::int64_t i = 0; i < length; ++i) element[at(transform_.bin_at(i))] = at(i);
  for (std::int64_t i = 0; i < length; ++i)
    negated_.push_back(element[at((length - transform_.bin_at(i)) % length)]);
  for (std::int64_t f = 0; f < pairs; ++f) {
    const std::vector<Complex> own = spectrum_of(f), mirrored = spectrum_of(rate - 1 - f);
    forwards_.insert(forwards_.end(), own.begin(), own.end());
    for (std::int64_t i = 0; i < length; ++i) {
      // A sequence backwards has the frequencies negated, and begins 2 U - 1 later.
      const std::int64_t turn = transform_.bin_at(i) * (2 * columns - 1) % length;
      backwards_.push_back(product(mirrored[at(i)], std::polar(1.0, -2 * pi * static_cast<double>(turn) /
                                                                        static_cast<double>(length))));
    }
  }
}

// Of D at the distances of pixels from the samples `phase` of all pixels, and of the inverse's 1 / length.
std::vector<Complex> BandLimiter::spectrum_of(std::int64_t phase) const {
  const std::int64_t length = transform_length(columns_),
                     lowest = length == 2 * columns_ ? -columns_ : 1 - 2 * columns_;
  std::vector<Complex> kernel(at(length));
  for (std::int64_t lag = lowest; lag < columns_; ++lag)
    kernel[at((lag + length) % length)] =
        dirichlet(rate * (2 * lag + 1) - 2 * phase - 1, columns_) / static_cast<double>(length);
  transform_.forward(kernel);
  return kernel;
}

void BandLimiter::apply(std::span<const double> fine, std::span<double> out) const {
  const std::int64_t rows = static_cast<std::int64_t>(out.size()) / columns_;
  std::vector<Complex> phase(negated_.size()), sum(negated_.size());
  for (std::int64_t row = 0; row < rows; row += 2)
    apply_pair(fine.data() + row * rate * columns_, row + 1 < rows, out.data() + row * columns_, phase, sum);
}

// One row as the real part, the next as the imaginary one: weights are real.
void BandLimiter::apply_pair(const double* fine, bool two, double* out, std::vector<Complex>& phase,
                             std::vector<Complex>& sum) const {
  const double* second = fine + (two ? rate * columns_ : 0);
  const std::size_t length = phase.size();
  std::fill(sum.begin(), sum.end(), Complex{});
  for (std::int64_t f = 0; f < pairs; ++f) {
    for (std::int64_t i = 0; i < columns_; ++i) {
      const std::int64_t own = rate * i + f, mirror = rate * i + rate - 1 - f;
      phase[at(i)] = {fine[own], second[own]};
      phase[at(2 * columns_ - 1 - i)] = {fine[mirror], second[mirror]};
    }
    std::fill(phase.begin() + 2 * columns_, phase.end(), Complex{});
    transform_.forward(phase);
    const Complex *ahead = forwards_.data() + at(f) * length, *back = backwards_.data() + at(f) * length;
    for (std::size_t i = 0; i < length; ++i)
      sum[i] += product(ahead[i], phase[i]) + product(back[i], phase[negated_[i]]);
  }
  transform_.inverse(sum);
  for (std::int64_t i = 0; i < columns_; ++i) {
    out[i] = sum[at(i)].real();
    if (two) out[columns_ + i] = sum[at(i)].imag();
  }
}

}  // namespace vdvr
