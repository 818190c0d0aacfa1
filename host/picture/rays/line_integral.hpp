// The integral of V along a ray, and how far that of F can lie from it (docs/surfaces.md, "Line integrals").
#pragma once

#include "host/picture/rays/ray_walk.hpp"

namespace vdvr {

/// Density times world unit. The integral of F lies within `reach` of `value`, that of V.
struct LineIntegral {
  bool any = false;  ///< whether the ray meets the region at all
  double value = 0, reach = 0;
};
LineIntegral integral_along(const RayField& field, const WorldRay& ray);

}  // namespace vdvr
