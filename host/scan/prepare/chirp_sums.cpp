// Bluestein's convolution. Equations in the header.
#include "host/scan/prepare/chirp_sums.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using Complex = ChirpSums::Complex;
using fft::product;

std::int64_t length_for(IndexRange in, IndexRange out) {
  return static_cast<std::int64_t>(std::bit_ceil(count(in.count + out.count - 1)));
}

// e^(i pi step k^2)
Complex chirp(long double step, std::int64_t k) {
  const auto squared = static_cast<long double>(k) * static_cast<long double>(k);
  const long double angle = std::numbers::pi_v<long double> * std::fmod(step * squared, 2.0L);
  return {static_cast<double>(std::cos(angle)), static_cast<double>(std::sin(angle))};
}

std::vector<Complex> chirps(long double step, IndexRange over) {
  std::vector<Complex> all;
  for (std::int64_t k = over.first; k < over.first + over.count; ++k) all.push_back(chirp(step, k));
  return all;
}

}  // namespace

ChirpSums::ChirpSums(IndexRange in, IndexRange out, long double step)
    : in_(in),
      out_(out),
      transform_(length_for(in, out)),
      of_in_(chirps(step, in)),
      of_out_(chirps(step, out)),
      spectrum_(at(length_for(in, out))) {
  // Element (out - in) of the cyclic convolution, from the first of either.
  const std::int64_t length = length_for(in, out);
  for (std::int64_t e = 1 - in.count; e < out.count; ++e)
    spectrum_[at((e + length) % length)] =
        std::conj(chirp(step, out.first - in.first + e)) / static_cast<double>(length);
  transform_.forward(spectrum_);
}

void ChirpSums::operator()(std::span<const Complex> x, std::span<Complex> y) const {
  std::vector<Complex> work(spectrum_.size());
  for (std::int64_t m = 0; m < in_.count; ++m) work[at(m)] = product(x[at(m)], of_in_[at(m)]);
  transform_.forward(work);
  for (std::size_t i = 0; i < work.size(); ++i) work[i] = product(work[i], spectrum_[i]);
  transform_.inverse(work);
  for (std::int64_t j = 0; j < out_.count; ++j) y[at(j)] = product(work[at(j)], of_out_[at(j)]);
}

}  // namespace vdvr
