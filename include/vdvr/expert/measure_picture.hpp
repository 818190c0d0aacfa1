// Pictures of what is measured: which points of a slice are surely in a range of values, which may be, the
// places that components lie in, and a distribution as a band.
#pragma once

#include <cstdint>
#include <optional>

#include "vdvr/api.hpp"
#include "vdvr/expert/components.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/measure.hpp"

namespace vdvr {

struct MeasurePictureOptions {
  int axis = 2;                            ///< across which the slice lies: 0 x, 1 y, 2 z
  std::optional<double> position{};        ///< world; none: through the middle of the region
  std::int64_t width = 512, height = 512;  ///< at most; of the slice the region's extent, square pixels
};

/// Points that are surely in the range light, those that may be striped, those that are not dark; grey
/// beside the region. Below it what colours mean. Cost: a sample a pixel. Throws InputError for a slice that
/// misses the region, and a picture of fewer than 64 pixels a side or more than 16384.
VDVR_API Image class_slice(const Measurement& measurement, const ValueRange& range,
                           const MeasurePictureOptions& options);

/// The same where each place that components lie in has a colour of its own: what is surely in the range
/// full, the rest darker, and striped where the place may hold nothing. Cost: that of components().
VDVR_API Image component_slice(const Measurement& measurement, const ValueRange& range,
                               const MeasurePictureOptions& options, const ComponentsOptions& of_components,
                               const Progress& progress = {});

/// Of each bin the volume that surely lies in it, and over that what may. Sizes as above.
VDVR_API Image histogram_picture(const Distribution& distribution, std::int64_t width, std::int64_t height);

}  // namespace vdvr
