// What an interactive viewer shows of a volume, as plain values: the volume's facts that a viewer needs, a
// view of it, and the picture's options of a view. Events change views (live_events.hpp), text carries them
// (live_json.hpp), a LiveRenderer draws them (live_renderer.hpp).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// What a viewer must know of a volume, computed once.
struct LiveScene {
  Grid grid;
  Brightness brightness;
  std::pair<double, double> range{0, 0};  ///< of the samples on the grid
  std::vector<double> histogram;          ///< shares of these samples in equal bins over `range`
  /// What orbits look at, and from how far at zoom 1: all that the first transfer function shows in a whole
  /// turn of a picture as high as wide; of thin volumes the grid.
  OrbitFrame frame;
  /// With a certificate the buffer, but in a LiveRenderer's scene what its device may take.
  SamplerKind sampler = SamplerKind::automatic;
  bool has_bounds = false;  ///< there is a certificate, with bounds by brick
  double epsilon_abs = 0;   ///< of it
};
/// Cost: brightness_of, shown_points and one more pass over the samples. Host only.
VDVR_API LiveScene live_scene(const MixedVolume& volume, const std::optional<Certificate>& certificate = {});

/// Of one view; angles as orbit_camera has them.
struct LiveView {
  RenderMode mode = RenderMode::dvr;  ///< error: the certificate's bound on the slice
  double azimuth_deg = 30, elevation_deg = 20, zoom = 1;
  /// Where the picture shows the middle of the scene's frame, to the right and down, in diameters of the
  /// sphere that fits the picture from there.
  std::array<double, 2> pan{0, 0};
  TransferFunction transfer;                    ///< of modes dvr and mip; opacities of one base cell
  double iso = 0;                               ///< the surface's density
  int slice_axis = 2;                           ///< 0 x, 1 y, 2 z
  double slice_position = 0;                    ///< world
  std::pair<double, double> slice_range{0, 1};  ///< grey window
  /// Of every mode but slices: the box that is drawn, world, x0, y0, z0, x1, y1, z1; nothing: all of it.
  std::optional<std::array<double, 6>> clip;
  bool shading = true;
  bool bound = false;  ///< mixes the colours of the bound of |V - F| into the picture

  [[nodiscard]] bool is_flat() const { return mode == RenderMode::slice || mode == RenderMode::error; }
};
/// What automatic_view shows; thin volumes as a slice. A picture that is higher than wide is zoomed out until
/// the volume fits its width.
VDVR_API LiveView first_view(const LiveScene& scene, std::int64_t width, std::int64_t height);
/// Throws InputError naming the field: not finite, out of the volume, a bound without a certificate.
VDVR_API void check_view(const LiveView& view, const LiveScene& scene);

/// Without a pan it is orbit_camera() to the bit.
VDVR_API Camera camera_of(const LiveView& view, const OrbitFrame& frame);
/// What the still picture of a view is drawn with: by Renderer::render, but for mode error and the bound's
/// colours (live_renderer.hpp).
VDVR_API RenderOptions options_of(const LiveView& view, const LiveScene& scene, std::int64_t width,
                                  std::int64_t height);

/// The options of `vdvr render` that draw this view at this size, to be put behind `vdvr render FILE -o X`.
/// The transfer function and the bound's colours are not among them: `--tf` takes a file.
VDVR_API std::vector<std::string> render_words(const LiveView& view, const LiveScene& scene,
                                               std::int64_t width, std::int64_t height);

}  // namespace vdvr
