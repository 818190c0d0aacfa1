#include "host/scan/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "host/base/system/parallel.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Binary orders within which a length or a line integral is left as it is. A fourth derivative of what 1,000
// views add up to is then below 2^10 (data) * 2^10 (views) * 2^7 (pi^4) * 2^20 (pitch^-5), and its square
// still a number.
constexpr int usual_pitch = 4, usual_line = 10;

int exponent_of(double x, int usual) {
  if (!(x > 0) || !std::isfinite(x)) return 0;
  const int exponent = std::ilogb(x);
  return std::abs(exponent) <= usual ? 0 : exponent;
}

// Calls body(first, last) for runs of samples, over all cores.
template <class Body>
void by_runs(std::size_t samples, Body&& body) {
  constexpr std::size_t run = 1 << 18;
  parallel_for(static_cast<std::int64_t>((samples + run - 1) / run), {}, "", [&](std::int64_t i) {
    const std::size_t first = static_cast<std::size_t>(i) * run;
    body(first, std::min(samples, first + run));
  });
}

}  // namespace

double largest_magnitude(std::span<const float> samples) {
  float largest = 0;
  std::mutex lock;
  by_runs(samples.size(), [&](std::size_t first, std::size_t last) {
    float own = 0;
    for (std::size_t i = first; i < last; ++i) own = std::max(own, std::abs(samples[i]));
    const std::lock_guard guard(lock);
    largest = std::max(largest, own);
  });
  return static_cast<double>(largest);
}

namespace {

Units units_of(const ProjectionSet& scan, double largest) {
  Units units;
  units.across = exponent_of(scan.geometry.pitch_u, usual_pitch);
  // Slanted rays have one unit of length.
  units.along = scan.cone ? units.across : exponent_of(scan.geometry.pitch_v, usual_pitch);
  units.line = exponent_of(largest, usual_line);
  return units;
}

void check(double magnitude, double largest, const char* what, const char* remedy) {
  constexpr double smallest = 0x1p-126;
  if (magnitude == 0 || (magnitude >= smallest && magnitude <= largest)) return;
  throw InputError(fmt::format(
      "{} reach {:.3g}; float32, in which scans are read and volumes stored, holds {:.3g} to {:.3g}: {}",
      what, magnitude, smallest, largest, remedy));
}

double checked_largest(const ProjectionSet& scan) {
  const double magnitude = largest_magnitude(scan.data);
  // What is not finite is refused by view, after filtering.
  if (std::isfinite(magnitude))
    check(magnitude, static_cast<double>(std::numeric_limits<float>::max()), "the line integrals",
          "scale them, or state lengths in another unit");
  return magnitude;
}

}  // namespace

Units units_of(const ProjectionSet& scan) { return units_of(scan, largest_magnitude(scan.data)); }

ScanInUnits::ScanInUnits(const ProjectionSet& of)
    : scan(of), largest(checked_largest(of)), units(units_of(of, largest)) {}

void scale(std::span<float> samples, int exponent) {
  if (exponent == 0) return;
  by_runs(samples.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) samples[i] = std::ldexp(samples[i], exponent);
  });
}

double to_world(double density, const Units& units) { return std::ldexp(density, units.density()); }

Vec3 to_world(const Vec3& point, const Units& units) {
  return {std::ldexp(point[0], units.across), std::ldexp(point[1], units.across),
          std::ldexp(point[2], units.along)};
}

ParallelGeometry to_world(ParallelGeometry geometry, const Units& units) {
  geometry.pitch_u = std::ldexp(geometry.pitch_u, units.across);
  geometry.pitch_v = std::ldexp(geometry.pitch_v, units.along);
  return geometry;
}

Grid to_world(Grid grid, const Units& units) {
  grid.origin = to_world(grid.origin, units);
  grid.spacing = to_world(grid.spacing, units);
  return grid;
}

std::array<double, 6> to_world(const std::array<double, 6>& box, const Units& units) {
  const Vec3 low = to_world(Vec3{box[0], box[1], box[2]}, units),
             high = to_world(Vec3{box[3], box[4], box[5]}, units);
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

void check_densities(double largest, const Units& units) {
  // Fitted samples and tiles may rise above the base's.
  check(to_world(largest, units), 0x1p126, "the densities",
        "state lengths (the pitch) in another unit, or scale the line integrals");
}

void densities_to_world(std::span<float> samples, const Units& units) {
  if (units.are_world()) return;
  check_densities(largest_magnitude(samples), units);
  scale(samples, units.density());
}

}  // namespace vdvr
