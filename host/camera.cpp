// Cameras. Called by the render, run and bench commands.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "vdvr/error.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

Camera orbit_camera(const Grid& grid, double azimuth_deg, double elevation_deg, double zoom) {
  if (!std::isfinite(azimuth_deg) || !std::isfinite(elevation_deg))
    throw InputError(
        fmt::format("--azimuth {} and --elevation {} must be finite", azimuth_deg, elevation_deg));
  if (!(zoom > 0) || !std::isfinite(zoom)) throw InputError(fmt::format("--zoom {} must be positive", zoom));
  double diagonal2 = 0;
  Camera camera;
  for (std::size_t a = 0; a < 3; ++a) {
    const double side = static_cast<double>(grid.cells[a]) * grid.spacing[a];
    camera.focal_point[a] = grid.origin[a] + side / 2;
    diagonal2 += side * side;
  }
  const double degree = std::numbers::pi / 180;
  // Whole quarter turns give exact zeros, so that rays run parallel to the axes where the user means them to.
  const auto sine = [&](double deg) { return std::fmod(deg, 180) == 0 ? 0.0 : std::sin(deg * degree); };
  const auto cosine = [&](double deg) {
    return std::fmod(std::abs(deg), 180) == 90 ? 0.0 : std::cos(deg * degree);
  };
  const double ca = cosine(azimuth_deg), sa = sine(azimuth_deg), ce = cosine(elevation_deg),
               se = sine(elevation_deg);
  // As in VTK: a positive azimuth moves the camera to its right, a positive elevation towards view-up, here
  // -z.
  const Vec3 towards_eye{ce * sa, ce * ca, -se};
  const double half_angle = camera.view_angle_deg / 2 * degree;
  const double distance = std::sqrt(diagonal2) / 2 / std::sin(half_angle);
  for (std::size_t a = 0; a < 3; ++a) camera.position[a] = camera.focal_point[a] + distance * towards_eye[a];
  // The derivative of towards_eye by elevation: -z at elevation 0, and defined at the poles too.
  camera.view_up = {-se * sa, -se * ca, -ce};
  camera.view_angle_deg = 2 * std::atan(std::tan(half_angle) / zoom) / degree;
  return camera;
}

}  // namespace vdvr
