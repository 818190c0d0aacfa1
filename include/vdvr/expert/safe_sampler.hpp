// Which sampler a device may draw a certified volume with, and what the certificate says of the pictures.
// What the texture unit errs by is a matter of the device that draws: a file holds what it was on the device
// that built it, which says nothing of another.
#pragma once

#include <optional>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/probe_sampler.hpp"

namespace vdvr {

/// `stored` as it holds of pictures that `device` draws. The term of the image3d sampler, its total and
/// whether it holds are those of this device's texture unit, probed for the types of samples that the volume
/// has; absent where it has no such sampler. The buffer sampler's are the stored ones, since fp32 arithmetic
/// is the same everywhere, but on a device that flushes subnormal numbers to 0 not less than there. All else
/// is as it was: device and driver name the builder. Cost: a pass over all samples and, once in a process,
/// the probe.
VDVR_API Certificate certificate_on(Device& device, const MixedVolume& volume, const Certificate& stored);

struct SafeSampler {
  SamplerKind sampler = SamplerKind::automatic;  ///< to render with
  /// Why it is the buffer where the texture unit would be faster; else empty.
  std::string reason;
  /// As certificate_on() has it: what bounds of these pictures are taken from (brick_bounds, bound_slice).
  /// Says nothing of image3d where that is not drawn with.
  std::optional<Certificate> certificate;
};

/// `automatic` becomes `buffer` where the certificate does not hold for this device's texture unit, with
/// which pictures would otherwise be drawn. One that was asked for by name stays; an image3d for which the
/// certificate does not hold here throws ToleranceError, unless the picture is said to be `unverified`, or
/// the volume is for comparison and nothing is certified anyway. Cost: probe_sampler(), and where pictures
/// may be drawn with image3d certificate_on().
VDVR_API SafeSampler safe_sampler(Device& device, const MixedVolume& volume,
                                  const std::optional<Certificate>& stored,
                                  SamplerKind asked = SamplerKind::automatic, bool unverified = false);

}  // namespace vdvr
