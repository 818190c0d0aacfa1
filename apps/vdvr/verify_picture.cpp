#include "apps/vdvr/verify_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/picture_certificate.hpp"
#include "vdvr/error.hpp"
#include "vdvr/exact_field.hpp"
#include "vdvr/hash.hpp"

namespace vdvr::cli {
namespace {

// Bounds of two devices differ by what exp2 may, far below this.
constexpr double kSameLevels = 0.05;
constexpr double kRayStep = 0.125;  // base cells

struct RayCheck {
  std::int64_t rays = 0, outside = 0;
  double worst = 0;  ///< of the share of half the interval, from its middle, that F takes
};

/// F along random rays, of which half go where the interval is not just the background.
RayCheck check_rays(const Arguments& args, const CertifiedPicture& picture, const VdvrFile& file,
                    const PixelBounds& bounds, const Progress& progress) {
  const auto path = args.path("projections");
  const ProjectionSet scan = load_certified_scan(path, args, file.certificate, progress);
  check_projections(path, scan, file.certificate);
  const ExactField exact(scan, file.certificate.field, progress);
  const auto field = [&](const std::vector<Vec3>& points) { return exact.at(points); };
  std::vector<std::size_t> crossing;
  for (std::size_t i = 0; i < bounds.parts.size(); ++i)
    if (bounds.parts[i] > 0) crossing.push_back(i);
  std::mt19937_64 random(2024);
  RayCheck check;
  const std::int64_t wanted = args.integer_or("rays", 16, 1, 1'000'000);
  for (; check.rays < wanted; ++check.rays) {
    report(progress, "rays", static_cast<double>(check.rays) / static_cast<double>(wanted));
    const bool any = crossing.empty() || check.rays % 2 == 1;
    const std::size_t i = any ? random() % bounds.parts.size() : crossing[random() % crossing.size()];
    const auto at = static_cast<std::int64_t>(i);
    const IdealPixel ideal = ideal_pixel(field, picture.options, file.volume.grid, at % picture.options.width,
                                         at / picture.options.width, kRayStep);
    for (std::size_t c = 0; c < 3; ++c) {
      const double lo = static_cast<double>(bounds.lo.values[3 * i + c]) - ideal.quadrature - 0x1p-12,
                   hi = static_cast<double>(bounds.hi.values[3 * i + c]) + ideal.quadrature + 0x1p-12;
      const double share = std::abs(2 * ideal.rgb[c] - hi - lo) / (hi - lo);
      check.worst = std::max(check.worst, share);
      if (share > 1) ++check.outside;
    }
  }
  return check;
}

/// The intervals again, of what this device draws.
struct Again {
  RenderResult drawn;
  PixelBounds bounds;
  bool same_device = false;
};
Again made_again(const CommonOptions& common, const CertifiedPicture& picture, const VdvrFile& file,
                 const std::string& name, const Progress& progress) {
  Device device = open_device(common);
  const ResidentVolume resident(device, file.volume);
  const bool image3d = picture.options.sampler == SamplerKind::image3d;
  const bool same = device.info().name == picture.device && device.info().driver == picture.driver;
  try {
    return {raycast(device, resident, picture.options),
            certify_pixels(device, resident, brick_bounds(file.certificate, image3d), picture.options,
                           picture.certify, progress),
            same};
  } catch (const InputError& e) {
    throw FileError(fmt::format("{}: does not describe a picture: {}", name, e.what()));
  }
}

/// Intervals that are as much narrower as two devices may differ.
PixelBounds narrowed(PixelBounds bounds) {
  for (float& x : bounds.lo.values) x += static_cast<float>(kSameLevels / 255);
  for (float& x : bounds.hi.values) x -= static_cast<float>(kSameLevels / 255);
  return bounds;
}

/// What the file claims and the intervals do not give.
void compare(const PictureClaims& claims, const PictureBound& bound, const Again& again,
             std::vector<std::string>& wrong) {
  if (claims.light != text_of(again.bounds.light) || claims.statement != statement_of(again.bounds))
    wrong.push_back(
        fmt::format("what is proved is not what it says: of light '{}'", text_of(again.bounds.light)));
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

}  // namespace

int verify_picture(const Arguments& args, const CommonOptions& common) {
  const auto path = args.path("FILE"), certificate_path = args.path("picture");
  auto [picture, claims] = read_picture_certificate(certificate_path);
  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = open_certified(path, args);
  std::vector<std::string> wrong;
  if (file.certificate.content_sha256 != picture.content_sha256)
    throw MismatchError(fmt::format("{}: is of the volume with content {}, {} has {}",
                                    certificate_path.string(), picture.content_sha256, path.string(),
                                    file.certificate.content_sha256));
  const auto image_path = certificate_path.parent_path() / picture.file;
  if (sha256_of_file(image_path) != picture.file_sha256)
    wrong.push_back(fmt::format("{} is not the picture that was certified", image_path.string()));
  if (file.certificate.covered && (picture.covered.radius > file.certificate.covered->radius ||
                                   picture.options.clip->radius > file.certificate.covered->radius ||
                                   picture.options.clip->low[2] < file.certificate.covered->z.first ||
                                   picture.options.clip->high[2] > file.certificate.covered->z.second))
    wrong.emplace_back("the picture shows more than the volume says is covered");

  picture.certify.window = file.certificate.window;
  const Again again = made_again(common, picture, file, certificate_path.string(), progress.callback());
  const PixelBounds& bounds = again.bounds;
  const PictureBound bound = bound_of_picture(bounds, again.drawn.image);
  const bool same_pixels = sha256_of_pixels(again.drawn.image) == picture.pixels_sha256;
  if (!same_pixels && again.same_device) wrong.emplace_back("the picture that it describes is another one");
  compare(claims, bound, again, wrong);
  std::optional<RayCheck> rays;
  if (args.has("projections") && !picture.options.shading)
    rays = check_rays(args, picture, file, bounds, progress.callback());
  if (rays && rays->outside > 0)
    wrong.push_back(fmt::format("F shows a colour outside the interval in {} channels", rays->outside));
  progress.clear();

  Json json = {{"picture", certificate_path.string()},
               {"file", path.string()},
               {"holds", wrong.empty()},
               {"same_pixels", same_pixels},
               {"failures", wrong}};
  json.update(bound_json(bound));
  if (rays) json["rays"] = {{"count", rays->rays}, {"outside", rays->outside}, {"worst_share", rays->worst}};
  print_result(common, json, [&] {
    fmt::print("{}: {}\n  {}\n", certificate_path.string(), wrong.empty() ? "holds" : "DOES NOT HOLD",
               bound_line(bound, file.certificate));
    if (!same_pixels) fmt::print("  this device draws other pixels; the bound is of what it draws\n");
    if (rays)
      fmt::print(
          "  F along {} random rays: {} channels outside; it takes at most {:.0f} % of half an interval\n",
          rays->rays, rays->outside, 100 * rays->worst);
    else if (args.has("projections"))
      fmt::print("  F was not evaluated: the picture has light, which no field of F alone gives\n");
  });
  if (!wrong.empty()) throw MismatchError(fmt::format("{}: {}", certificate_path.string(), wrong.front()));
  return 0;
}

}  // namespace vdvr::cli
