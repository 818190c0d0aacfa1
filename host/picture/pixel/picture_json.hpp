// X.certificate.json beside a certified picture: what is written with it and what verify reads again
// (docs/pixel-bounds.md, section 8).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "vdvr/certified_picture.hpp"

namespace vdvr {

/// How many of a surface's pixels are of which kind, and how deep its band is, world units.
struct SurfaceShares {
  double sure = 0, possible = 0, none = 0;
  double band_mean = 0, band_median = 0, band_p99 = 0;
};
SurfaceShares shares_of(const SurfaceBounds& bounds);

/// What the file says beside the picture's record.
struct PictureClaims {
  std::string file, file_sha256;  ///< beside it
  std::string statement, light;
  double mean = 0, max = 0;              ///< levels
  std::map<std::string, double> within;  ///< shares
  std::int64_t certified = 0;            ///< pixels
  SurfaceShares iso;                     ///< of surfaces, which have these alone
};

/// What is proved, in one sentence. `light` is of mode dvr.
std::string statement_of(RenderMode mode, CertifiedLight light = CertifiedLight::unlit);
/// The box that a clip has beside its cylinder.
std::array<double, 6> box_of(const std::optional<Clip>& clip);
std::string sha256_of_pixels(const Image& image);

/// `name` and `sha256` are of the file that `file` describes.
std::string picture_certificate_json(const CertifiedPicture& picture, const std::string& name,
                                     const std::string& sha256, const PictureFile& file);
/// Throws FileError for what is no certificate of a picture.
std::pair<PictureRecord, PictureClaims> read_picture_certificate(const std::filesystem::path& path);

}  // namespace vdvr
