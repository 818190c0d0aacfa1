#include "host/picture/rays/line_integral.hpp"

namespace vdvr {

// A cubic's mean is that of its Bernstein coefficients. The bound of a piece has 2^-36 of its values for
// rounding, which is above what the sum of V over a ray's pieces loses in double precision as long as there
// are fewer than 2^16; the sum of bounds takes as much of itself.
LineIntegral integral_along(const RayField& field, const WorldRay& ray) {
  LineIntegral out;
  field.walk(ray, [&](const RayPiece& piece) {
    const double length = piece.last - piece.first;
    out.any = true;
    out.value += length * ((piece.value[0] + piece.value[3]) + (piece.value[1] + piece.value[2])) / 4;
    out.reach += length * piece.bound;
    return true;
  });
  out.reach *= 1 + 0x1p-36;
  return out;
}

}  // namespace vdvr
