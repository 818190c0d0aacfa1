#include "host/certify/bounds/six_taps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "host/certify/bounds/node_functional.hpp"
#include "shared/six_taps.h"

namespace vdvr {
namespace {

constexpr std::size_t taps = 6;
constexpr int steps = 32;  // of f in [0, 1 / 2]: the weights at 1 - f are those at f, mirrored
constexpr double apart = 0.5 / steps;
constexpr double bend = apart * apart / 8;  // times a second derivative: what a function rises between steps
constexpr std::array<std::array<double, 3>, 3> even{
    {{VDVR_SIX_EVEN_A}, {VDVR_SIX_EVEN_B}, {VDVR_SIX_EVEN_C}}};
constexpr std::array<std::array<double, 3>, 3> odd{{{VDVR_SIX_ODD_A}, {VDVR_SIX_ODD_B}, {VDVR_SIX_ODD_C}}};
using TapWeights = std::array<double, taps>;

// Coefficient of g^i in the weight of a tap, taps counted from 0.
double coefficient(std::size_t tap, std::size_t i) {
  const std::size_t n = std::min(tap, taps - 1 - tap);
  const double c = i % 2 == 0 ? even[n][i / 2] : odd[n][i / 2];
  return i % 2 == 1 && tap >= taps / 2 ? -c : c;
}

// d! / d (d - 1) .. : the factor of g^(i - order) in the order-th derivative of g^i.
double fallen(std::size_t i, std::size_t order) {
  double product = 1;
  for (std::size_t k = 0; k < order; ++k) product *= static_cast<double>(i) - static_cast<double>(k);
  return product;
}

// The order-th derivatives of the weights at f.
TapWeights derivatives(double f, std::size_t order) {
  TapWeights w{};
  for (std::size_t tap = 0; tap < taps; ++tap)
    for (std::size_t i = order; i < taps; ++i)
      w[tap] += coefficient(tap, i) * fallen(i, order) * std::pow(f - 0.5, static_cast<double>(i - order));
  return w;
}

// At least the magnitude of the order-th derivative of a sum of weights, over f in [0, 1].
double largest_derivative(std::size_t first, std::size_t last, std::size_t order) {
  double sum = 0;
  for (std::size_t i = order; i < taps; ++i) {
    double c = 0;
    for (std::size_t tap = first; tap <= last; ++tap) c += coefficient(tap, i);
    sum += std::abs(c) * fallen(i, order) * std::pow(0.5, static_cast<double>(i - order));
  }
  return sum;
}

// What the order-th derivative of the interpolant by f errs against that of the field: at f.
NodeFunctional functional(double f, std::size_t order) {
  const TapWeights w = derivatives(f, order);
  return {{w.begin(), w.end()}, -2 - f, static_cast<int>(order)};
}

// At least |error| over all f, of an error that `of` bounds for one f: what it lacks between steps is its
// second derivative's, which is the error of the second derivative; and so on. The sixth derivative of the
// weights is 0, and that of a wave at most w^6.
template <typename Of>
double over_all_places(double w, const Of& of) {
  double largest = std::pow(w, 6);
  for (const std::size_t order : {4U, 2U, 0U}) {
    double at_steps = 0;
    for (int s = 0; s <= steps; ++s) at_steps = std::max(at_steps, of(functional(apart * s, order)));
    largest = at_steps + bend * largest;
  }
  return largest;
}

// Sums over the taps, and over differences of columns (summation by parts), for all f in [0, 1].
void bound_sums(SixTaps& six) {
  std::array<double, taps> bend_of_part{};
  double bend_of_weights = 0;
  for (std::size_t tap = 0; tap < taps; ++tap) {
    bend_of_weights += bend * largest_derivative(tap, tap, 2);
    bend_of_part[tap] = bend * largest_derivative(0, tap, 3);
  }
  for (int s = 0; s <= 2 * steps; ++s) {
    double norm = bend_of_weights, slope = 0, part = 0;
    for (const double w : derivatives(apart * s, 0)) norm += std::abs(w);
    const TapWeights slopes = derivatives(apart * s, 1);
    for (std::size_t tap = 0; tap + 1 < taps; ++tap) {
      part += slopes[tap];
      slope += std::abs(part) + bend_of_part[tap];
    }
    six.norm = std::max(six.norm, norm);
    six.slope = std::max(six.slope, slope);
    six.slope_sum = std::max(six.slope_sum, std::abs(part + slopes[taps - 1]) + bend_of_part[taps - 1]);
  }
}

// a + s (b + s c), |s| <= 1/4 with an error of one rounding, in units of u: the magnitudes that each rounding
// is of. A compiler that fuses takes fewer.
double horner_rounding(double a, double b, double c) {
  constexpr double s = 0.25;
  const double inner = std::abs(b) + s * std::abs(c), inner_error = 2 * s * std::abs(c) + inner;
  return 2 * s * inner + s * inner_error + std::abs(a) + s * inner;
}

// Two taps mirror each other: even(g^2) +- g odd(g^2), |g| <= 1/2 with an error of at most 2^-26.
double weights_rounding() {
  double roundings = 0, by_place = 0;
  for (std::size_t tap = 0; tap < taps; ++tap) {
    const auto c = [&](std::size_t i) { return coefficient(tap, i); };
    const double whole = std::abs(c(0)) + std::abs(c(2)) / 4 + std::abs(c(4)) / 16,
                 slanted = 0.5 * (std::abs(c(1)) + std::abs(c(3)) / 4 + std::abs(c(5)) / 16);
    roundings += horner_rounding(c(0), c(2), c(4)) + 0.5 * horner_rounding(c(1), c(3), c(5)) + slanted +
                 (whole + slanted);
    by_place += largest_derivative(tap, tap, 1);
  }
  return 1.0001 * 0x1p-24 * roundings + 0x1p-26 * by_place;
}

SixTaps compute_facts() {
  SixTaps six;
  six.band = std::numbers::pi / 8;
  six.error =
      over_all_places(six.band, [&](const NodeFunctional& at) { return largest_symbol_error(at, six.band); });
  six.sup = over_all_places(six.band, [&](const NodeFunctional& at) { return sup_constant(at, six.band); });
  six.rounding = weights_rounding();
  bound_sums(six);
  return six;
}

}  // namespace

std::array<double, 6> six_taps(double f) { return derivatives(f, 0); }

double SixTaps::error_at(double w) const {
  return over_all_places(w, [&](const NodeFunctional& at) { return symbol_error(at, w); });
}

const SixTaps& six_tap_facts() {
  static const SixTaps facts = compute_facts();
  return facts;
}

}  // namespace vdvr
