// What a picture of a certified volume is worth: for every pixel an interval that holds the colour of the
// ideal picture, the continuous emission and absorption over F (docs/pixel-bounds.md).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/resident_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

struct CertifyPictureOptions {
  /// Pieces of a ray are cut until the field spreads by at most 2 kappa e on each part: smaller is narrower
  /// and slower.
  double kappa = 0.5;
  /// A ray ends where at most this share of what lies behind can be seen, or less (ending_share()).
  double theta = 0x1p-10;
  /// One pass over the ray and nothing kept: for intervals 1.4 to 3 times as wide, while one turns a view.
  bool fast = false;
  /// Steps that take opacity and colour apart, as those of `fast` do: wider, but what they give for wider
  /// bounds on the same parts is never narrower.
  bool box = false;
  /// The certificate's: beside what its bound says, F may lie anywhere outside of this at any point, and it
  /// does so throughout a brick without a bound. The transfer function must be clear there.
  std::optional<std::pair<double, double>> window{};
};

/// Where rays end for bounds like these: at `theta`, or at a sixteenth of what the middle bound is of the
/// transfer function's range. So an end widens intervals by some per cent of their width at most.
VDVR_API double ending_share(double theta, const std::vector<float>& bounds,
                             const TransferFunction& transfer);

/// Whether a transfer function shows nothing below window.first and nothing above window.second.
VDVR_API bool is_clear_outside(const TransferFunction& transfer, const std::pair<double, double>& window);

/// What of the light is certified. as_drawn: colour and opacity of F under the light that V was drawn with, a
/// function on the ray that the drawn step fixes. lit: the light of F itself, of its differences over one
/// base cell.
enum class CertifiedLight { unlit, as_drawn, lit };
/// "unlit", "as drawn", "lit".
VDVR_API const char* text_of(CertifiedLight light);

/// [y][x] an interval a channel, display values.
struct PixelBounds {
  FloatImage lo, hi;                   ///< three channels
  std::vector<std::uint32_t> parts;    ///< of each ray; 0: nothing in front of the background
  std::vector<std::uint8_t> untested;  ///< 1: a brick without bound was seen
  CertifiedLight light = CertifiedLight::unlit;
  SamplerKind sampler = SamplerKind::buffer;
  double ray_offset_pixels = 0;  ///< how far a ray passes from the middle of its pixel, at most
  double seconds = 0;
};

/// Intervals of the picture that `options` draw: mode dvr, output colour. `bounds` are those of the sampler
/// that Renderer::sampler() names (certificate.hpp, brick_bounds): |V - F| at every point that is drawn, so
/// `options.clip` must lie in the covered region. With shading the light is as drawn, of gradients `central`
/// or `analytic`. Throws InputError for other modes, gradients, counts of bounds, a transfer function that
/// shows what lies outside the window, and what render() refuses; Interrupted.
VDVR_API PixelBounds certify_pixels(Device& device, const ResidentVolume& volume,
                                    const std::vector<float>& bounds, const RenderOptions& options,
                                    const CertifyPictureOptions& certify = {}, const Progress& progress = {});
/// The same of a volume that comes by bricks: those intervals, to the bit, by the buffer sampler. Throws
/// ResourceError too, before anything is certified, where the bricks of a few pixels do not fit.
VDVR_API PixelBounds certify_pixels(Device& device, const PagedVolume& volume,
                                    const std::vector<float>& bounds, const RenderOptions& options,
                                    const CertifyPictureOptions& certify = {}, const Progress& progress = {});

/// Where light of F is known of what is known of F in `known`: half a base cell within it, and within the
/// grid.
VDVR_API Clip inside_of_differences(const Clip& known, const Grid& grid);
/// The same with the light of F itself (docs/pixel-bounds.md, section 7), on the host in double precision,
/// for pictures with `gradient` central. `bounds` are of the buffer sampler and hold where `known` says. What
/// is drawn beside inside_of_differences() may be under any light; such pixels count as untested.
/// `value_range`: of V (ResidentVolume). Cost: 0.05 to 1 ms a ray of 64 cells. Throws InputError as
/// certify_pixels(), and for `fast` and `chord`, a window, or a picture without light; Interrupted.
VDVR_API PixelBounds certify_lit_pixels(const MixedVolume& volume, const std::vector<float>& bounds,
                                        const Clip& known, const std::pair<float, float>& value_range,
                                        const RenderOptions& options,
                                        const CertifyPictureOptions& certify = {},
                                        const Progress& progress = {});

