// Certified surfaces as pictures.
#pragma once

#include "vdvr/api.hpp"
#include "vdvr/expert/certified_rays.hpp"
#include "vdvr/expert/image.hpp"

namespace vdvr {

/// Stripes over the pixels in which F may pass the value or not; where V's own picture shows nothing there,
/// too.
VDVR_API void hatch_possible(Image& picture, const SurfaceBounds& bounds);
/// Sure hits light, possible ones striped, none dark.
VDVR_API Image class_picture(const SurfaceBounds& bounds);
/// [y][x] how deep the band is in which the surface lies, world units; NaN where it is not sure.
VDVR_API FloatImage band_of(const SurfaceBounds& bounds);
/// Dark to light from 0 to `scale`; possible hits striped.
VDVR_API Image band_picture(const SurfaceBounds& bounds, double scale);
/// The band's depth that a share of the sure pixels does not pass; 0 where there are none.
VDVR_API double band_quantile(const SurfaceBounds& bounds, double share);

}  // namespace vdvr
