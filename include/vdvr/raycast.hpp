// Headless ray-casting of certified and uniform volumes: DVR, iso-surface, MIP, line integral, slice,
// error.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/probe_sampler.hpp"
#include "vdvr/expert/resident_volume.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {

/// integral: an X-ray picture, the field summed up along each ray.
enum class RenderMode { dvr, iso, mip, slice, error, integral };
/// The content of a picture in modes dvr and iso (depth and error also in mip). It is colours, the depth or
/// the normal of the thing seen, or the largest bound of the samples that it was made of
/// (Renderer::set_bounds).
enum class RenderOutput { colour, depth, normal, error };

/// An iso-surface; several may be translucent. At most 8 a picture.
struct IsoSurface {
  double value = 0, opacity = 1;
  std::array<double, 3> rgb{0.93, 0.86, 0.74};
};

/// How the direction of a surface is found. `central` takes differences over one base cell at the very point,
/// at every level, without a seam where levels or cells meet. `stored` takes the differences at the samples,
/// made once a volume (8 bytes a sample on the device), and interpolates them as the field. It has no seam,
/// is several times faster in bricks with tiles, and needs the buffer sampler. `analytic` takes the
/// derivative of the trilinear cell itself, which jumps at its faces. `automatic` takes `stored` for mode dvr
/// where the device has room and the sampler is `buffer`, else `central`.
enum class GradientKind { automatic, central, stored, analytic };

/// Mode dvr: colour and opacity of each sample, or of the path between two samples. Along that path the field
/// is taken as linear, so no transfer function is too sharp for a step.
enum class Classification { post, preintegrated };
/// Mode dvr, with opacities corrected for the step: one step throughout; step / 2^l in bricks of level l; or
/// step / 2^l where the transfer function changes much along a step. There l goes up to 4, so that steep
/// transfer functions draw no lines. Other modes and D2VR take adaptive for fixed.
enum class StepMode { fixed, level, adaptive };

/// The part of a volume that is drawn: the points that lie in a box and in an upright cylinder about (axis x,
/// axis y), both closed, world units. Everything outside is absent, as if the volume ended there: a surface
/// that is cut shows its inside. Rays enter and leave rounded inward, by at most some 1e-4 of the radius.
struct Clip {
  Vec3 low{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
           -std::numeric_limits<double>::infinity()},
      high{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
           std::numeric_limits<double>::infinity()};
  std::array<double, 2> axis{0, 0};
  double radius = std::numeric_limits<double>::infinity();
};

struct RenderOptions {
  RenderMode mode = RenderMode::dvr;
  RenderOutput output = RenderOutput::colour;
  std::int64_t width = 512, height = 512;
  Camera camera;
  TransferFunction transfer;
  double step = 1;  ///< base cells (of the smallest spacing); opacities are corrected for it; iso needs none
  Classification classification = Classification::post;
  StepMode step_mode = StepMode::fixed;  ///< the others not with preintegrated
  std::vector<IsoSurface> surfaces;      ///< of mode iso, in any order
  int slice_axis = 2;                    ///< 0 x, 1 y, 2 z
  std::optional<double> slice_position;  ///< world; default the middle
  /// Grey window of modes slice and integral; default the volume's range, in integral the range of the
  /// picture's values.
  std::optional<std::pair<double, double>> slice_range;
  bool shading = true;
  GradientKind gradient = GradientKind::central;
  bool head_light = true;      ///< at the eye
  std::vector<Vec3> lights{};  ///< directions towards lights that stand still, world axes; at most 8
  double termination = 0.99;   ///< early ray termination: opacity at which a ray stops
  bool skip_empty = true;      ///< brick min/max skipping; the picture is the same to the bit without it
  SamplerKind sampler = SamplerKind::automatic;
  std::optional<Clip> clip;  ///< of every mode but slice
  /// Behind the volume, display values, top and bottom row.
  std::array<double, 3> background_top{0.13, 0.14, 0.16}, background_bottom{0.03, 0.03, 0.04};
};

struct RenderResult {
  Image image;
  /// The values behind the pixels, NaN where there is none. Colour holds the opacity in dvr; in iso the
  /// distance from the eye to the first surface along the ray, world units; in mip the maximum; in slice the
  /// field. In integral it holds the line integral, density times world unit, 0 where a ray meets nothing.
  /// Depth holds that distance in iso, in dvr the distance to the sample that brings the opacity to a half,
  /// in mip to the maximum. Normal has three channels, x, y, z of the unit vector towards lower density
  /// there. Error holds the largest bound of the samples that add at least 1/512 per base cell to the pixel,
  /// in iso and mip of the points that it shows. It is infinite where one of these lies in a brick without a
  /// bound.
  FloatImage values;
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;  ///< why this sampler: measured rates, or what the device lacks
  GradientKind gradient = GradientKind::central;  ///< what `automatic` took
  std::int64_t samples = 0;                       ///< taken along rays
  double seconds = 0;                             ///< kernel and read-back
};

class D2vrScene;

/// Draws pictures of one volume, or of one scene of projections (d2vr.hpp). It keeps what the next picture
/// can use: the picture's memory, the transfer function's tables, which bricks can be leapt over.
///
/// Threads: one Renderer belongs to one thread at a time. Any number of them draw one const volume at once,
/// each in a thread of its own, and give the pictures that one thread gives. The device takes their frames in
/// turn, so that RenderResult::seconds counts what others had enqueued. Where memory is short,
/// GradientKind::automatic may find that others have taken the room for stored gradients.
///
/// Must not outlive the device, nor the volume or the scene.
class VDVR_API Renderer {
 public:
  Renderer(Device& device, const ResidentVolume& volume);
  Renderer(Device& device, const D2vrScene& scene);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// One picture and its values. Colours are display values (sRGB), composited as such. A depth is shown
  /// bright where near; a normal's components as colours, 0 as middle grey. Cost: 16 bytes per pixel on the
  /// device and on the host. Slices: x right, y down across z; x right, z down across y; y right, z down
  /// across x.
  ///
  /// Throws InputError for options out of range; ResourceError when `image3d` is asked for and cannot be had.
  /// Mode `error` throws InputError: error slices are not ray-cast (error_slice.hpp). Output `error` does
  /// without set_bounds(). For scenes see d2vr.hpp.
  RenderResult render(const RenderOptions& options);
  /// [bz][by][bx] what the field errs by at most in each brick, infinite where nothing is known
  /// (certificate.hpp, brick_bounds). RenderOutput::error looks these up. Throws InputError for another
  /// count.
  void set_bounds(const std::vector<float>& bounds);
  /// The sampler that a picture with this choice takes: bounds are of one sampler. Throws as render().
  [[nodiscard]] SamplerKind sampler(SamplerKind asked) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The least and the largest finite value. Mode integral takes them for its window. 0, 0 where there is none.
VDVR_API std::pair<double, double> range_of_values(const FloatImage& values);

/// One picture by a renderer of its own; a Renderer is faster for several.
VDVR_API RenderResult raycast(Device& device, const ResidentVolume& volume, const RenderOptions& options);

}  // namespace vdvr
