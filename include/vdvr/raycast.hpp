// Headless ray-casting of certified and uniform volumes: DVR, iso-surface, MIP, slice, error.
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/device.hpp"
#include "vdvr/image.hpp"
#include "vdvr/mixed_volume.hpp"

namespace vdvr {

/// Control points of density -> colour and opacity per base cell; linear between them.
struct TransferPoint {
  double value = 0;
  std::array<double, 3> rgb{1, 1, 1};
  double opacity = 0;  ///< over a path of one base cell
};
struct TransferFunction {
  std::string name;
  std::vector<TransferPoint> points;
  /// World length that opacities of a file hold over; 0: one base cell. `raycast` takes them as of a base
  /// cell: call per_base_cell first.
  double opacity_length = 0;
  std::string note = {};  ///< what a file left open and the reader filled in; empty: nothing
};
struct TransferPreset {
  std::string name, purpose;
};
const std::vector<TransferPreset>& transfer_presets();
/// A preset by name, stretched over [lo, hi]. Throws InputError. For CT take lo = max(0, minimum): air is 0,
/// and what lies below is undershoot of the filter. The presets "iso" and "marschner-lobb" have their surface
/// in the middle.
TransferFunction transfer_preset(const std::string& name, double lo, double hi);
/// Told apart by content: our {"points": [{"value", "rgb", "opacity"}]}, a 3D Slicer volume property
/// (.vp.json) or a ParaView preset (docs/rendering.md). Values as in the file. Throws FileError.
TransferFunction read_transfer_function(const std::filesystem::path& path);
/// Colour and opacity at a value: linear between points, the nearest point's beyond them; the last of several
/// points at one value.
TransferPoint transfer_at(const std::vector<TransferPoint>& points, double value);
/// The same with values mapped linearly so that the first lies at lo and the last at hi. Throws InputError.
TransferFunction stretched(TransferFunction transfer, double lo, double hi);
/// The same with opacities of one base cell, the smallest spacing of the grid.
TransferFunction per_base_cell(TransferFunction transfer, const Grid& grid);

struct Camera {
  Vec3 position{0, 3, 0};
  Vec3 focal_point{0, 0, 0};
  Vec3 view_up{0, 0, -1};
  double view_angle_deg = 30;  ///< vertical, perspective
};
/// Azimuth 0 looks along -y with +x to the right, view-up -z (docs/geometry.md); the azimuth turns about z.
/// Positive azimuth moves the camera to its right, positive elevation towards view-up, as in VTK. zoom 1 fits
/// the grid's bounding sphere; another divides the tangent of the half view angle. Throws InputError.
Camera orbit_camera(const Grid& grid, double azimuth_deg, double elevation_deg, double zoom);
/// Without `view_up` it is -z, and where that is (within 1e-6) the direction of view, the y direction that
/// leaves +x to the right. Throws InputError: not finite, position and focal point the same, a view_up
/// parallel to the view, an angle outside (0, 180).
Camera look_at(const Vec3& position, const Vec3& focal_point, const std::optional<Vec3>& view_up,
               double view_angle_deg);

enum class RenderMode { dvr, iso, mip, slice, error };
/// What a picture shows of modes dvr and iso (depth and error also of mip): colours, where and how what is
/// seen stands, or the largest bound of the samples that it was made of (ResidentVolume::set_bounds).
enum class RenderOutput { colour, depth, normal, error };

/// An iso-surface; several may be translucent. At most 8 a picture.
struct IsoSurface {
  double value = 0, opacity = 1;
  std::array<double, 3> rgb{0.93, 0.86, 0.74};
};

enum class SamplerKind { automatic, image3d, buffer };
/// How the direction of a surface is found. central: differences over one base cell at the very point, at
/// every level, without a seam where levels or cells meet. stored: those at the samples, made once a volume
/// (8 bytes a sample on the device) and interpolated as the field is; without a seam, and several times
/// faster in bricks with tiles; buffer sampler only. analytic: the derivative of the trilinear cell itself,
/// which jumps at its faces. automatic: stored for mode dvr where the device has room and the sampler is
/// `buffer`, else central.
enum class GradientKind { automatic, central, stored, analytic };

/// Mode dvr: colour and opacity of each sample, or of the path between two samples, along which the field is
/// taken as linear: no transfer function is then too sharp for a step.
enum class Classification { post, preintegrated };
/// Mode dvr: one step throughout, or step / 2^l in bricks of level l, with opacities corrected for it.
enum class StepMode { fixed, level };

struct RenderOptions {
  RenderMode mode = RenderMode::dvr;
  RenderOutput output = RenderOutput::colour;
  std::int64_t width = 512, height = 512;
  Camera camera;
  TransferFunction transfer;
  double step = 1;  ///< base cells (of the smallest spacing); opacities are corrected for it; iso needs none
  Classification classification = Classification::post;
  StepMode step_mode = StepMode::fixed;                  ///< level not with preintegrated
  std::vector<IsoSurface> surfaces;                      ///< of mode iso, in any order
  int slice_axis = 2;                                    ///< 0 x, 1 y, 2 z
  std::optional<double> slice_position;                  ///< world; default the middle
  std::optional<std::pair<double, double>> slice_range;  ///< grey window; default the volume's range
  bool shading = true;
  GradientKind gradient = GradientKind::central;
  bool head_light = true;      ///< at the eye
  std::vector<Vec3> lights{};  ///< directions towards lights that stand still, world axes; at most 8
  double termination = 0.99;   ///< early ray termination: opacity at which a ray stops
  bool skip_empty = true;      ///< brick min/max skipping; the picture is the same to the bit without it
  SamplerKind sampler = SamplerKind::automatic;
  /// Behind the volume, display values, top and bottom row.
  std::array<double, 3> background_top{0.13, 0.14, 0.16}, background_bottom{0.03, 0.03, 0.04};
};

struct RenderResult {
  Image image;
  /// What lies behind the pixels, NaN where nothing does. Colour: of dvr the opacity; of iso the distance
  /// from the eye to the first surface along the ray, world units; of mip the maximum; of slice the field.
  /// Depth: that distance of iso, of dvr to the sample that brings the opacity to a half, of mip to the
  /// maximum. Normal: three channels, x, y, z of the unit vector towards lower density there. Error: the
  /// largest bound of the samples that add at least 1/512 per base cell to the pixel (of iso and mip: of the
  /// points that it shows), infinite where one lies in a brick without.
  FloatImage values;
  SamplerKind sampler = SamplerKind::buffer;
  std::string sampler_reason;  ///< why this sampler: measured rates, or what the device lacks
  GradientKind gradient = GradientKind::central;  ///< what `automatic` took
  std::int64_t samples = 0;                       ///< taken along rays
  double seconds = 0;                             ///< kernel and read-back
};

struct ImageLimits;  // host/resident_volume.hpp

/// A volume on a device, uploaded once for many frames: sample buffer, brick records, brick min/max, and the
/// image3d atlas where the device has one that fits (built when a frame first needs it). Must not outlive the
/// device. Throws ResourceError (memory) and InputError (sizes that do not match, an axis beyond 8192 cells).
class ResidentVolume {
 public:
  ResidentVolume(Device& device, const MixedVolume& volume);
  /// With other limits of the atlas than the device's own.
  ResidentVolume(Device& device, const MixedVolume& volume, const ImageLimits& limits);
  ~ResidentVolume();
  ResidentVolume(ResidentVolume&&) noexcept;
  ResidentVolume& operator=(ResidentVolume&&) noexcept;

