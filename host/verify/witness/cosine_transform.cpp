// Two series ride in one complex transform, as its real and its imaginary part. A cosine series is even, so
// that a transform whose places lie a quarter of a step beside the origin tells it at their mirror images
// too: twice as many places, all half a step apart. Denser places are several transforms, each with a shift
// of its own: they are as long as the series, whatever the density.
#include "host/verify/witness/cosine_transform.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/wide.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t element = CosineTransform::together, imaginary = element / 2;
// Elements that stay in the first cache.
constexpr std::int64_t cached_elements = 128;

// Waves m and -m of the circle, of half the size each: (a + i b) e^(i phase) and (a + i b) e^(-i phase).
template <std::int64_t N>
VDVR_ALWAYS_INLINE void put_waves_in(const double* a, std::int64_t stride, std::int64_t terms,
                                     const double* phase, double* x, std::int64_t length) {
  using Parts = wide::Doubles<N>;
  std::fill_n(x, length * element, 0.0);
  for (std::int64_t m = 0; m < terms; ++m, a += stride, phase += 2) {
    double *up = x + m * element, *down = x + (length - m) % length * element;
    const double c = phase[0], s = phase[1];
    for (std::int64_t i = 0; i < imaginary; i += N) {
      const typename Parts::Vector re = 0.5 * Parts::at(a + i), im = 0.5 * Parts::at(a + imaginary + i);
      Parts::at(up + i) += re * c - im * s;
      Parts::at(up + imaginary + i) += re * s + im * c;
      Parts::at(down + i) += re * c + im * s;
      Parts::at(down + imaginary + i) += im * c - re * s;
    }
  }
}
VDVR_IN_WIDTHS(put_waves,
               (const double* a, std::int64_t stride, std::int64_t terms, const double* phase, double* x,
                std::int64_t length),
               (a, stride, terms, phase, x, length))

// One stage: sums of the halves' elements, and their differences turned.
template <std::int64_t N>
VDVR_ALWAYS_INLINE void halve_in(double* x, std::int64_t size, const double* root, std::int64_t root_stride) {
  using Parts = wide::Doubles<N>;
  double *low = x, *high = x + size / 2 * element;
  for (std::int64_t j = 0; j < size / 2; ++j, low += element, high += element) {
    const double c = root[2 * j * root_stride], s = root[2 * j * root_stride + 1];
    for (std::int64_t i = 0; i < imaginary; i += N) {
      double *low_re = low + i, *low_im = low_re + imaginary, *high_re = high + i,
             *high_im = high_re + imaginary;
      const typename Parts::Vector a_re = Parts::at(low_re), a_im = Parts::at(low_im),
                                   b_re = Parts::at(high_re), b_im = Parts::at(high_im), re = a_re - b_re,
                                   im = a_im - b_im;
      Parts::at(low_re) = a_re + b_re;
      Parts::at(low_im) = a_im + b_im;
      Parts::at(high_re) = re * c - im * s;
      Parts::at(high_im) = re * s + im * c;
    }
  }
}
VDVR_IN_WIDTHS(halve, (double* x, std::int64_t size, const double* root, std::int64_t root_stride),
               (x, size, root, root_stride))

// In place; frequencies come out with their bits reversed. Halves, until a part fits into the cache.
void transform_part(double* x, std::int64_t size, const double* root, std::int64_t root_stride) {
  if (size > cached_elements) {
    halve(x, size, root, root_stride);
    transform_part(x, size / 2, root, 2 * root_stride);
    transform_part(x + size / 2 * element, size / 2, root, 2 * root_stride);
    return;
  }
  for (std::int64_t part = size; part > 1; part /= 2)
    for (std::int64_t first = 0; first < size; first += part)
      halve(x + first * element, part, root, root_stride * (size / part));
}

