// Units of computation: powers of two that bring pixels and line integrals to order one, so that nothing a
// bound is made of (fourth derivatives go with the fifth power of 1 / pitch) leaves the range of fp32,
// whatever the user's units. Powers of two round nothing: wherever world units would have done, results are
// theirs to the bit. World units come back, in double precision, where something is reported, thrown, stored
// or drawn (docs/error-bounds.md, section 7).
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

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
  [[nodiscard]] bool are_world() const { return across == 0 && along == 0 && line == 0; }
  [[nodiscard]] Units inverse() const { return {-across, -along, -line}; }
};

/// Those of a scan; all 0 where pitches and the largest line integral are within a few binary orders of 1.
/// Cost: a pass over the data.
Units units_of(const ProjectionSet& scan);

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

/// Throws InputError unless line integrals, and densities up to `largest`, are normal numbers of fp32 with
/// room for what rises above them. `largest`: of |F|, in world units; 0 is a number like others.
void check_line_integrals(const ProjectionSet& scan);
void check_densities(double largest);

}  // namespace vdvr