  [[nodiscard]] bool has_image3d() const;
  [[nodiscard]] std::string image3d_reason() const;  ///< why not, or the atlas' size
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::pair<float, float> value_range() const;
  [[nodiscard]] const Grid& grid() const;
  /// [bz][by][bx] what the field errs by at most in each brick, infinite where nothing is known
  /// (certificate.hpp, brick_bounds): what RenderOutput::error looks up. Throws InputError for another count.
  void set_bounds(const std::vector<float>& bounds);

  struct Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// One picture and its values. Colours are display values (sRGB), composited as such. A depth is shown bright
/// where near; a normal's components as colours, 0 as middle grey. Cost: 16 bytes per pixel on the device and
/// on the host. Slices: x right, y down across z; x right, z down across y; y right, z down across x. Throws
/// InputError for options out of range; ResourceError when `image3d` is asked for and cannot be had. Mode
/// `error` throws InputError: error slices are not ray-cast (`run`, `render --mode error`).
RenderResult raycast(Device& device, const ResidentVolume& volume, const RenderOptions& options);

/// What the device's filter of one image format does to weights and constants (docs/error-bounds.md, section
/// on samplers).
struct FilterProbe {
  bool image3d = false;     ///< the device has a linear CL_R 3D image sampler of this format
  double weight_error = 0;  ///< largest measured error of an interpolation weight
  double delta = 0;  ///< charged: 2^-22 fp32, 2^-9 rounding to 8 bits, 2^-8 truncation, else 1.5 measured;
                     ///< never below weight_error
  /// rho: largest error on constant, affine and random tiles beyond delta, relative to the largest sample, or
  /// to the format's whole scale where it is normalised.
  double constant_error = 0;
};

/// The device's image3d sampler. What it inherits is that of CL_FLOAT.
struct SamplerProbe : FilterProbe {
  FilterProbe u16, u8;  ///< CL_UNORM_INT16, CL_UNORM_INT8
  [[nodiscard]] const FilterProbe& of(SampleType type) const {
    return type == SampleType::f32 ? *this : type == SampleType::u16 ? u16 : u8;
  }
  [[nodiscard]] double largest_constant_error() const {
    return std::max({constant_error, u16.constant_error, u8.constant_error});
  }
  double buffer_rate = 0, image3d_rate = 0;  ///< samples per second, measured
  std::string chosen;                        ///< "buffer" or "image3d": what `auto` takes, by those rates
  std::string note;  ///< the class that delta was charged for, or why there is no image3d sampler
};
/// Measured once per device and process (about a second), then remembered.
SamplerProbe probe_sampler(Device& device);

}  // namespace vdvr
