// What `render`, `run` and `bench render` share: opening something to look at, and views that suit what is in
// it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/vdvr/options.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

/// A certified volume with its certificate, or a uniform one without.
struct Scene {
  MixedVolume volume;
  std::optional<Certificate> certificate;
  bool verified = false;  ///< the content's hash was compared with the certificate's
};
/// `method`: "vdvr" the mixed volume, "dvr" its base samples alone (a uniform volume is the same either way).
/// Throws MismatchError for a content that does not match, unless `unverified`.
Scene open_scene(const std::filesystem::path& path, const Arguments& args, const std::string& method,
                 bool unverified);

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
const char* sampler_name(SamplerKind kind);

/// True for volumes of a cell or two in z, of which only slices across z show anything.
bool is_thin(const Grid& grid);

/// What lies between the certified field and the pixels of such a picture: no certificate covers it.
std::string outside_certificate(const RenderOptions& options);

}  // namespace vdvr::cli
