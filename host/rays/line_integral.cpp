#include "host/rays/line_integral.hpp"

namespace vdvr {

// A cubic's mean is that of its Bernstein coefficients. The bound of a piece has 2^-36 of its values for
// rounding, which is above what sums of a ray's pieces lose in double precision as long as there are fewer
// than 2^16.
LineIntegral integral_along(const RayField& field, const WorldRay& ray) {
  LineIntegral out;
  field.walk(ray, [&](const RayPiece& piece) {
    const double length = piece.last - piece.first;
    out.any = true;
    out.value += length * ((piece.value[0] + piece.value[3]) + (piece.value[1] + piece.value[2])) / 4;
    out.reach += length * piece.bound;
    return true;
  });
  return out;
}

}  // namespace vdvr
