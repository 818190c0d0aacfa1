// A view that suits a volume when nobody said how to look at it: where its picture-worthy values lie, a
// transfer function, a camera, the sampler that its certificate allows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Where the picture-worthy values lie, from the base samples.
struct Brightness {
  double lo = 0, hi = 0;  ///< the bulk of the samples, without outliers
  double grey_lo = 0,
         grey_hi = 0;          ///< window of slices: small dense parts may saturate, so that the rest is seen
  double threshold = 0;        ///< between the densest material and the rest (Otsu's criterion)
  double soft = 0;             ///< within the rest, between background and soft material
  Vec3 dense_center{0, 0, 0};  ///< centroid of what lies above the threshold
  /// The volume is a mask or a label map whose object has lower values than what lies around it: the object
  /// shows below `soft`, and is dense below `threshold`.
  bool dense_is_low = false;
};
/// Masks and label maps are volumes whose neighbouring samples mostly have equal values. They show all that
/// differs from the value which most samples on the grid's faces have. In other volumes exact zeros do not
/// count, since they mean not covered. Host only. Cost: a few passes over the samples on the grid; memory: a
/// float of each.
VDVR_API Brightness brightness_of(const MixedVolume& volume);

/// Background clear, soft material a veil, dense material solid, each where the volume's own samples part.
VDVR_API TransferFunction two_material_transfer(const Brightness& brightness);

/// A preset by name where it suits a volume: over the bulk of its samples, those with a surface in the middle
/// around the threshold. Throws InputError for a name that is none.
VDVR_API TransferFunction preset_for(const std::string& name, const Brightness& brightness);

/// Iso-surfaces of these densities, from flesh to bone by their rank. Opacities by default 1 of the densest
/// and 0.3 of the others. Throws InputError where there are not as many opacities as densities.
VDVR_API std::vector<IsoSurface> iso_surfaces(const std::vector<double>& densities,
                                              const std::optional<std::vector<double>>& opacities = {});

/// All of it: two materials, an iso-surface at the threshold, the grey window and the middle of the dense
/// part for slices, steps adapted to the picture. The camera sees all that the transfer function shows, at
/// azimuth 30 and elevation 20 degrees (framing.hpp). With a certificate the buffer sampler, for which it
/// holds on every device; whether a device's own may be taken, safe_sampler() knows (safe_sampler.hpp).
/// Everything else as RenderOptions has it. Cost: brightness_of and shown_points.
VDVR_API RenderOptions automatic_view(const MixedVolume& volume,
                                      const std::optional<Certificate>& certificate = {});

/// True for volumes of a cell or two in z, of which only slices across z show anything.
VDVR_API bool is_thin(const Grid& grid);

/// Names the steps between the certified field and the pixels of such a picture that no certificate covers.
VDVR_API std::string outside_certificate(const RenderOptions& options);

}  // namespace vdvr
