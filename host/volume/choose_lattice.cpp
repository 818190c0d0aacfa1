#include "host/volume/choose_lattice.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {
namespace {

// The smallest n with 2^n >= x > 0.
int ceil_log2(double x) {
  int n = 0;
  const double fraction = std::frexp(x, &n);  // x = fraction 2^n, 1/2 <= fraction < 1
  return fraction == 0.5 ? n - 1 : n;
}
int floor_log2(double x) { return std::ilogb(x); }

}  // namespace

std::int64_t most_code(SampleType type) { return type == SampleType::u8 ? 255 : 65535; }

IntegerLattice choose_lattice(std::span<const float> base, StorageChoice choice, double rounding,
                              int density) {
  return choose_lattice(base, choice, rounding, density, {});
}

IntegerLattice choose_lattice(std::span<const float> base, StorageChoice choice, double rounding, int density,
                              const FilterErrors& filters) {
  IntegerLattice lattice;
  if (choice == StorageChoice::f32 || base.empty()) return lattice;
  const auto [least, largest] = std::minmax_element(base.begin(), base.end());
  const float lo = *least, hi = *largest;
  double magnitude =
      std::max({std::abs(static_cast<double>(lo)), std::abs(static_cast<double>(hi)), rounding});
  if (!(magnitude > 0)) magnitude = 1;
  // Two bits are left above the base's largest sample, for tiles that rise above it. Beyond these ends a
  // product would leave the normal numbers of fp32.
  const int finest = std::clamp(ceil_log2(magnitude) - 22, -126 - density, 103 - density);
  // Room for tiles whose samples lie between the base's and exceed them.
  const double range = 1.125 * (static_cast<double>(hi) - static_cast<double>(lo));
  const auto finest_for = [&](SampleType type) {
    return range > 0 ? std::max(finest, ceil_log2(range / static_cast<double>(most_code(type)))) : finest;
  };
  const int u8 = finest_for(SampleType::u8), u16 = finest_for(SampleType::u16);
  const int coarsest = rounding > 0 ? floor_log2(2 * rounding) : finest - 1;
  // Tiles have the base's step or finer ones, and what their filters err by shrinks with it.
  const auto filters_well = [&](SampleType type, double error, int step) {
    return error * std::ldexp(static_cast<double>(most_code(type)), step) <= rounding;
  };
  const bool automatic = choice == StorageChoice::automatic;
  const bool well_u8 = filters_well(SampleType::u8, filters.u8, u8);
  lattice.step = std::ldexp(1.0, finest);
  lattice.least = choice == StorageChoice::u16 || (automatic && !well_u8) ? SampleType::u16 : SampleType::u8;
  if (choice == StorageChoice::u8 || (automatic && u8 <= coarsest && well_u8)) {
    lattice.base = SampleType::u8;
    lattice.base_shift = u8 - finest;
  } else if (choice == StorageChoice::u16 ||
             (u16 <= coarsest && filters_well(SampleType::u16, filters.u16, u16))) {
    lattice.base = SampleType::u16;
    // The base has bits to spare; a coarse step of its own lets more tiles do with 8.
    lattice.base_shift = (choice == StorageChoice::u16 ? u16 : coarsest) - finest;
  } else {
    return {};
  }
  lattice.finest_shift = std::max(lattice.base_shift - 2, 0);
  return lattice;
}

}  // namespace vdvr