template <std::int64_t N>
VDVR_ALWAYS_INLINE void raise_to_magnitudes_in(const double* x, std::int64_t elements, double* sup) {
  using Parts = wide::Doubles<N>;
  typename Parts::Vector high{};
  for (const double* p = x; p < x + elements * element; p += N) {
    const typename Parts::Vector v = Parts::at(p), magnitude = v < 0 ? -v : v;
    high = magnitude > high ? magnitude : high;
  }
  for (std::int64_t i = 0; i < N; ++i) *sup = std::max(*sup, high[i]);
}
VDVR_IN_WIDTHS(raise_to_magnitudes, (const double* x, std::int64_t elements, double* sup), (x, elements, sup))

// The transform's place `index` is the `shifts` index + `shift` th of the circle, a quarter of a step
// further.
template <std::int64_t N>
VDVR_ALWAYS_INLINE void put_floats_in(const double* x, std::int64_t length, std::int64_t shift,
                                      std::int64_t shifts, const std::int32_t* index, double scale,
                                      float* out, std::int64_t out_stride) {
  using Parts = wide::Doubles<N>;
  for (std::int64_t i = 0; i < length; ++i, x += element) {
    const std::int64_t around = index[i] * shifts + shift, all = length * shifts,
                       n = 2 * around < all ? 2 * around : 2 * (all - around) - 1;
    for (std::int64_t part = 0; part < element; part += N)
      Parts::at(out + n * out_stride + part) =
          __builtin_convertvector(Parts::at(x + part) * scale, typename Parts::Floats);
  }
}
VDVR_IN_WIDTHS(put_floats,
               (const double* x, std::int64_t length, std::int64_t shift, std::int64_t shifts,
                const std::int32_t* index, double scale, float* out, std::int64_t out_stride),
               (x, length, shift, shifts, index, scale, out, out_stride))

}  // namespace

CosineTransform::CosineTransform(std::int64_t terms, std::int64_t density)
    : terms_(terms),
      length_(static_cast<std::int64_t>(std::bit_ceil(count(terms)))),
      shifts_((density * terms + length_ - 1) / length_) {
  // Rounded once: the argument and the functions are of a longer type.
  const auto put = [](std::vector<double>& to, std::int64_t n, std::int64_t of) {
    const long double angle =
        2 * std::numbers::pi_v<long double> * static_cast<long double>(n) / static_cast<long double>(of);
    to.push_back(static_cast<double>(std::cos(angle)));
    to.push_back(static_cast<double>(std::sin(angle)));
  };
  for (std::int64_t j = 0; j < length_ / 2; ++j) put(root_, j, length_);
  for (std::int64_t s = 0; s < shifts_; ++s)
    for (std::int64_t m = 0; m < terms_; ++m) put(phase_, m * (4 * s + 1), 4 * places());
  index_.resize(at(length_));
  for (std::int64_t i = 1; i < length_; ++i)
    index_[at(i)] = index_[at(i / 2)] / 2 + ((i & 1) != 0 ? to_int(length_ / 2) : 0);
}

double CosineTransform::rise() const {
  return 1 / std::cos(std::numbers::pi * static_cast<double>(terms_) / static_cast<double>(2 * places()));
}

void CosineTransform::transform(const double* a, std::int64_t stride, std::int64_t shift,
                                std::vector<double>& work) const {
  work.resize(at(length_ * element));
  put_waves(a, stride, terms_, phase_.data() + 2 * shift * terms_, work.data(), length_);
  transform_part(work.data(), length_, root_.data(), 1);
}

double CosineTransform::largest(const double* a, std::int64_t stride, std::vector<double>& work) const {
  double sup = 0;
  for (std::int64_t shift = 0; shift < shifts_; ++shift) {
    transform(a, stride, shift, work);
    raise_to_magnitudes(work.data(), length_, &sup);
  }
  return sup;
}

void CosineTransform::values(const double* a, std::int64_t stride, double unit, float* out,
                             std::int64_t out_stride, std::vector<double>& work) const {
  for (std::int64_t shift = 0; shift < shifts_; ++shift) {
    transform(a, stride, shift, work);
    put_floats(work.data(), length_, shift, shifts_, index_.data(), 1 / unit, out, out_stride);
  }
}

}  // namespace vdvr
