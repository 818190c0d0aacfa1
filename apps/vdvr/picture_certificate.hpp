// X.certificate.json beside a certified picture: what render writes and verify reads again
// (docs/pixel-bounds.md, section 8).
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/vdvr/output.hpp"
#include "vdvr/certified_rays.hpp"
#include "vdvr/certify_picture.hpp"

namespace vdvr::cli {

/// All that a picture and its intervals follow from, beside the volume.
struct CertifiedPicture {
  RenderOptions options;
  CertifyPictureOptions certify;
  bool lit = false;  ///< the light is F's
  CoveredCylinder covered;
  std::string content_sha256, file, pixels_sha256,
      file_sha256;                    ///< of the volume; the picture, its rgb bytes before overlays, its file
  std::string device, driver;         ///< that drew it
  std::string device_test;            ///< what it was tested for when it was opened; it passed
  Json sampler_term;                  ///< charged in the intervals (sampler_term_json)
  std::vector<std::string> overlays;  ///< drawn over it afterwards
};
/// What the file says of the intervals.
struct PictureClaims {
  std::string statement, light;
  double mean = 0, max = 0;              ///< levels
  std::map<std::string, double> within;  ///< shares
  std::int64_t certified = 0;            ///< pixels
  Json iso;                              ///< of surfaces, which have these shares and depths alone
};

/// What is proved, in one sentence. `light` is of mode dvr.
std::string statement_of(RenderMode mode, CertifiedLight light = CertifiedLight::unlit);
/// "dvr", "iso", ...
const char* mode_name(RenderMode mode);
/// What certificates of all modes have.
Json certificate_head(const CertifiedPicture& picture, const Certificate& certificate,
                      const std::string& statement);
/// Shares of the pixels by class, and the band's depth in world units.
Json surface_json(const SurfaceBounds& bounds, const std::string& unit);
/// How well values are known, in their own units, over the rays that have one: not those of NaN, nor those of
/// 0 in `met`, where it is not empty.
Json half_widths_json(const FloatImage& low, const FloatImage& high,
                      const std::vector<std::uint8_t>& met = {});
/// The box that a clip has beside its cylinder.
std::array<double, 6> box_of(const std::optional<Clip>& clip);
Json picture_certificate_json(const CertifiedPicture& picture, const PixelBounds& bounds,
                              const PictureBound& bound, const Certificate& certificate);
/// Throws FileError for what is no certificate of a picture.
std::pair<CertifiedPicture, PictureClaims> read_picture_certificate(const std::filesystem::path& path);

/// The levels and shares that are compared when a picture is verified.
Json bound_json(const PictureBound& bound);
/// "certain: 58 % of the pixels to 4 levels of 255, ..."
std::string bound_line(const PictureBound& bound, const Certificate& certificate, CertifiedLight light);
std::string sha256_of_pixels(const Image& image);

}  // namespace vdvr::cli
