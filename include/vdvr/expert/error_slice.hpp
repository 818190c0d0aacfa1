// Pictures of what bricks are worth: the bound of |V - F|, sigma of the scan's own noise, or the one in units
// of the other; and of |V - F| itself on one slice, measured pixel by pixel against F reconstructed there.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// The latter two where the certificate has a `noise`.
enum class BrickQuantity { bound, sigma, bound_in_sigma };

/// A number for each brick, and what pictures of it say.
struct BrickValues {
  std::vector<float> values;  ///< [bz][by][bx]; infinite where nothing is known
  BrickQuantity quantity = BrickQuantity::bound;
  double end =
      0;  ///< of the colours: epsilon, the largest sigma, what is promised in sigma or else the largest
};
/// Of image3d the certificate must be that of the device that draws (safe_sampler.hpp). Throws InputError
/// where the certificate has no total for the sampler, or does not know sigma.
VDVR_API BrickValues brick_values(const MixedVolume& volume, const Certificate& certificate, bool image3d,
                                  BrickQuantity quantity);

struct ErrorSliceOptions {
  int axis = 2;                            ///< 0 x, 1 y, 2 z
  double position = 0;                     ///< world
  std::int64_t width = 512, height = 512;  ///< of the picture
  /// With axes, colour bar and caption (slice_frame.hpp) where there is room; else the slice is all of it.
  bool framed = true;
  /// Of error_slice(), what the words call the volume, and the end of its colours.
  std::string volume = "V", end = "epsilon";
};

/// Height of the caption below bound_picture(), in pixels.
inline constexpr std::int64_t kErrorCaption = 44;

struct ErrorSlice {
  Image image;
  FloatImage errors;  ///< of the slice without its frame; NaN where not compared
  double max_error = 0;
  Vec3 worst_at{0, 0, 0};
  std::int64_t pixels = 0;  ///< compared: covered and, where there is a region of interest, inside it
};

/// Cost: views * pixels updates, twice (a reconstruction has at least one cell across the slice). F by
/// `reconstruct` with cubic 16x upsampling, whose own error is far below any tolerance that a volume can be
/// certified to. Throws InputError when the slice misses the volume.
VDVR_API ErrorSlice error_slice(Device& device, const ProjectionSet& scan, const MixedVolume& volume,
                                const Certificate& certificate, const ErrorSliceOptions& options,
                                const Progress& progress = {});

/// The same picture from the certificate alone: every pixel shows its brick's value (`max_error`, `errors`),
/// of bounds at the covered points of the brick; grey and NaN in bricks that were not tested or lie outside
/// the region of interest. Points that are not covered cannot be told apart without the projections: the
/// caption says where it holds. Host only. Throws as brick_values() and as above.
VDVR_API ErrorSlice bound_slice(const MixedVolume& volume, const Certificate& certificate, bool image3d,
                                const ErrorSliceOptions& options,
                                BrickQuantity quantity = BrickQuantity::bound);

/// RenderOutput::error as a picture of brick_values() that were set as bounds: in the colours of error slices
/// up to `end`, nothing black, bricks of which nothing is known grey; below it the colours, as in an error
/// slice. `shown` is kErrorCaption pixels less high.
VDVR_API Image bound_picture(const FloatImage& shown, double end,
                             BrickQuantity quantity = BrickQuantity::bound);

}  // namespace vdvr