/// The same of a slice, whose `slice_range` says its greys: F at the middle of each pixel, by V and the bound
/// of its brick. What is not covered, or outside the region of interest, is absent: clear_absent() makes a
/// drawn slice so. Host only. Throws InputError for another mode, no `slice_range`, a certificate with a
/// window or one that does not say which points are covered; Interrupted.
VDVR_API PixelBounds certify_slice(const MixedVolume& volume, const Certificate& certificate,
                                   const RenderOptions& options, const Progress& progress = {});
VDVR_API void clear_absent(Image& drawn, const PixelBounds& bounds);
/// The middle of a slice's pixel, world units.
VDVR_API Vec3 slice_point(const RenderOptions& options, const Grid& grid, std::int64_t x, std::int64_t y);
struct MaximumBounds;
struct IntegralBounds;
/// The colours that mode mip has for what certain maxima can be; behind rays without one the background.
VDVR_API PixelBounds colours_of_maxima(const MaximumBounds& maxima, const RenderOptions& options);
/// The greys that mode integral has for what certain integrals can be, through `slice_range`. Throws
/// InputError for another mode and no `slice_range`.
VDVR_API PixelBounds greys_of_integrals(const IntegralBounds& integrals, const RenderOptions& options);

/// How far what was drawn can lie from the ideal picture, in levels of 255.
struct PictureBound {
  FloatImage levels;  ///< one channel: of the worst channel of each pixel; infinite where nothing is known
  double mean = 0, p99 = 0, max = 0, half_width_mean = 0;
  std::array<std::int64_t, 2> worst{0, 0};                                                  ///< pixel x, y
  std::array<std::pair<int, double>, 5> within{{{1, 0}, {2, 0}, {4, 0}, {8, 0}, {16, 0}}};  ///< shares
  std::int64_t pixels = 0, background = 0, untested = 0;
  double parts_mean = 0;
};
VDVR_API PictureBound bound_of_picture(const PixelBounds& bounds, const Image& drawn);
/// Bounds from dark, 0, to light, the largest; untested pixels grey; a scale at the right, a line below.
VDVR_API Image picture_of_bound(const PictureBound& bound, const PixelBounds& bounds);
/// Share of pixels whose ideal bytes all lie within `levels` of the drawn ones.
VDVR_API double share_within(const PixelBounds& bounds, const Image& drawn, double levels);

/// A pixel of the ideal picture by the field's values in the middles of steps of a ray.
struct IdealPixel {
  std::array<double, 3> rgb{0, 0, 0};
  double quadrature = 0;  ///< how far three times longer steps are off; an estimate, no bound
  double light = 0;       ///< what rounding of the light that is drawn may move a channel by
  std::size_t points = 0;
};
/// The ray of a pixel within the grid and `options.clip`, and the middles of its steps.
struct RaySteps {
  Vec3 from{}, direction{};
  double first = 0, last = 0, length = 0;  ///< from the eye, world units; of a step
  std::vector<Vec3> points;                ///< thrice a whole number of them, or none
  [[nodiscard]] Vec3 at(double t) const {
    return {from[0] + t * direction[0], from[1] + t * direction[1], from[2] + t * direction[2]};
  }
};
/// `step` in base cells, at most.
VDVR_API RaySteps steps_of_pixel(const RenderOptions& options, const Grid& grid, std::int64_t x,
                                 std::int64_t y, double step);
/// Without light. `field` gives values at world points, as ExactField::at. `step` in base cells.
VDVR_API IdealPixel ideal_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                                const RenderOptions& options, const Grid& grid, std::int64_t x,
                                std::int64_t y, double step);
/// The same under the light of the field's differences over one base cell: seven values a step.
VDVR_API IdealPixel ideal_lit_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                                    const std::pair<float, float>& value_range, const RenderOptions& options,
                                    const Grid& grid, std::int64_t x, std::int64_t y, double step);
/// The same under the light that V was drawn with by the buffer sampler and `gradient` central: of V's
/// differences in the middles of intervals of `options.step`. `volume`: V.
VDVR_API IdealPixel
ideal_drawn_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                  const MixedVolume& volume, const std::pair<float, float>& value_range,
                  const RenderOptions& options, std::int64_t x, std::int64_t y, double step);

}  // namespace vdvr
