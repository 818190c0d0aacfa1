#include "host/picture/rays/crossings.hpp"

#include <limits>
#include <optional>

namespace vdvr {
namespace {

// A root is looked for to this part of a piece.
constexpr int depth = 20;

// A lower end of the places where the cubic may be at 0 or above: nothing where its coefficients say that it
// is below all along.
std::optional<double> may_reach(const Cubic& b, double from, double to, int left) {
  if (largest(b) < 0) return std::nullopt;
  if (left == 0 || b[0] >= 0) return from;
  const double middle = 0.5 * (from + to);
  if (const auto t = may_reach(part_of(b, 0, 0.5), from, middle, left - 1)) return t;
  return may_reach(part_of(b, 0.5, 1), middle, to, left - 1);
}

// A place where it is at 0 or above, near the first one.
std::optional<double> does_reach(const Cubic& b, double from, double to, int left) {
  if (b[0] >= 0) return from;
  if (largest(b) < 0) return std::nullopt;
  if (left == 0) return b[3] >= 0 ? std::optional(to) : std::nullopt;
  const double middle = 0.5 * (from + to);
  if (const auto t = does_reach(part_of(b, 0, 0.5), from, middle, left - 1)) return t;
  return does_reach(part_of(b, 0.5, 1), middle, to, left - 1);
}

// The cubic less the value, so that the side where the ray begins is below; with something added.
Cubic beyond(const Cubic& b, double value, double sign, double added) {
  Cubic out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = sign * (b[i] - value) + added;
  return out;
}

// Where F is surely above the value, or at it, and surely below or at it: the first place of each. Whatever
// the side on which it begins, it has passed the value at the later of the two.
struct BothSides {
  std::optional<double> above, below;

  [[nodiscard]] bool look(const RayPiece& piece, double value) {
    const auto find = [&](std::optional<double>& found, double sign) {
      if (!found)
        found = does_reach(beyond(piece.value, value, sign, -piece.bound), piece.first, piece.last, depth);
    };
    find(above, 1);
    find(below, -1);
    return above && below;
  }
};

}  // namespace

Crossing first_crossing(const RayField& field, const WorldRay& ray, double value) {
  Crossing out;
  double sign = 0;
  BothSides sides;
  field.walk(ray, [&](const RayPiece& piece) {
    if (sign == 0 && !out.from_start) {
      const double start = piece.value[0];
      if (!(std::abs(start - value) > piece.bound)) out = {Hit::possible, piece.first, 0, true};
      else sign = start < value ? 1 : -1;
    }
    if (out.from_start) {
      if (!sides.look(piece, value)) return true;
      out.hit = Hit::sure;
      out.last = std::max(*sides.above, *sides.below);
      return false;
    }
    // The entry of a piece is one of its places: V and the bound may have jumped there without a root.
    if (out.hit == Hit::none)
      if (const auto t =
              may_reach(beyond(piece.value, value, sign, piece.bound), piece.first, piece.last, depth)) {
        out.hit = Hit::possible;
        out.first = *t;
      }
    if (out.hit == Hit::none) return true;
    if (const auto t =
            does_reach(beyond(piece.value, value, sign, -piece.bound), piece.first, piece.last, depth)) {
      out.hit = Hit::sure;
      out.last = *t;
      return false;
    }
    return true;
  });
  return out;
}

Maximum maximum_along(const RayField& field, const WorldRay& ray) {
  Maximum out{false, -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), 0,
              0};
  field.walk(ray, [&](const RayPiece& piece) {
    out.any = true;
    out.low = std::max(out.low, std::max(piece.value[0], piece.value[3]) - piece.bound);
    out.high = std::max(out.high, largest(piece.value) + piece.bound);
    return true;
  });
  if (!out.any) return out;
  bool begun = false;
  field.walk(ray, [&](const RayPiece& piece) {
    if (largest(piece.value) + piece.bound < out.low) return true;
    if (!begun) out.first = piece.first;
    begun = true;
    out.last = piece.last;
    return true;
  });
  return out;
}

}  // namespace vdvr
