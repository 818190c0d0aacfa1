// A picture of a certified volume with its certificate: drawn, certified, written, and verified again
// (docs/pixel-bounds.md, docs/surfaces.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/certified_rays.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/drawn_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/raycast.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

/// The charge for the sampler in intervals of a picture.
struct ChargedSampler {
  std::string sampler;  ///< "buffer" or "image3d"
  double value = 0;     ///< density units; of the texture unit the largest of a brick
  std::string method;
};
/// Nothing of an image3d that the certificate says nothing of.
VDVR_API std::optional<ChargedSampler> charged_sampler(const Certificate& certificate, bool image3d);

/// The part of a volume that a certificate speaks of: its covered cylinder, cut with its region of interest.
VDVR_API Clip certified_part(const CoveredCylinder& covered, const Certificate& certificate);
/// Cuts `clip` to what also lies in `box`. Throws InputError where nothing is left.
VDVR_API void cut_to(Clip& clip, const Clip& other);

struct PictureRequest {
  /// Modes dvr, iso (one surface), mip, integral and slice, output colour. `clip` is cut with what is
  /// covered. A slice needs `slice_range`; its position is the middle by default.
  RenderOptions options;
  /// For mode dvr. Its window is the certificate's.
  CertifyPictureOptions certify;
  bool lit = false;                 ///< of mode dvr, on one device: under the light of F itself
  bool keep_steps = false;          ///< draw as `options` say: no finer, no other classification or step mode
  std::optional<double> tolerance;  ///< levels that every pixel shall be certain to: drawn finer for it
  /// Counts only where the certificate does not say it (files of earlier versions).
  std::optional<CoveredCylinder> covered;
};

/// All that a picture and its intervals follow from, beside the volume.
struct PictureRecord {
  RenderOptions options;  ///< as drawn
  CertifyPictureOptions certify;
  bool lit = false;
  CoveredCylinder covered;
  std::string content_sha256, pixels_sha256;  ///< of the volume; of the picture's rgb bytes
  std::string device, driver;                 ///< that drew it
  std::string device_test;                    ///< what it was tested for when it was opened; it passed
  std::optional<ChargedSampler> sampler;
};

struct CertifiedPicture {
  PictureRecord record;
  RenderResult drawn;
  PixelBounds bounds;        ///< of all modes but iso
  PictureBound bound;        ///< the same
  SurfaceBounds surface;     ///< of iso
  MaximumBounds maxima;      ///< of mip
  IntegralBounds integrals;  ///< of integral
  double epsilon = 0, epsilon_abs = 0;
  std::string unit;  ///< of length
};

/// Draws and certifies. Unless steps are kept, mode dvr is pre-integrated, and drawn with shorter steps as
/// long as that narrows its bound much. `here`: the certificate as it holds on the devices
/// (safe_sampler.hpp). Throws InputError for a picture that cannot be certified (a comparison, a window that
/// the transfer function shows beyond, a part that is not covered, light that has no differences). Throws
/// InputError also where render() and certify_pixels() do; DeviceError for a device that failed its test;
/// Interrupted. Cost: one to six pictures, and certify_pixels() or CertifiedRays.
VDVR_API CertifiedPicture certify_picture(DrawnVolume& volume, const Certificate& here,
                                          const PictureRequest& request, const Progress& progress = {});
/// The same of a file, on one device, by the sampler for which its certificate holds there. Throws
/// MismatchError too, for a file that was altered.
VDVR_API CertifiedPicture certify_picture(Device& device, const VdvrFile& file, const PictureRequest& request,
                                          const Progress& progress = {});

/// The content of the picture's file, where that is not the picture itself.
struct PictureFile {
  std::function<void(const std::filesystem::path&)>
      write;                            ///< none: the picture, as PNG; of iso with stripes
  std::vector<std::string> overlays;    ///< drawn over it
  std::optional<double> band_at_white;  ///< of a picture of a surface's band
};
/// X.certificate.json and, of all modes but iso, X.bound.png beside X.png.
VDVR_API std::vector<std::filesystem::path> beside_picture(const std::filesystem::path& picture,
                                                           RenderMode mode);
/// Writes the picture and what lies beside it: all appear, or none. Returns the certificate's JSON. Throws
/// InputError for another name than X.png where `file` writes nothing itself; FileError, ResourceError
/// (disk), Interrupted.
VDVR_API std::string write_certified_picture(const std::filesystem::path& path,
                                             const CertifiedPicture& picture, const PictureFile& file = {});
/// "certain: 58 % of the pixels to 4 levels of 255, ..."
VDVR_API std::string bound_line(const PictureBound& bound, double epsilon, CertifiedLight light);
/// JSON: the levels and shares that are compared when a picture is verified.
VDVR_API std::string bound_json(const PictureBound& bound);
/// JSON: of the pixels how many show the surface for sure, may, do not; and the band's depth.
VDVR_API std::string surface_json(const SurfaceBounds& bounds, const std::string& unit);

/// F itself along random rays of a picture.
struct RayCheck {
  std::int64_t rays = 0, outside = 0;  ///< outside: F leaves what is certain
  double worst = 0;                    ///< of the share of half an interval that F takes
};
struct PictureVerification {
  bool holds = false;
  std::vector<std::string> failures;  ///< one line each
  bool same_pixels = false;           ///< another device may draw others; the bound is then of those
  RenderMode mode = RenderMode::dvr;
  CertifiedLight light = CertifiedLight::unlit;
  PictureBound bound;     ///< of all modes but iso
  SurfaceBounds surface;  ///< of iso
  std::optional<RayCheck>
      rays;  ///< nothing without a scan, and where the host cannot tell the light that was drawn
};
struct VerifyPictureOptions {
  const ProjectionSet* scan = nullptr;  ///< of the volume (check_input): F along rays is evaluated
  std::int64_t rays = 16;
};
/// Draws and certifies again what X.certificate.json describes, and compares: the file beside it, the pixels,
/// the statement, every number. Throws FileError for a file that is no certificate of a picture,
/// MismatchError for one of another volume and for a volume that was altered. Throws ResourceError where the
/// device cannot draw it; DeviceError, Interrupted.
VDVR_API PictureVerification verify_picture(Device& device, const VdvrFile& file,
                                            const std::filesystem::path& certificate,
                                            const VerifyPictureOptions& options = {},
                                            const Progress& progress = {});

}  // namespace vdvr
