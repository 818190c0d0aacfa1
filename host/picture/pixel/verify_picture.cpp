// A picture's certificate held to the volume: drawn and certified again, and compared with what it says.
#include <fmt/format.h>

#include <cmath>

#include "host/picture/pixel/field_on_rays.hpp"
#include "host/picture/pixel/picture_json.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/safe_sampler.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/trust.hpp"
#include "vdvr/verify_file.hpp"

namespace vdvr {
namespace {

// Bounds of two devices differ by what exp2 may, far below this.
constexpr double kSameLevels = 0.05;

/// The picture and its intervals again, of what this device draws.
struct Again {
  CertifiedPicture picture;
  std::pair<float, float> value_range;
  bool same_device = false;
};

/// Whether the intervals are of samples by the texture unit: those of other modes, and of F's light, are made
/// on the host.
bool is_by_image3d(const PictureRecord& record) {
  const RenderOptions& o = record.options;
  return o.mode == RenderMode::dvr && !record.lit && o.sampler == SamplerKind::image3d;
}

void certify_again(const DrawnVolume& volume, const Certificate& here, const Progress& progress,
                   CertifiedPicture& made) {
  const PictureRecord& record = made.record;
  const RenderOptions& o = record.options;
  const MixedVolume& v = volume.volume();
  if (record.lit) {
    made.bounds = certify_lit_pixels(v, brick_bounds(here, false),
                                     certified_part(here.covered.value_or(record.covered), here),
                                     volume.value_range(), o, record.certify, progress);
    return;
  }
  if (o.mode == RenderMode::dvr) {
    made.bounds =
        volume.certify(brick_bounds(here, o.sampler == SamplerKind::image3d), o, record.certify, progress);
    return;
  }
  if (o.mode == RenderMode::slice) {
    made.bounds = certify_slice(v, here, o, progress);
    clear_absent(made.drawn.image, made.bounds);
    return;
  }
  const CertifiedRays rays(v, here, false, box_of(o.clip));
  if (o.mode == RenderMode::iso) {
    made.surface = rays.surface(o.camera, o.width, o.height, o.surfaces.front().value, progress);
    return;
  }
  if (o.mode == RenderMode::integral) {
    made.integrals = rays.integral(o.camera, o.width, o.height, progress);
    made.bounds = greys_of_integrals(made.integrals, o);
    return;
  }
  made.maxima = rays.maximum(o.camera, o.width, o.height, progress);
  made.bounds = colours_of_maxima(made.maxima, o);
}

Again made_again(Device& device, const PictureRecord& record, const VdvrFile& file, const std::string& name,
                 const Progress& progress) {
  require_trusted(device, "verifying a picture");
  DrawnVolume volume({&device}, file.volume, progress);
  const bool image3d = record.options.sampler == SamplerKind::image3d;
  const Certificate here = image3d ? certificate_on(device, file.volume, file.certificate) : file.certificate;
  Again again;
  CertifiedPicture& made = again.picture;
  made.record = record;
  made.record.certify.window = file.certificate.window;
  again.value_range = volume.value_range();
  again.same_device = device.info().name == record.device && device.info().driver == record.driver;
  try {
    static_cast<void>(volume.sampler(record.options.sampler));
    // As certify_picture does: what needs more memory first.
    const bool on_device = record.options.mode == RenderMode::dvr && !record.lit;
    if (on_device) certify_again(volume, here, progress, made);
    made.drawn = volume.draw(record.options, progress);
    throw_if_stopped();
    if (!on_device) certify_again(volume, here, progress, made);
  } catch (const InputError& e) {
    throw FileError(fmt::format("{}: does not describe a picture: {}", name, e.what()));
  } catch (ResourceError& e) {
    if (image3d) e.add_context(name + ": was drawn by a texture unit");
    throw;
  }
  throw_if_stopped();
  made.record.sampler = charged_sampler(here, is_by_image3d(record));
  if (record.options.mode != RenderMode::iso) made.bound = bound_of_picture(made.bounds, made.drawn.image);
  return again;
}

/// Intervals that are as much narrower as two devices may differ.
PixelBounds narrowed(PixelBounds bounds) {
  for (float& x : bounds.lo.values) x += static_cast<float>(kSameLevels / 255);
  for (float& x : bounds.hi.values) x -= static_cast<float>(kSameLevels / 255);
  return bounds;
}

/// What was charged for the sampler, where this device charges the same. Files of earlier versions do not
/// say.
void compare_sampler(const PictureRecord& record, const Again& again, std::vector<std::string>& wrong) {
  const auto &said = record.sampler, &found = again.picture.record.sampler;
  if (!said || (is_by_image3d(record) && !again.same_device)) return;
  const ChargedSampler none{"none", 0, ""};
  const ChargedSampler& charged = found ? *found : none;
  // Slopes are summed in another order, in double precision.
  if (said->sampler != charged.sampler || !(std::abs(said->value - charged.value) <= 0x1p-40 * charged.value))
    wrong.push_back(fmt::format("the term of the sampler is {} of {}, not {} of {}", charged.value,
                                charged.sampler, said->value, said->sampler));
}

/// What the file claims and the intervals do not give.
void compare(const PictureClaims& claims, const CertifiedPicture& again, std::vector<std::string>& wrong) {
  const PictureBound& bound = again.bound;
  if (!(bound.max <= claims.max + kSameLevels && bound.mean <= claims.mean + kSameLevels))
    wrong.push_back(fmt::format("the bound is {:.2f} in the mean and {:.2f} at most, not {:.2f} and {:.2f}",
                                bound.mean, bound.max, claims.mean, claims.max));
  if (claims.certified > bound.pixels - bound.untested)
    wrong.push_back(
        fmt::format("{} pixels are certified, not {}", bound.pixels - bound.untested, claims.certified));
  const PixelBounds narrow = narrowed(again.bounds);
  for (const auto& [levels, stored] : bound.within) {
    const auto claim = claims.within.find(std::to_string(levels));
    if (claim == claims.within.end()) continue;
    const double share = share_within(narrow, again.drawn.image, levels);
    if (!(claim->second <= share + 1e-9))
      wrong.push_back(fmt::format("{:.1f} % of the pixels are certain to {} levels, not {:.1f} %",
                                  100 * share, levels, 100 * claim->second));
  }
}

/// The same of a surface. Shares may differ by two pixels, depths by what double precision does.
void compare_surface(const SurfaceShares& claims, const SurfaceBounds& surface,
                     std::vector<std::string>& wrong) {
  const double two = 2 / static_cast<double>(surface.hit.size());
  const SurfaceShares found = shares_of(surface);
  const auto share = [&](const char* name, double claimed, double has) {
    if (!(claimed <= has + two))
      wrong.push_back(
          fmt::format("{:.2f} % of the pixels are {}, not {:.2f} %", 100 * has, name, 100 * claimed));
  };
  const auto depth = [&](const char* name, double claimed, double has) {
    if (!(claimed >= has * (1 - 1e-6)))
      wrong.push_back(fmt::format("`{}` is {:.6g}, not {:.6g}", name, has, claimed));
  };
  share("sure", claims.sure, found.sure);
  share("none", claims.none, found.none);
  depth("band_mean", claims.band_mean, found.band_mean);
  depth("band_median", claims.band_median, found.band_median);
  depth("band_p99", claims.band_p99, found.band_p99);
}

/// What can be said before the device is asked.
void compare_region(const PictureRecord& record, const Certificate& certificate,
                    std::vector<std::string>& wrong) {
  if (record.options.mode == RenderMode::slice || !certificate.covered) return;
  const CoveredCylinder& covered = *certificate.covered;
  const Clip& clip = *record.options.clip;
  if (record.covered.radius > covered.radius || clip.radius > covered.radius ||
      clip.low[2] < covered.z.first || clip.high[2] > covered.z.second)
    wrong.emplace_back("the picture shows more than the volume says is covered");
}

}  // namespace

PictureVerification verify_picture(Device& device, const VdvrFile& file,
                                   const std::filesystem::path& certificate,
                                   const VerifyPictureOptions& options, const Progress& progress) {
  if (!file.altered.empty()) throw MismatchError("nothing is certain of an altered volume: " + file.altered);
  const auto [record, claims] = read_picture_certificate(certificate);
  if (file.certificate.content_sha256 != record.content_sha256)
    throw MismatchError(fmt::format("{}: is of the volume with content {}, this one has {}",
                                    certificate.string(), record.content_sha256,
                                    file.certificate.content_sha256));
  if (options.scan) check_input(*options.scan, file.certificate);
  PictureVerification v;
  std::vector<std::string>& wrong = v.failures;
  const auto image = certificate.parent_path() / claims.file;
  if (sha256_of_file(image) != claims.file_sha256)
    wrong.push_back(fmt::format("{} is not the picture that was certified", image.string()));
  compare_region(record, file.certificate, wrong);

  const Again again = made_again(device, record, file, certificate.string(), progress);
  v.mode = record.options.mode;
  v.light = again.picture.bounds.light;
  v.bound = again.picture.bound;
  v.surface = again.picture.surface;
  v.same_pixels = sha256_of_pixels(again.picture.drawn.image) == record.pixels_sha256;
  if (!v.same_pixels && again.same_device) wrong.emplace_back("the picture that it describes is another one");
  const bool iso = v.mode == RenderMode::iso;
  const std::string statement = statement_of(v.mode, v.light);
  if (claims.statement != statement || (!iso && claims.light != text_of(v.light)))
    wrong.push_back("what is proved is not what it says, but: " + statement);
  compare_sampler(record, again, wrong);
  if (iso) compare_surface(claims.iso, v.surface, wrong);
  else compare(claims, again.picture, wrong);
  if (options.scan && is_told_by_the_host(record))
    v.rays = check_rays(again.picture, file.volume, again.value_range, *options.scan, file.certificate.field,
                        options.rays, progress);
  if (v.rays && v.rays->outside > 0)
    wrong.push_back(fmt::format("F lies outside of what is certain in {} places", v.rays->outside));
  v.holds = wrong.empty();
  return v;
}

}  // namespace vdvr
