// Views that suit what is in a volume: where its samples lie, a transfer function for them, and the sampler
// that its certificate allows. Called by both programs wherever they draw.
#pragma once

#include <optional>

#include "vdvr/certificate.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

/// Where the picture-worthy values lie, from the base samples.
struct Brightness {
  double lo = 0, hi = 0;  ///< the bulk of the samples, without outliers
  double grey_lo = 0,
         grey_hi = 0;          ///< window of slices: small dense parts may saturate, so that the rest is seen
  double threshold = 0;        ///< between the densest material and the rest (Otsu's criterion)
  double soft = 0;             ///< within the rest, between background and soft material
  Vec3 dense_center{0, 0, 0};  ///< centroid of what lies above the threshold
};
Brightness brightness_of(const MixedVolume& volume);
/// Background clear, soft material a veil, dense material solid, each where the volume's own samples part.
TransferFunction two_material_transfer(const Brightness& brightness);

/// The sampler to render with: never one that the certificate does not hold for, unless asked for by name.
SamplerKind safe_sampler(SamplerKind asked, const std::optional<Certificate>& certificate);

}  // namespace vdvr::cli
