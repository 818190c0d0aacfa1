// Units of computation: powers of two that bring pixels and line integrals to order one, so that nothing a
// bound is made of (fourth derivatives go with the fifth power of 1 / pitch) leaves the range of fp32,
// whatever the user's units. Powers of two round nothing: wherever world units would have done, results are
// theirs to the bit. World units come back, in double precision, where something is reported, thrown, stored
// or drawn (docs/error-bounds.md, section 7).
#pragma once

#include <array>
#include <span>
#include <utility>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// World = 2^exponent times what is computed with. In parallel beam heights have a length of their own: no
/// formula of it adds one to a length across the axis.
struct Units {
  int across = 0;  ///< of lengths in x and y
  int along = 0;   ///< of lengths in z
  int line = 0;    ///< of line integrals

  /// Of densities, which are line integrals per length across.
  [[nodiscard]] int density() const { return line - across; }
  [[nodiscard]] bool are_world() const { return *this == Units{}; }
  [[nodiscard]] Units inverse() const { return {-across, -along, -line}; }
  bool operator==(const Units&) const = default;
};

/// Those of a scan; all 0 where pitches and the largest line integral are within a few binary orders of 1.
/// Cost: a pass over the data.
Units units_of(const ProjectionSet& scan);

/// A scan and the units of what is computed from it, made once where the scan enters a stage. The scan itself
/// stays in world units, and is referred to.
struct ScanInUnits {
  /// Throws InputError unless line integrals are normal numbers of fp32. Cost: a pass over the data.
  explicit ScanInUnits(const ProjectionSet& scan);

  const ProjectionSet& scan;
  const double largest;  ///< |line integral|, in world units
  const Units units;
};

/// The largest |sample|, 0 of none; a sample that is NaN does not count.
double largest_magnitude(std::span<const float> samples);

/// 2^exponent times every sample; exact but for what leaves the normal numbers of fp32.
void scale(std::span<float> samples, int exponent);

/// What is given in `units` in world units.
double to_world(double density, const Units& units);
Vec3 to_world(const Vec3& point, const Units& units);
ParallelGeometry to_world(ParallelGeometry geometry, const Units& units);
Grid to_world(Grid grid, const Units& units);
std::array<double, 6> to_world(const std::array<double, 6>& box, const Units& units);

template <class T>
T from_world(T world, const Units& units) {
  return to_world(std::move(world), units.inverse());
}

/// Throws InputError unless densities up to `largest` |F|, which is in `units`, are normal numbers of fp32 in
/// world units, with room for what rises above them; 0 is a number like others.
void check_densities(double largest, const Units& units);
/// Densities in `units` into world units, which are checked so.
void densities_to_world(std::span<float> samples, const Units& units);

}  // namespace vdvr
