// What the tests of the ray-caster share.
#pragma once

#include "tests/support/device.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::support {

inline constexpr double u = tolerance::unit_roundoff;

/// Levels that differ across every face, edge and corner of bricks somewhere; z rises to 1, x to 2, y to 3.
inline LevelTriple scattered_levels(const Index3& b) {
  switch ((3 * b[0] + 5 * b[1] + 7 * b[2]) % 5) {
    case 0:
      return {1, 1, 1};
    case 1:
      return {2, 0, 1};
    case 2:
      return {0, 3, 0};
    default:
      return {0, 0, 0};
  }
}

}  // namespace vdvr::support
