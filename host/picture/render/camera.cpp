// Cameras, and the one check of them.

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "host/picture/render/glm_vectors.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/camera.hpp"

namespace vdvr {
namespace {

// Of vectors that are not 0.
bool are_parallel(const glm::dvec3& a, const glm::dvec3& b) {
  constexpr double least = 1e-6;  // of the sine between them: fp32 rays turn by less
  return !(glm::length(glm::cross(a, b)) > least * glm::length(a) * glm::length(b));
}

}  // namespace

void check_camera(const Camera& c) {
  if (!is_finite(c.position) || !is_finite(c.focal_point) || !is_finite(c.view_up))
    throw InputError("the camera's position, focal point and view-up must be finite");
  if (!(c.view_angle_deg > 0 && c.view_angle_deg < 180))
    throw InputError(
        fmt::format("`camera_view_angle` {} must lie between 0 and 180 degrees", c.view_angle_deg));
  const glm::dvec3 view = to_glm(c.focal_point) - to_glm(c.position), up = to_glm(c.view_up);
  if (!(glm::length(view) > 0))
    throw InputError("`camera_position` and `camera_focal_point` are the same point");
  if (!(glm::length(up) > 0)) throw InputError("`camera_view_up` is 0,0,0; it must have a direction");
  if (are_parallel(view, up))
    throw InputError("`camera_view_up` is parallel to the direction of view; choose another");
}

Camera look_at(const Vec3& position, const Vec3& focal_point, const std::optional<Vec3>& view_up,
               double view_angle_deg) {
  Camera camera{position, focal_point, view_up.value_or(Vec3{0, 0, -1}), view_angle_deg};
  const glm::dvec3 view = to_glm(focal_point) - to_glm(position);
  // As a slice across z shows it: seen from -z, x to the right and y down.
  if (!view_up && are_parallel(view, to_glm(camera.view_up)))
    camera.view_up = {0, view.z > 0 ? -1.0 : 1.0, 0};
  check_camera(camera);
  return camera;
}

}  // namespace vdvr
