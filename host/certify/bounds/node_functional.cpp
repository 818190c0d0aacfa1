#include "host/certify/bounds/node_functional.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "host/base/opencl/host_fft.hpp"
#include "host/base/system/wide.hpp"

namespace vdvr {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t smoothness = 6;          // derivatives of e that the Fourier series' tail asks for
constexpr std::size_t highest = 12;            // derivatives of e that are looked at between frequencies
constexpr std::int64_t series_samples = 1024;  // of a period of the Fourier series
using UpToHighest = std::array<double, highest + 1>;

double factorial_ratio(int n, int m) {  // n! / (n - m)!, 0 for m > n
  double product = 1;
  for (int i = 0; i < m; ++i) product *= n - i;
  return product;
}

// sum |taps| |place|^m + |(kappa^order)^(m)|: at least the m-th derivative of e at |kappa| and below.
double magnitude(const NodeFunctional& f, std::size_t m, double kappa) {
  double sum = 0;
  for (std::size_t i = 0; i < f.taps.size(); ++i) {
    double term = std::abs(f.taps[i]);
    const double place = std::abs(f.first + static_cast<double>(i));
    for (std::size_t n = 0; n < m; ++n) term *= place;
    sum += term;
  }
  sum *= 1 + 0x1p-44;  // fewer than a hundred roundings
  const int order = f.order, left = order - static_cast<int>(m);
  return sum + (left < 0 ? 0 : factorial_ratio(order, static_cast<int>(m)) * std::pow(std::abs(kappa), left));
}

// Of a sum of `f`'s terms in double precision: powers of exp(i kappa) by products, places by products, of
// which there are `highest` and most_moments, and the sum.
double rounding(const NodeFunctional& f, double magnitude) {
  return 8 * static_cast<double>(f.taps.size() + highest + 4) * 0x1p-53 * magnitude;
}

// Adds terms[i][m] times the wave at place i, which turns on from place to place.
VDVR_WIDE void add_terms(const double* terms, std::size_t places, std::size_t count, Complex wave,
                         Complex turn, double* real, double* imag) {
  double re = wave.real(), im = wave.imag();
  for (std::size_t i = 0; i < places; ++i, terms += count) {
    for (std::size_t m = 0; m < count; ++m) {
      real[m] += terms[m] * re;
      imag[m] += terms[m] * im;
    }
    const double next = re * turn.real() - im * turn.imag();
    im = re * turn.imag() + im * turn.real();
    re = next;
  }
}

// e and its derivatives up to the `count`-th, exclusive, at one frequency after another.
class Symbol {
 public:
  Symbol(const NodeFunctional& f, std::size_t count)
      : f_(f), count_(count), terms_(f.taps.size() * count), real_(count), imag_(count) {
    for (std::size_t i = 0; i < f.taps.size(); ++i) {
      double term = f.taps[i];
      const double place = f.first + static_cast<double>(i);
      for (std::size_t m = 0; m < count; ++m, term *= place) terms_[i * count + m] = term;
    }
  }

