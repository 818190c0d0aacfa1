// Which part of a box lies where a function is at least t: an interval that holds it, from an affine function
// and how far the function lies from that at most. What is known so errs by the square of the box' side.
#pragma once

#include <array>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/measure.hpp"

namespace vdvr {

/// Values of a trilinear function at the corners of a box, x fastest.
using Corners = std::array<double, 8>;

/// On the box, coordinates from -1 to 1 along each side: middle + sum slope[a] x[a], and the function lies at
/// most `below` under it and `above` over it; it is nowhere less than `least` nor more than `largest`.
struct AffineForm {
  double middle = 0;
  Vec3 slope{};
  Vec3 bend{};  ///< what halving the box across an axis lowers `below` and `above` by, about
  double below = 0, above = 0, least = 0, largest = 0;
};

/// Of a trilinear function; with what double precision may have lost of its corners.
AffineForm affine_of(const Corners& corners);

/// The share of the box where the function is at least t, rounded outward. 0 or 1 exactly where it is below
/// or above everywhere. An infinite t is allowed.
Interval share_above(const AffineForm& form, double t);

/// About how wide share_above() is, for a fraction of its cost.
double open_near(const AffineForm& form, double t);

/// The axis across which halving lowers `below` and `above` most.
std::size_t most_bent(const AffineForm& form);

/// A box and a trilinear function on it.
struct Part {
  Vec3 low{}, high{};
  Corners value{};

  [[nodiscard]] double volume() const { return (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]); }
};

/// The part below and the part above a plane across the axis; `at` lies between.
std::array<Part, 2> split(const Part& part, std::size_t axis, double at);
std::array<Part, 2> halves(const Part& part, std::size_t axis);
std::size_t longest_side(const Part& part);
/// What of the part lies in the box; an empty one (high below low) where nothing does.
Part clipped_to(const Part& part, const Vec3& low, const Vec3& high);

}  // namespace vdvr
