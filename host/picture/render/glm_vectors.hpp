// Our vectors as GLM's. Included by what computes with directions: cameras, lights, overlays.
#pragma once

#include <glm/vec3.hpp>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

inline glm::dvec3 to_glm(const Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace vdvr
