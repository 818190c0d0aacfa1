// How a volume is looked at: the options of transfer function and camera that `render` and `bench render`
// share.
#pragma once

#include <optional>
#include <utility>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

/// --tf, --tf-range.
void add_transfer(Arguments& args);
/// The names of the presets with what each is for, one a line.
std::string preset_table();
/// The two values of --tf-range; nothing where it is `auto` or not given. Throws InputError unless they rise.
std::optional<std::pair<double, double>> given_range(const Arguments& args);
/// From --tf: a preset stretched over the volume's bulk (those with a surface in the middle around the
/// threshold), a file as it stands, or without --tf one that suits the volume; --tf-range overrides.
/// Opacities are those of one base cell of the grid. What a reader filled in stands in `note`.
TransferFunction transfer_for(const Arguments& args, const Brightness& brightness, const Grid& grid);

/// From --sampler and --gradient.
const char* sampler_name(SamplerKind kind);
SamplerKind sampler_option(const Arguments& args);
GradientKind gradient_option(const Arguments& args);
const char* gradient_name(GradientKind kind);

/// An orbit around the volume, as --azimuth, --elevation and --zoom say.
struct Orbit {
  double azimuth = 30, elevation = 20, zoom = 1;
};
/// Declares the three with `fallback` in their help; zoom 1 fits `what`.
void add_orbit(Arguments& args, const Orbit& fallback, const std::string& what);
Orbit orbit_options(const Arguments& args, const Orbit& fallback);
/// --camera-position, -focal-point, -view-up, -view-angle.
void add_free_camera(Arguments& args);
const std::vector<std::string>& free_camera_options();
bool has_free_camera(const Arguments& args);
/// --frame.
void add_frame(Arguments& args);
/// Throws InputError for another word than its two.
bool frames_grid(const Arguments& args);
/// What zoom 1 fits, by --frame: of one picture what `options` show from there, of a turntable what they show
/// all around; the grid where that is nothing, and where its edges are drawn.
OrbitFrame frame_for(const Arguments& args, const MixedVolume& volume, const RenderOptions& options,
                     const Orbit& orbit);
/// The free camera where one of its options was given, else the orbit.
Camera camera_for(const Arguments& args, const OrbitFrame& frame, const Orbit& orbit);

}  // namespace vdvr::cli