  // i^m of the derivatives does not matter for magnitudes, but for what is taken off: i^order kappa^order.
  void at(double kappa, std::vector<Complex>& derivative) {
    std::ranges::fill(real_, 0.0);
    std::ranges::fill(imag_, 0.0);
    add_terms(terms_.data(), f_.taps.size(), count_, std::polar(1.0, kappa * f_.first),
              std::polar(1.0, kappa), real_.data(), imag_.data());
    for (std::size_t m = 0; m < count_; ++m) derivative[m] = {real_[m], imag_[m]};
    for (std::size_t m = 0; m < count_ && static_cast<int>(m) <= f_.order; ++m) {
      const int left = f_.order - static_cast<int>(m);
      double power = factorial_ratio(f_.order, static_cast<int>(m));
      for (int i = 0; i < left; ++i) power *= kappa;
      constexpr std::array<Complex, 4> powers_of_i{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
      derivative[m] -= power * powers_of_i[static_cast<std::size_t>(left % 4)];
    }
  }

 private:
  const NodeFunctional& f_;
  std::size_t count_;
  std::vector<double> terms_, real_, imag_;  // [tap][derivative], and what they add up to
};

// At least |e^(n + m)| on [from, to] for every moment n < moments and m <= highest: a function lies at most
// step^2 / 8 times its second derivative above the largest of its values `step` apart. The highest two are
// bounded by `magnitude`.
std::vector<UpToHighest> largest_derivatives(const NodeFunctional& f, double from, double to, int steps,
                                             std::size_t moments) {
  const std::size_t known = highest - 1;  // of each moment
  std::vector<Complex> at(moments + known - 1);
  std::vector<double> squares(at.size(), 0.0), all;
  Symbol symbol(f, at.size());
  for (int s = 0; s <= steps; ++s) {
    symbol.at(from + (to - from) * s / steps, at);
    for (std::size_t m = 0; m < at.size(); ++m) squares[m] = std::max(squares[m], std::norm(at[m]));
  }
  for (std::size_t m = 0; m < moments + highest; ++m) all.push_back(magnitude(f, m, to));
  const double step = (to - from) / steps;
  std::vector<UpToHighest> out(moments);
  for (std::size_t n = 0; n < moments; ++n)
    for (std::size_t m = highest + 1; m-- > 0;)
      out[n][m] = m >= known
                      ? all[n + m]
                      : std::sqrt(squares[n + m]) + rounding(f, all[n + m]) + step * step / 8 * out[n][m + 2];
  return out;
}

// The cut falls from 1 to 0 as 1 - t^6 (1 + 6 (1 - t) + .. + 252 (1 - t)^5), whose derivative is -2772 (t (1
// - t))^5: five derivatives are continuous.
double cut(double t) {
  if (t <= 0) return 1;
  if (t >= 1) return 0;
  constexpr std::array binomial{252.0, 126.0, 56.0, 21.0, 6.0, 1.0};
  double sum = 0;
  for (const double b : binomial) sum = sum * (1 - t) + b;
  const double third = t * t * t;
  return 1 - third * third * sum;
}

// At least its m-th derivatives, m <= 6: with x = 2 t - 1, 2772 / 1024 (1 - x^2)^5 differentiated m - 1
// times. The fifth derivative of that is 3840 times Legendre's polynomial: at most 3840. The others vanish at
// both ends, and on a grid of x as above.
std::array<double, smoothness + 1> cut_derivatives() {
  std::array<double, 13> p{1, 0, -5, 0, 10, 0, -10, 0, 5, 0, -1};  // of (1 - x^2)^5, then of its derivatives
  constexpr int steps = 512;
  std::array<double, smoothness + 1> largest{1};
  double scale = 2772.0 / 1024;
  for (std::size_t m = 1; m < smoothness; ++m, scale *= 2) {
    double second = 0;  // of the polynomial's second derivative, |x| <= 1
    for (std::size_t i = 2; i < p.size(); ++i) second += std::abs(p[i]) * static_cast<double>(i * (i - 1));
    for (int s = 0; s <= steps; ++s) {
      const double x = 2.0 * s / steps - 1;
      double value = 0;
      for (std::size_t i = p.size(); i-- > 0;) value = value * x + p[i];
      largest[m] = std::max(largest[m], std::abs(value));
    }
    largest[m] = scale * (largest[m] + second * 4.0 / steps / steps / 8);
    for (std::size_t i = 0; i + 1 < p.size(); ++i) p[i] = static_cast<double>(i + 1) * p[i + 1];
  }
  largest[smoothness] = scale * 3840;
  return largest;
}

// A bound of sum over |j| >= samples / 2 of |a_j|, a_j the Fourier coefficients of e cut(kappa) of period 2
// `end`: |a_j| <= (end / (pi |j|))^6 mean |(e cut)^(6)|.
double tail(const UpToHighest& inside, const UpToHighest& falling, double band, double end) {
  static const auto of_cut = cut_derivatives();
  constexpr std::array binomial{1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0};
  double sixth = 0;
  for (std::size_t m = 0; m <= smoothness; ++m)
    sixth += binomial[m] * falling[m] * of_cut[smoothness - m] /
             std::pow(end - band, static_cast<double>(smoothness - m));
  const double mean = (band * inside[smoothness] + (end - band) * sixth) / end;
  return 2 * std::pow(end / std::numbers::pi, 6) * mean / (5 * std::pow(series_samples / 2.0 - 1, 5));
}

// sum |a_j| of every moment: of the coefficients by FFT, what is beyond them, and what is beyond them folded
// onto them. The a_j are real, since e(-kappa) = e(kappa)*: of two moments they are the real and the
// imaginary part of one FFT, each moment divided by the power of two below its magnitude.
std::vector<double> coefficient_sums(const NodeFunctional& f, const std::vector<UpToHighest>& inside,
                                     double band, double end) {
  static const fft::HostFft transform(series_samples);
  constexpr std::size_t half = series_samples / 2;
  const std::size_t moments = inside.size();
  std::vector<double> magnitudes, scale;
  for (std::size_t n = 0; n < moments; ++n) {
    magnitudes.push_back(magnitude(f, n, end));
    scale.push_back(magnitudes[n] > 0 ? std::exp2(-std::ilogb(magnitudes[n])) : 1);
  }
  std::vector<std::vector<Complex>> pairs((moments + 1) / 2, std::vector<Complex>(series_samples));
  std::vector<Complex> at(moments);
  Symbol symbol(f, moments);
  for (std::size_t s = 0; s <= half; ++s) {
    const double kappa = end * static_cast<double>(s) / static_cast<double>(half);
    const double factor = cut((kappa - band) / (end - band));
    if (!(factor > 0)) continue;  // the last is half: it is 0
    symbol.at(kappa, at);
    for (std::size_t n = 0; n < moments; ++n) at[n] *= factor * scale[n];
    for (std::size_t n = 0; n < moments; n += 2) {
      const Complex a = at[n], b = n + 1 < moments ? at[n + 1] : Complex{};
      pairs[n / 2][s] = {a.real() - b.imag(), a.imag() + b.real()};                              // a + i b
      if (s > 0) pairs[n / 2][series_samples - s] = {a.real() + b.imag(), b.real() - a.imag()};  // a* + i b*
    }
  }
  const std::vector<UpToHighest> falling = largest_derivatives(f, band, end, 64, moments);
  std::vector<double> out;
  for (std::vector<Complex>& pair : pairs) {
    transform.forward(pair);
    std::array<double, 2> sums{};
    for (const Complex& a : pair) {
      sums[0] += std::abs(a.real());
      sums[1] += std::abs(a.imag());
    }
    for (std::size_t i = 0; i < 2 && out.size() < moments; ++i) {
      const std::size_t n = out.size();
      // Errors of the samples and of the FFT, in the 2-norm: sum |a_j| <= sqrt(samples) times the norm of all
      // a_j. The other moment of the pair is at most twice as large.
      const double noise = std::sqrt(double{series_samples}) * 8 * rounding(f, magnitudes[n]);
      out.push_back(sums[i] / (scale[n] * series_samples) + 2 * tail(inside[n], falling[n], band, end) +
                    noise);
    }
  }
  return out;
}

}  // namespace

double symbol_error(const NodeFunctional& functional, double kappa) {
  std::vector<Complex> e(1);
  Symbol(functional, 1).at(kappa, e);
  return std::abs(e[0]) + rounding(functional, magnitude(functional, 0, kappa));
}

double largest_symbol_error(const NodeFunctional& functional, double band) {
  return largest_derivatives(functional, 0, band, 512, 1)[0][0];
}

// A narrow fall is the better where e grows beyond the band, a wide one where it does not.
std::vector<double> moment_sup_constants(const NodeFunctional& functional, double band, std::size_t count) {
  const std::vector<UpToHighest> inside = largest_derivatives(functional, 0, band, 128, count);
  std::vector<double> least(count, HUGE_VAL);
  for (const double ratio : {1.015, 1.2}) {
    const std::vector<double> found = coefficient_sums(functional, inside, band, band * ratio);
    for (std::size_t n = 0; n < count; ++n) least[n] = std::min(least[n], found[n]);
  }
  return least;
}

double sup_constant(const NodeFunctional& functional, double band) {
  return moment_sup_constants(functional, band, 1)[0];
}

}  // namespace vdvr
