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

// Real or imaginary parts of an element, whatever vectors the processor has.
typedef double Eight __attribute__((vector_size(imaginary * sizeof(double)), aligned(8), may_alias));
typedef float EightFloats __attribute__((vector_size(imaginary * sizeof(float)), aligned(4), may_alias));

const Eight& eight_at(const double* p) { return *reinterpret_cast<const Eight*>(p); }
Eight& eight_at(double* p) { return *reinterpret_cast<Eight*>(p); }

// Waves m and -m of the circle, of half the size each: (a + i b) e^(i phase) and (a + i b) e^(-i phase).
VDVR_WIDE void put_waves(const double* a, std::int64_t stride, std::int64_t terms, const double* phase,
                         double* x, std::int64_t length) {
  std::fill_n(x, length * element, 0.0);
  for (std::int64_t m = 0; m < terms; ++m, a += stride, phase += 2) {
    const Eight re = 0.5 * eight_at(a), im = 0.5 * eight_at(a + imaginary);
    double *up = x + m * element, *down = x + (length - m) % length * element;
    const double c = phase[0], s = phase[1];
    eight_at(up) += re * c - im * s;
    eight_at(up + imaginary) += re * s + im * c;
    eight_at(down) += re * c + im * s;
    eight_at(down + imaginary) += im * c - re * s;
  }
}

// One stage: sums of the halves' elements, and their differences turned.
VDVR_WIDE void halve(double* x, std::int64_t size, const double* root, std::int64_t root_stride) {
  double *low = x, *high = x + size / 2 * element;
  for (std::int64_t j = 0; j < size / 2; ++j, low += element, high += element) {
    const Eight a_re = eight_at(low), a_im = eight_at(low + imaginary), b_re = eight_at(high),
                b_im = eight_at(high + imaginary), re = a_re - b_re, im = a_im - b_im;
    const double c = root[2 * j * root_stride], s = root[2 * j * root_stride + 1];
    eight_at(low) = a_re + b_re;
    eight_at(low + imaginary) = a_im + b_im;
    eight_at(high) = re * c - im * s;
    eight_at(high + imaginary) = re * s + im * c;
  }
}

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

VDVR_WIDE double largest_magnitude(const double* x, std::int64_t elements) {
  Eight high{};
  for (const double* p = x; p < x + elements * element; p += imaginary) {
    const Eight v = eight_at(p), magnitude = v < 0 ? -v : v;
    high = magnitude > high ? magnitude : high;
  }
  double sup = 0;
  for (std::int64_t i = 0; i < imaginary; ++i) sup = std::max(sup, high[i]);
  return sup;
}

// The transform's place `index` is the `shifts` index + `shift` th of the circle, a quarter of a step
// further.
VDVR_WIDE void put_floats(const double* x, std::int64_t length, std::int64_t shift, std::int64_t shifts,
                          const std::int32_t* index, double scale, float* out, std::int64_t out_stride) {
  for (std::int64_t i = 0; i < length; ++i, x += element) {
    const std::int64_t around = index[i] * shifts + shift, all = length * shifts,
                       n = 2 * around < all ? 2 * around : 2 * (all - around) - 1;
    float* to = out + n * out_stride;
    *reinterpret_cast<EightFloats*>(to) = __builtin_convertvector(eight_at(x) * scale, EightFloats);
    *reinterpret_cast<EightFloats*>(to + imaginary) =
        __builtin_convertvector(eight_at(x + imaginary) * scale, EightFloats);
  }
}

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
    sup = std::max(sup, largest_magnitude(work.data(), length_));
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
