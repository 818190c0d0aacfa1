#include "host/certify/bounds/column_taps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "host/certify/bounds/node_functional.hpp"
#include "shared/column_taps.h"

namespace vdvr {
namespace {

constexpr int steps_of_half = 32;  // of f in [0, 1 / 2]: the weights at 1 - f are those at f, mirrored
constexpr double apart = 0.5 / steps_of_half;
constexpr double bend = apart * apart / 8;  // times a second derivative: what a function rises between steps
constexpr std::size_t powers = 6;           // of g in a weight

// Of a tap and the one that mirrors it: even and odd coefficients, from the outermost tap inward.
struct Polynomials {
  std::vector<std::array<double, 3>> even, odd;
  [[nodiscard]] std::size_t taps() const { return 2 * even.size(); }
};

const Polynomials& of_six() {
  static const Polynomials six{{{VDVR_SIX_EVEN_A}, {VDVR_SIX_EVEN_B}, {VDVR_SIX_EVEN_C}},
                               {{VDVR_SIX_ODD_A}, {VDVR_SIX_ODD_B}, {VDVR_SIX_ODD_C}}};
  return six;
}

const Polynomials& of_eight() {
  static const Polynomials eight{
      {{VDVR_EIGHT_EVEN_A}, {VDVR_EIGHT_EVEN_B}, {VDVR_EIGHT_EVEN_C}, {VDVR_EIGHT_EVEN_D}},
      {{VDVR_EIGHT_ODD_A}, {VDVR_EIGHT_ODD_B}, {VDVR_EIGHT_ODD_C}, {VDVR_EIGHT_ODD_D}}};
  return eight;
}

const Polynomials& of_taps(int taps) { return taps == 6 ? of_six() : of_eight(); }

// Coefficient of g^i in the weight of a tap, taps counted from 0.
double coefficient(const Polynomials& p, std::size_t tap, std::size_t i) {
  const std::size_t n = std::min(tap, p.taps() - 1 - tap);
  const double c = i % 2 == 0 ? p.even[n][i / 2] : p.odd[n][i / 2];
  return i % 2 == 1 && tap >= p.taps() / 2 ? -c : c;
}

// d! / d (d - 1) .. : the factor of g^(i - order) in the order-th derivative of g^i.
double fallen(std::size_t i, std::size_t order) {
  double product = 1;
  for (std::size_t k = 0; k < order; ++k) product *= static_cast<double>(i) - static_cast<double>(k);
  return product;
}

// The order-th derivatives of the weights at f.
std::vector<double> derivatives(const Polynomials& p, double f, std::size_t order) {
  std::vector<double> w(p.taps(), 0.0);
  for (std::size_t tap = 0; tap < w.size(); ++tap)
    for (std::size_t i = order; i < powers; ++i)
      w[tap] += coefficient(p, tap, i) * fallen(i, order) * std::pow(f - 0.5, static_cast<double>(i - order));
  return w;
}

// At least the magnitude of the order-th derivative of a sum of weights, over f in [0, 1].
double largest_derivative(const Polynomials& p, std::size_t first, std::size_t last, std::size_t order) {
  double sum = 0;
  for (std::size_t i = order; i < powers; ++i) {
    double c = 0;
    for (std::size_t tap = first; tap <= last; ++tap) c += coefficient(p, tap, i);
    sum += std::abs(c) * fallen(i, order) * std::pow(0.5, static_cast<double>(i - order));
  }
  return sum;
}

// What the order-th derivative of the interpolant by f errs against that of the field: at f.
NodeFunctional functional(const Polynomials& p, double f, std::size_t order) {
  const double first = 1 - 0.5 * static_cast<double>(p.taps());
  return {derivatives(p, f, order), first - f, static_cast<int>(order)};
}

// At least |error| over all f, of an error that `of` bounds for one f: what it lacks between steps is its
// second derivative's, which is the error of the second derivative; and so on. The sixth derivative of the
// weights is 0, and that of a wave at most w^6.
template <typename Of>
double over_all_places(const Polynomials& p, double w, const Of& of) {
  double largest = std::pow(w, 6);
  for (const std::size_t order : {4U, 2U, 0U}) {
    double at_steps = 0;
    for (int s = 0; s <= steps_of_half; ++s)
      at_steps = std::max(at_steps, of(functional(p, apart * s, order)));
    largest = at_steps + bend * largest;
  }
  return largest;
}

// Sums over the taps, and over differences of columns (summation by parts), for all f in [0, 1].
void bound_sums(ColumnTaps& facts, const Polynomials& p) {
  const std::size_t taps = p.taps();
  std::vector<double> bend_of_part(taps);
  double bend_of_weights = 0;
  for (std::size_t tap = 0; tap < taps; ++tap) {
    bend_of_weights += bend * largest_derivative(p, tap, tap, 2);
    bend_of_part[tap] = bend * largest_derivative(p, 0, tap, 3);
  }
  for (int s = 0; s <= 2 * steps_of_half; ++s) {
    double norm = bend_of_weights, slope = 0, part = 0;
    for (const double w : derivatives(p, apart * s, 0)) norm += std::abs(w);
    const std::vector<double> slopes = derivatives(p, apart * s, 1);
    for (std::size_t tap = 0; tap + 1 < taps; ++tap) {
      part += slopes[tap];
      slope += std::abs(part) + bend_of_part[tap];
    }
    facts.norm = std::max(facts.norm, norm);
    facts.slope = std::max(facts.slope, slope);
    facts.slope_sum = std::max(facts.slope_sum, std::abs(part + slopes[taps - 1]) + bend_of_part[taps - 1]);
  }
}

// The moments' largest sums over f in [0, 1]: at steps, and between them by their second derivatives, sums of
// magnitudes.
std::array<double, 2> bound_moments(const Polynomials& p, double band) {
  const double farthest = 0.5 * static_cast<double>(p.taps());
  std::array<double, 3> magnitudes{};  // of derivatives of the weights, by order
  for (std::size_t order = 0; order < 3; ++order)
    for (std::size_t tap = 0; tap < p.taps(); ++tap)
      magnitudes[order] += largest_derivative(p, tap, tap, order);
  std::array<double, 2> out{};
  for (int s = 0; s <= steps_of_half; ++s) {
    const std::vector<double> found = moment_sup_constants(functional(p, apart * s, 0), band, 3);
    for (std::size_t n = 0; n < 2; ++n) out[n] = std::max(out[n], found[n + 1]);
  }
  out[0] += bend * (farthest * magnitudes[2] + 2 * magnitudes[1]);
  out[1] += bend * (farthest * farthest * magnitudes[2] + 4 * farthest * magnitudes[1] + 2 * magnitudes[0]);
  return out;
}

// a + s (b + s c), |s| <= 1/4 with an error of one rounding, in units of u: the magnitudes that each rounding
// is of. A compiler that fuses takes fewer.
double horner_rounding(double a, double b, double c) {
  constexpr double s = 0.25;
  const double inner = std::abs(b) + s * std::abs(c), inner_error = 2 * s * std::abs(c) + inner;
  return 2 * s * inner + s * inner_error + std::abs(a) + s * inner;
}

// Two taps mirror each other: even(g^2) +- g odd(g^2), |g| <= 1/2 with an error of at most 2^-26.
double weights_rounding(const Polynomials& p) {
  double roundings = 0, by_place = 0;
  for (std::size_t tap = 0; tap < p.taps(); ++tap) {
    const auto c = [&](std::size_t i) { return coefficient(p, tap, i); };
    const double whole = std::abs(c(0)) + std::abs(c(2)) / 4 + std::abs(c(4)) / 16,
                 slanted = 0.5 * (std::abs(c(1)) + std::abs(c(3)) / 4 + std::abs(c(5)) / 16);
    roundings += horner_rounding(c(0), c(2), c(4)) + 0.5 * horner_rounding(c(1), c(3), c(5)) + slanted +
                 (whole + slanted);
    by_place += largest_derivative(p, tap, tap, 1);
  }
  return 1.0001 * 0x1p-24 * roundings + 0x1p-26 * by_place;
}

ColumnTaps compute_facts(const Polynomials& p, double band) {
  ColumnTaps facts;
  facts.taps = static_cast<int>(p.taps());
  facts.band = band;
  facts.error =
      over_all_places(p, band, [&](const NodeFunctional& at) { return largest_symbol_error(at, band); });
  facts.sup = over_all_places(p, band, [&](const NodeFunctional& at) { return sup_constant(at, band); });
  facts.rounding = weights_rounding(p);
  bound_sums(facts, p);
  return facts;
}

}  // namespace

std::vector<double> six_taps(double f) { return derivatives(of_six(), f, 0); }
std::vector<double> eight_taps(double f) { return derivatives(of_eight(), f, 0); }

const std::array<double, 2>& ColumnTaps::moments() const {
  if (taps == 6) {
    static const std::array<double, 2> of_six_taps = bound_moments(of_six(), band);
    return of_six_taps;
  }
  static const std::array<double, 2> of_eight_taps = bound_moments(of_eight(), band);
  return of_eight_taps;
}

// With z = y / (1 + tau y) it is (z / y)^2 q(z), whose first derivative by tau is -(y^2 q)' at tau = 0, and
// the second (z / y)^2 (6 z^2 q + 6 z^3 q' + z^4 q'') anywhere. q' and q'' have at most band and band^2 of q.
double ColumnTaps::error_of_wedge(double tau) const {
  if (tau == 0) return 0;
  const double t = std::abs(tau), reach = 0.5 * static_cast<double>(taps), room = 1 - t * reach;
  if (!(room > 0.5)) return HUGE_VAL;
  const double z = reach / room, zz = z * z;
  return t * (2 * moments()[0] + band * moments()[1]) +
         0.5 * t * t * norm * zz * (6 + 6 * z * band + zz * band * band) / (room * room);
}

double ColumnTaps::error_at(double w) const {
  return over_all_places(of_taps(taps), w, [&](const NodeFunctional& at) { return symbol_error(at, w); });
}

const ColumnTaps& six_tap_facts() {
  static const ColumnTaps facts = compute_facts(of_six(), std::numbers::pi / 8);
  return facts;
}

const ColumnTaps& eight_tap_facts() {
  static const ColumnTaps facts = compute_facts(of_eight(), std::numbers::pi / 6);
  return facts;
}

}  // namespace vdvr
