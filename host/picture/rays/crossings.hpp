// Where F can first pass a value on a ray, and where it must have (docs/pixel-bounds.md, "Surfaces").
#pragma once

#include "host/picture/rays/ray_walk.hpp"

namespace vdvr {

enum class Hit : std::uint8_t { none = 0, possible = 1, sure = 2 };

/// The first crossing of F with a value lies in [first, last] where it is sure; not before `first` where it
/// is possible.
struct Crossing {
  Hit hit = Hit::none;
  double first = 0, last = 0;  ///< along the ray, world units; last only where it is sure
  /// F may be on either side of the value where the ray begins, which `first` is. Sure where it is surely on
  /// both sides further on, or at the value.
  bool from_start = false;
};
Crossing first_crossing(const RayField& field, const WorldRay& ray, double value);

struct Maximum {
  bool any = false;            ///< whether the ray meets the region at all
  double low = 0, high = 0;    ///< max F lies between; high infinite where a brick was not tested
  double first = 0, last = 0;  ///< the maximum lies in this part of the ray
};
Maximum maximum_along(const RayField& field, const WorldRay& ray);

}  // namespace vdvr
