#include "host/certify/kept/projective_error.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/node_functional.hpp"

namespace vdvr {
namespace {

// Bands for which constants are known, evenly spaced; and moments t^0 .. t^16. Beyond these, magnitudes.
constexpr std::size_t bands = 24, moments = 17;
// Sums of fewer than a thousand products of numbers >= 0, in double precision.
constexpr double rounding = 1 + 0x1p-40;

// The filter at `phase` as a sum over t, times t^moment: what it should be is the value itself, or nothing.
NodeFunctional functional(const GoldFilter& filter, int phase, std::size_t moment) {
  NodeFunctional f;
  f.first = filter.first() - static_cast<double>(phase) / filter.rate;
  f.order = moment == 0 ? 0 : -1;
  for (int i = 0; i < filter.taps; ++i)
    f.taps.push_back(static_cast<double>(filter.weights[static_cast<std::size_t>(phase * filter.taps + i)]) *
                     std::pow(f.first + i, static_cast<double>(moment)));
  return f;
}

}  // namespace

ProjectiveError::ProjectiveError(const GoldFilter& filter, double highest)
    : highest_(highest), reach_(0.5 * filter.taps), norm_(filter.norm) {
  if (filter.rate == 1) return;
  constants_.assign(moments, std::vector<double>(bands, 0.0));
  parallel_for(static_cast<std::int64_t>(moments * bands), {}, "", [&](std::int64_t n) {
    const auto moment = static_cast<std::size_t>(n) / bands, band = static_cast<std::size_t>(n) % bands;
    // Other phases mirror these, and what a filter errs of a mirrored function is the same.
    for (int phase = 1; 2 * phase <= filter.rate; ++phase)
      constants_[moment][band] = std::max(
          constants_[moment][band],
          sup_constant(functional(filter, phase, moment), highest * static_cast<double>(band + 1) / bands));
  });
}

double ProjectiveError::constant(std::size_t moment, std::size_t band, double magnitude) const {
  if (moment >= moments) return magnitude;
  const double known = constants_[moment][band];
  return moment == 0 ? known : std::min(known, magnitude);
}

double ProjectiveError::at(double band, double rho) const {
  if (constants_.empty()) return 0;
  const double growth = std::abs(rho) * reach_;
  if (!(band <= highest_ * (1 + 1e-12)) || !(growth < 0.5)) return HUGE_VAL;
  // Terms fall at last like those of exp(band reach growth / (1 - growth)) (1 - growth)^-2, which all of
  // them, by magnitudes, add up to.
  const double exponent = band * reach_ * growth / (1 - growth);
  const double all = norm_ * std::exp(exponent) / ((1 - growth) * (1 - growth)), negligible = 0x1p-60 * all;
  const auto place = static_cast<std::size_t>(
      std::clamp(std::ceil(band / highest_ * bands - 1), 0.0, static_cast<double>(bands - 1)));
  double sum = 0, magnitudes = 0;
  double of_m = 1, power_m = norm_;  // (|rho| band)^m / m!, and norm reach^2m
  for (int m = 0; of_m * power_m > negligible; ++m) {
    double of_i = of_m, power = power_m;  // times C(m + 1 + i, i) |rho|^i, and reach^i
    for (int i = 0; of_i * power > negligible; ++i) {
      sum += of_i * constant(static_cast<std::size_t>(2 * m + i), place, power);
      magnitudes += of_i * power;
      of_i *= std::abs(rho) * (m + 2 + i) / (i + 1);
      power *= reach_;
    }
    of_m *= std::abs(rho) * band / (m + 1);
    power_m *= reach_ * reach_;
  }
  // What is left; the difference rounds by some u of `all`.
  return (sum + std::max(0.0, all - magnitudes) + all * 0x1p-44) * rounding;
}

}  // namespace vdvr
