// A picture of |V - F| on one slice, bounded by the certificate or measured pixel by pixel: the certified
// field against F reconstructed on the pixels themselves. Called by the commands run and render --mode error.
#pragma once

#include <array>
#include <cstdint>

#include "vdvr/certificate.hpp"
#include "vdvr/device.hpp"
#include "vdvr/export.hpp"
#include "vdvr/image.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

struct ErrorSliceOptions {
  int axis = 2;                            ///< 0 x, 1 y, 2 z
  double position = 0;                     ///< world
  std::int64_t width = 512, height = 512;  ///< of the picture
  /// With axes, colour bar and caption (slice_frame.hpp) where there is room; else the slice is all of it.
  bool framed = true;
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

/// The same picture from the certificate alone: every pixel shows the bound of |V - F| at the covered points
/// of its brick (`max_error`, `errors`), or where the file has none by brick the certificate's total; grey
/// and NaN in bricks that were not tested or lie outside the region of interest. Points that are not covered
/// cannot be told apart without the projections: the caption says where it holds. Of image3d the certificate
/// must be that of the device that draws (safe_sampler.hpp). Host only. Throws InputError when the
/// certificate has no total for the sampler, and as above.
VDVR_API ErrorSlice bound_slice(const MixedVolume& volume, const Certificate& certificate, bool image3d,
                                const ErrorSliceOptions& options);

/// RenderOutput::error as a picture: bounds in the colours of error slices, nothing black, bricks that were
/// not tested grey; below it the colours, as in an error slice. `bounds` is kErrorCaption pixels less high.
VDVR_API Image bound_picture(const FloatImage& bounds, double epsilon_abs);

}  // namespace vdvr
