// X.certificate.json beside a certified picture: what render writes and verify reads again
// (docs/pixel-bounds.md, section 8).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/vdvr/output.hpp"
#include "vdvr/certify_picture.hpp"

namespace vdvr::cli {

/// All that a picture and its intervals follow from, beside the volume.
struct CertifiedPicture {
  RenderOptions options;
  CertifyPictureOptions certify;
  CoveredCylinder covered;
  std::string content_sha256, file, pixels_sha256,
      file_sha256;                    ///< of the volume; the picture, its rgb bytes before overlays, its file
  std::string device, driver;         ///< that drew it
  std::vector<std::string> overlays;  ///< drawn over it afterwards
};
/// What the file says of the intervals.
struct PictureClaims {
  std::string statement, light;
  double mean = 0, max = 0;              ///< levels
  std::map<std::string, double> within;  ///< shares
  std::int64_t certified = 0;            ///< pixels
};

/// What is proved, in one sentence.
std::string statement_of(const PixelBounds& bounds);
Json picture_certificate_json(const CertifiedPicture& picture, const PixelBounds& bounds,
                              const PictureBound& bound, const Certificate& certificate);
/// Throws FileError for what is no certificate of a picture.
std::pair<CertifiedPicture, PictureClaims> read_picture_certificate(const std::filesystem::path& path);

/// The levels and shares that are compared when a picture is verified.
Json bound_json(const PictureBound& bound);
/// "certain: 58 % of the pixels to 4 levels of 255, ..."
std::string bound_line(const PictureBound& bound, const Certificate& certificate);
std::string sha256_of_pixels(const Image& image);

}  // namespace vdvr::cli
