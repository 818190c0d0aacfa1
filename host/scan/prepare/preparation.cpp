#include "vdvr/expert/preparation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// A window of thousands of pixels would take hours and leave nothing of the picture.
constexpr int widest_line = 1001, widest_square = 31, most_binning = 64;
constexpr double widest_blur = 100;  // pixels

void require_odd(const char* what, int value, int most) {
  if (value < 1 || value > most || value % 2 == 0)
    throw InputError(fmt::format("{}: {} must be odd and from 1 to {}", what, value, most));
}

void require_positive(const char* what, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw InputError(fmt::format("{}: {} must be a positive number", what, value));
}

}  // namespace

void check_preparation(const Preparation& p) {
  if (p.outliers) {
    require_positive("outliers: the threshold", p.outliers->threshold);
    require_odd("outliers: the window", p.outliers->window, widest_square);
    if (p.outliers->window == 1) throw InputError("outliers: a window of 1 pixel has no neighbours");
  }
  if (p.phase) {
    require_positive("phase: the distance in mm", p.phase->distance_mm);
    require_positive("phase: the energy in keV", p.phase->energy_kev);
    require_positive("phase: delta / beta", p.phase->delta_beta);
  }
  if (p.stripes) {
    require_positive("stripes: the ratio", p.stripes->ratio);
    if (p.stripes->large != 0) require_odd("stripes: the large window", p.stripes->large, widest_line);
    if (p.stripes->small != 0) require_odd("stripes: the small window", p.stripes->small, widest_line);
  }
  require_odd("median: the window", p.median, widest_square);
  for (const double sigma : p.gaussian)
    if (!(sigma >= 0 && sigma <= widest_blur))
      throw InputError(fmt::format("gaussian: {} must be from 0 to {} pixels", sigma, widest_blur));
  if (p.binning < 1 || p.binning > most_binning)
    throw InputError(fmt::format("binning: {} must be from 1 to {}", p.binning, most_binning));
}

Preparation as_recorded(Preparation p) {
  p.flats_in_time = p.flats_in_time.value_or(false);
  p.beam_current = p.beam_current.value_or(false);
  return p;
}

Preparation for_columns(Preparation p, std::int64_t columns) {
  constexpr std::int64_t least = 5, most_large = 51, most_small = 21;
  const auto odd = [](std::int64_t n) { return static_cast<int>(n - 1 + n % 2); };
  if (p.stripes && p.stripes->large == 0) p.stripes->large = odd(std::clamp(columns / 6, least, most_large));
  if (p.stripes && p.stripes->small == 0) p.stripes->small = odd(std::clamp(columns / 15, least, most_small));
  return p;
}

std::string text_of(const Preparation& p) {
  std::vector<std::string> steps;
  if (p.flats_in_time) steps.emplace_back(*p.flats_in_time ? "flats in time" : "flats' mean");
  if (p.beam_current) steps.emplace_back(*p.beam_current ? "beam current" : "no beam current");
  if (p.outliers) steps.push_back(fmt::format("outliers {},{}", p.outliers->threshold, p.outliers->window));
  if (p.phase)
    steps.push_back(
        fmt::format("phase {},{},{}", p.phase->distance_mm, p.phase->energy_kev, p.phase->delta_beta));
  if (p.stripes)
    steps.push_back(fmt::format("stripes {},{},{}", p.stripes->ratio, p.stripes->large, p.stripes->small));
  if (p.median > 1) steps.push_back(fmt::format("median {}", p.median));
  if (p.gaussian[0] > 0 || p.gaussian[1] > 0)
    steps.push_back(fmt::format("gaussian {},{}", p.gaussian[0], p.gaussian[1]));
  if (p.binning > 1) steps.push_back(fmt::format("binning {}", p.binning));
  if (p.half_acquisition) steps.push_back(*p.half_acquisition ? "half acquisition" : "no half acquisition");
  if (p.heights)
    steps.emplace_back(p.heights == Heights::all      ? "all heights"
                       : p.heights == Heights::common ? "common heights"
                                                      : "heights as seen");
  if (p.padding != Padding::none) steps.push_back(fmt::format("pad {}", text_of(p.padding)));
  return steps.empty() ? "none" : fmt::format("{}", fmt::join(steps, "; "));
}

double binned_center(double center, int binning) {
  return (center - 0.5 * static_cast<double>(binning - 1)) / static_cast<double>(binning);
}

double unbinned_center(double center, int binning) {
  return center * static_cast<double>(binning) + 0.5 * static_cast<double>(binning - 1);
}

}  // namespace vdvr
