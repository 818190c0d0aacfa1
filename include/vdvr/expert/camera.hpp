// Where a picture is taken from.
#pragma once

#include <optional>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

struct Camera {
  Vec3 position{0, 3, 0};
  Vec3 focal_point{0, 0, 0};
  Vec3 view_up{0, 0, -1};
  double view_angle_deg = 30;  ///< vertical, perspective
};
/// Throws InputError: not finite, position and focal point the same, a view_up that is 0 or, within 1e-6 of
/// the sine between them, parallel to the view, an angle outside (0, 180). Whoever takes a camera asks it.
VDVR_API void check_camera(const Camera& camera);
/// Azimuth 0 looks along -y with +x to the right, view-up -z (docs/geometry.md); the azimuth turns about z.
/// Positive azimuth moves the camera to its right, positive elevation towards view-up, as in VTK. zoom 1 fits
/// the grid's bounding sphere; another divides the tangent of the half view angle. Throws InputError.
/// framing.hpp has orbits about what is shown.
VDVR_API Camera orbit_camera(const Grid& grid, double azimuth_deg, double elevation_deg, double zoom);
/// Without `view_up` it is -z, and where that is (within 1e-6) the direction of view, the y direction that
/// leaves +x to the right. Throws as check_camera().
VDVR_API Camera look_at(const Vec3& position, const Vec3& focal_point, const std::optional<Vec3>& view_up,
                        double view_angle_deg);

}  // namespace vdvr
