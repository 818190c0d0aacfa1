// Our vectors, and as GLM's. Included by what computes with directions: cameras, lights, overlays.
#pragma once

#include <cmath>
#include <glm/vec3.hpp>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

inline bool is_finite(const Vec3& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

inline glm::dvec3 to_glm(const Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace vdvr
