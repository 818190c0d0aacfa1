// Cameras that frame what a picture shows of a volume, not its grid.
#pragma once

#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Points, world, whose hull holds what `options` show of the volume from an elevation and some azimuths:
/// samples on the grid that the transfer function makes opaque (modes dvr and mip), or cells that a surface
/// passes (iso), and a cell around each. Left out is what cannot be seen: blocks of samples that let 94 %
/// pass, unless so many lie behind each other that together they stop a tenth; and specks, which lie apart
/// from all else, are smaller than a 16th of the grid along each axis, and have less than a thousandth of the
/// opacity. Empty where nothing is shown. Host only. Cost: a pass over the samples on the grid; memory: a
/// float of each.
VDVR_API std::vector<Vec3> shown_points(const MixedVolume& volume, const RenderOptions& options,
                                        const std::vector<double>& azimuths_deg, double elevation_deg);

/// Where an orbit looks, and from how far, at zoom 1.
struct OrbitFrame {
  Vec3 middle{};
  double distance = 1;
};
/// The grid's bounding sphere.
VDVR_API OrbitFrame frame_grid(const Grid& grid);
/// All `points` in a picture of width / height `aspect`, its sides as near as they can be, with a margin of a
/// 20th of the half picture. Throws InputError for no points.
VDVR_API OrbitFrame frame_view(const std::vector<Vec3>& points, double azimuth_deg, double elevation_deg,
                               double aspect);
/// The same for a whole turn: about the middle of the points' box, from one distance.
VDVR_API OrbitFrame frame_turn(const std::vector<Vec3>& points, double elevation_deg, double aspect);
/// As orbit_camera(Grid, ...), about `frame`.
VDVR_API Camera orbit_camera(const OrbitFrame& frame, double azimuth_deg, double elevation_deg, double zoom);

/// Of what `options` show from there, in a picture of their size; the grid's where that is nothing. Cost:
/// shown_points.
VDVR_API OrbitFrame frame_view(const MixedVolume& volume, const RenderOptions& options, double azimuth_deg,
                               double elevation_deg);
/// The same of what they show all around.
VDVR_API OrbitFrame frame_turn(const MixedVolume& volume, const RenderOptions& options, double elevation_deg);

}  // namespace vdvr
