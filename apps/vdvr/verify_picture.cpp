#include "apps/vdvr/verify_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "apps/common/progress.hpp"
#include "apps/vdvr/clip.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/picture_certificate.hpp"
#include "apps/vdvr/sampler_json.hpp"
#include "vdvr/error.hpp"
#include "vdvr/exact_field.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/paged_volume.hpp"
#include "vdvr/render_crew.hpp"
#include "vdvr/safe_sampler.hpp"
#include "vdvr/stop.hpp"
#include "vdvr/trust.hpp"

namespace vdvr::cli {
namespace {

// Bounds of two devices differ by what exp2 may, far below this.
constexpr double kSameLevels = 0.05;
constexpr double kRayStep = 0.125;  // base cells

/// What was found along random rays.
struct RayCheck {
  std::int64_t rays = 0, outside = 0;
  double worst = 0;  ///< of the share of half the interval, from its middle, that F takes
};
using Field = std::function<std::vector<double>(const std::vector<Vec3>&)>;

/// A volume on the device, whole where there is room for it, else by bricks.
class Shown {
 public:
  Shown(Device& device, const VdvrFile& file, const RenderOptions& o, const std::string& name)
      : device_(device),
        certificate_(o.sampler == SamplerKind::image3d ? certificate_on(device, file.volume, file.certificate)
                                                       : file.certificate) {
    if (file.volume.tiles.empty() || fits(device, file.volume)) {
      whole_.emplace(device, file.volume);
      if (o.sampler == SamplerKind::image3d && !whole_->has_image3d())
        throw ResourceError(fmt::format("{}: was drawn with the image3d sampler, which '{}' has not: {}",
                                        name, device.info().name, whole_->image3d_reason()));
      return;
    }
    if (o.sampler == SamplerKind::image3d)
      throw ResourceError(fmt::format(
          "{}: was drawn with the image3d sampler, which needs the whole volume on the device: raise "
          "--max-memory",
          name));
    by_bricks_.emplace(device, file.volume);
  }

  [[nodiscard]] RenderResult draw(const RenderOptions& o, const Progress& progress) const {
    if (whole_) return raycast(device_, *whole_, o);
    return RenderCrew({{&device_, nullptr, &*by_bricks_}}).render(o, progress);
  }
  [[nodiscard]] PixelBounds certify(const RenderOptions& o, const CertifyPictureOptions& certify,
                                    const Progress& progress) const {
    const auto bounds = brick_bounds(certificate_, o.sampler == SamplerKind::image3d);
    return whole_ ? certify_pixels(device_, *whole_, bounds, o, certify, progress)
                  : certify_pixels(device_, *by_bricks_, bounds, o, certify, progress);
  }
  [[nodiscard]] const Certificate& certificate() const { return certificate_; }
  [[nodiscard]] std::pair<float, float> value_range() const {
    return whole_ ? whole_->value_range() : by_bricks_->value_range();
  }

 private:
  Device& device_;
  Certificate certificate_;              ///< as it holds on the device
  std::optional<ResidentVolume> whole_;  ///< or
  std::optional<PagedVolume> by_bricks_;
};

/// The intervals again, of what this device draws.
struct Again {
  RenderResult drawn;
  PixelBounds bounds;        ///< of all but iso
  MaximumBounds maxima;      ///< of mip
  IntegralBounds integrals;  ///< of integral
  SurfaceBounds surface;     ///< of iso
  const MixedVolume* volume = nullptr;
  std::pair<float, float> value_range;
  Json sampler_term;  ///< as this device charges it
  bool same_device = false;
};
/// Whether the intervals are of samples by the texture unit: those of other modes, and of F's light, are made
/// on the host.
bool is_by_image3d(const CertifiedPicture& picture) {
  const RenderOptions& o = picture.options;
  return o.mode == RenderMode::dvr && !picture.lit && o.sampler == SamplerKind::image3d;
}

void certify_again(const Shown& shown, const CertifiedPicture& picture, const VdvrFile& file,
                   const Progress& progress, Again& again) {
  const RenderOptions& o = picture.options;
  again.volume = &file.volume;
  again.value_range = shown.value_range();
  if (picture.lit) {
    again.bounds =
        certify_lit_pixels(file.volume, brick_bounds(file.certificate, false),
                           known_clip(file.certificate.covered.value_or(picture.covered), file.certificate),
                           again.value_range, o, picture.certify, progress);
    return;
  }
  if (o.mode == RenderMode::dvr) {
    again.bounds = shown.certify(o, picture.certify, progress);
    return;
  }
  if (o.mode == RenderMode::slice) {
    again.bounds = certify_slice(file.volume, file.certificate, o, progress);
    clear_absent(again.drawn.image, again.bounds);
    return;
  }
  const CertifiedRays rays(file.volume, file.certificate, false, box_of(o.clip));
  if (o.mode == RenderMode::iso) {
    again.surface = rays.surface(o.camera, o.width, o.height, o.surfaces.front().value, progress);
    return;
  }
  if (o.mode == RenderMode::integral) {
    again.integrals = rays.integral(o.camera, o.width, o.height, progress);
    again.bounds = greys_of_integrals(again.integrals, o);
    return;
  }
  again.maxima = rays.maximum(o.camera, o.width, o.height, progress);
  again.bounds = colours_of_maxima(again.maxima, o);
}

Again made_again(const CommonOptions& common, const CertifiedPicture& picture, const VdvrFile& file,
                 const std::string& name, const Progress& progress) {
  Device device = open_device(common);
  require_trusted(device, "verifying a picture");
  const Shown shown(device, file, picture.options, name);
  Again again;
  again.same_device = device.info().name == picture.device && device.info().driver == picture.driver;
  again.sampler_term = sampler_term_json(shown.certificate(), is_by_image3d(picture));
  try {
    // As render does: what needs more memory first.
    const bool on_device = picture.options.mode == RenderMode::dvr && !picture.lit;
    if (on_device) certify_again(shown, picture, file, progress, again);
    again.drawn = shown.draw(picture.options, progress);
    throw_if_stopped();
    if (!on_device) certify_again(shown, picture, file, progress, again);
  } catch (const InputError& e) {
    throw FileError(fmt::format("{}: does not describe a picture: {}", name, e.what()));
  }
  throw_if_stopped();
  return again;
}

// --- F along random rays ---

void take(RayCheck& check, double value, double low, double high) {
  const double share = high > low ? std::abs(2 * value - high - low) / (high - low) : value == low ? 0 : 2;
  check.worst = std::max(check.worst, share);
  if (!(share <= 1)) ++check.outside;
}

/// A pixel by chance, and what F there is held to.
struct RandomPixel {
  const Field& field;
  const CertifiedPicture& picture;
  const Again& again;
  std::size_t number;  ///< in rows
  [[nodiscard]] const RenderOptions& options() const { return picture.options; }
  [[nodiscard]] const Grid& grid() const { return again.volume->grid; }
  [[nodiscard]] std::int64_t x() const { return static_cast<std::int64_t>(number) % options().width; }
  [[nodiscard]] std::int64_t y() const { return static_cast<std::int64_t>(number) / options().width; }
  [[nodiscard]] RaySteps ray() const { return steps_of_pixel(options(), grid(), x(), y(), kRayStep); }
};

/// F's own pixel, under whatever light the picture is of.
IdealPixel ideal_of(const RandomPixel& p) {
  const RenderOptions& o = p.options();
  const auto range = p.again.value_range;
  if (p.picture.lit) return ideal_lit_pixel(p.field, range, o, p.grid(), p.x(), p.y(), kRayStep);
  if (o.shading) return ideal_drawn_pixel(p.field, *p.again.volume, range, o, p.x(), p.y(), kRayStep);
  return ideal_pixel(p.field, o, p.grid(), p.x(), p.y(), kRayStep);
}

/// Of the light that was drawn the host knows that of central differences by the buffer sampler.
bool evaluates_f(const CertifiedPicture& picture) {
  const RenderOptions& o = picture.options;
  return o.mode != RenderMode::dvr || !o.shading || picture.lit ||
         (o.gradient == GradientKind::central && o.sampler == SamplerKind::buffer);
}

void check_colours(const RandomPixel& p, RayCheck& check) {
  const IdealPixel ideal = ideal_of(p);
  const double reach = ideal.quadrature + ideal.light + 0x1p-12;
  for (std::size_t c = 0; c < 3; ++c)
    take(check, ideal.rgb[c], static_cast<double>(p.again.bounds.lo.values[3 * p.number + c]) - reach,
         static_cast<double>(p.again.bounds.hi.values[3 * p.number + c]) + reach);
}

void check_grey(const RandomPixel& p, RayCheck& check) {
  if (p.again.bounds.parts[p.number] == 0) return;  // absent
  const auto [low, high] = p.options().slice_range.value();
  const double value = p.field({slice_point(p.options(), p.grid(), p.x(), p.y())}).front(),
               grey = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
  take(check, grey, static_cast<double>(p.again.bounds.lo.values[3 * p.number]) - 0x1p-23,
       static_cast<double>(p.again.bounds.hi.values[3 * p.number]) + 0x1p-23);
}

/// What a value between two of a row's may rise above both, as second differences tell: an estimate.
double rise(const std::vector<double>& values) {
  double most = 0;
  for (std::size_t i = 1; i + 1 < values.size(); ++i)
    most = std::max(most, std::abs(values[i - 1] - 2 * values[i] + values[i + 1]));
  return most;
}

void check_maximum(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty() || std::isnan(p.again.maxima.low.values[p.number])) return;
  // Both ends too: the largest value may lie where the region does.
  std::vector<Vec3> points{steps.at(steps.first)};
  for (const Vec3& point : steps.points) points.push_back(point);
  points.push_back(steps.at(steps.last));
  const std::vector<double> values = p.field(points);
  take(check, *std::max_element(values.begin(), values.end()),
       static_cast<double>(p.again.maxima.low.values[p.number]) - rise(values),
       static_cast<double>(p.again.maxima.high.values[p.number]));
}

/// By midpoints; what steps three times as long are off is an estimate of what these are.
void check_integral(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty()) return;
  const std::vector<double> values = p.field(steps.points);
  double fine = 0, coarse = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    fine += values[k] * steps.length;
    if (k % 3 == 1) coarse += values[k] * 3 * steps.length;
  }
  take(check, fine, static_cast<double>(p.again.integrals.low.values[p.number]) - std::abs(fine - coarse),
       static_cast<double>(p.again.integrals.high.values[p.number]) + std::abs(fine - coarse));
}

/// Whether F comes to the value before `last`, where it is surely on one side, or as near to it from there as
/// it moves between two places.
bool meets(const Field& field, const RaySteps& steps, const std::vector<double>& values, double last,
           double value, double moves) {
  const double end = field({steps.at(last)}).front(), side = end < value ? 1 : -1;
  double other = side * (end - value);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (steps.first + (static_cast<double>(k) + 0.5) * steps.length < last)
      other = std::max(other, side * (values[k] - value));
  return other >= -moves;
}

void check_crossing(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty()) return;
  const int hit = p.again.surface.hit[p.number];
  const double value = p.options().surfaces.front().value,
               first = hit == 0 ? steps.last : static_cast<double>(p.again.surface.first.values[p.number]);
  const std::vector<double> values = p.field(steps.points);
  // The most that F moves from one place to the next, as neighbours show.
  double moves = 0;
  for (std::size_t k = 1; k < values.size(); ++k)
    moves = std::max(moves, std::abs(values[k] - values[k - 1]));
  if (!(first > steps.first)) {  // the side is unknown on which F begins
    if (hit == 2 && !meets(p.field, steps, values, static_cast<double>(p.again.surface.last.values[p.number]),
                           value, moves))
      ++check.outside;
    return;
  }
  const double side = values.front() < value ? 1 : -1;
  bool early = false;
  for (std::size_t k = 0; k < values.size(); ++k)
    early |= steps.first + (static_cast<double>(k) + 0.5) * steps.length < first &&
             !(side * (values[k] - value) < 0);
  bool reached = hit != 2;
  if (hit == 2) {
    const double last = static_cast<double>(p.again.surface.last.values[p.number]);
    // The end of the band is rounded to float32: four units of it.
    reached =
        side * (p.field({steps.at(last)}).front() - value) >= -4 * 0x1p-23 * last * moves / steps.length;
  }
  if (early || !reached) ++check.outside;
}

/// Of random rays half go where the picture is not just the background.
RayCheck check_rays(const Arguments& args, const CertifiedPicture& picture, const VdvrFile& file,
                    const Again& again, const Progress& progress) {
  const auto path = args.path("projections");
  const ProjectionSet scan = load_certified_scan(path, args, file.certificate, progress);
  check_projections(path, scan, file.certificate);
  const ExactField exact(scan, file.certificate.field, progress);
  const Field field = [&](const std::vector<Vec3>& points) { return exact.at(points); };
  const RenderMode mode = picture.options.mode;
  const auto pixels = static_cast<std::size_t>(picture.options.width * picture.options.height);
  std::vector<std::size_t> crossing;
  for (std::size_t i = 0; i < pixels; ++i)
    if (mode == RenderMode::iso ? again.surface.hit[i] > 0 : again.bounds.parts[i] > 0) crossing.push_back(i);
  std::mt19937_64 random(2024);
  RayCheck check;
  const std::int64_t wanted = args.integer_or("rays", 16, 1, 1'000'000);
  for (; check.rays < wanted; ++check.rays) {
    throw_if_stopped();
    report(progress, "rays", static_cast<double>(check.rays) / static_cast<double>(wanted));
    const bool any = crossing.empty() || check.rays % 2 == 1;
    const std::size_t i = any ? random() % pixels : crossing[random() % crossing.size()];
    const auto one = mode == RenderMode::iso        ? check_crossing
                     : mode == RenderMode::mip      ? check_maximum
                     : mode == RenderMode::integral ? check_integral
                     : mode == RenderMode::slice    ? check_grey
                                                    : check_colours;
    one({field, picture, again, i}, check);
  }
  return check;
}

// --- what the file claims ---

/// Intervals that are as much narrower as two devices may differ.
PixelBounds narrowed(PixelBounds bounds) {
  for (float& x : bounds.lo.values) x += static_cast<float>(kSameLevels / 255);
  for (float& x : bounds.hi.values) x -= static_cast<float>(kSameLevels / 255);
  return bounds;
}

/// What was charged for the sampler, where this device charges the same. Files of earlier versions do not
/// say.
void compare_sampler(const CertifiedPicture& picture, const Again& again, std::vector<std::string>& wrong) {
  const Json &said = picture.sampler_term, &found = again.sampler_term;
  if (said.is_null() || (is_by_image3d(picture) && !again.same_device)) return;
  const double value = said.at("value").get<double>(), term = found.at("value").get<double>();
  // Slopes are summed in another order, in double precision.
  if (said.at("sampler") != found.at("sampler") || !(std::abs(value - term) <= 0x1p-40 * term))
    wrong.push_back(fmt::format("the term of the sampler is {} of {}, not {} of {}", term,
                                found.at("sampler").get<std::string>(), value,
                                said.at("sampler").get<std::string>()));
}

/// What the file claims and the intervals do not give.
void compare(const PictureClaims& claims, const PictureBound& bound, const Again& again,
             std::vector<std::string>& wrong) {
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
void compare_surface(const Json& claims, const SurfaceBounds& surface, std::vector<std::string>& wrong) {
  const double two = 2 / static_cast<double>(surface.hit.size());
  const Json found = surface_json(surface, "");
  for (const char* name : {"sure", "none"})
    if (!(claims.at(name).get<double>() <= found.at(name).get<double>() + two))
      wrong.push_back(fmt::format("{:.2f} % of the pixels are {}, not {:.2f} %",
                                  100 * found.at(name).get<double>(), name,
                                  100 * claims.at(name).get<double>()));
  for (const char* name : {"band_mean", "band_median", "band_p99"})
    if (!(claims.at(name).get<double>() >= found.at(name).get<double>() * (1 - 1e-6)))
      wrong.push_back(fmt::format("`{}` is {:.6g}, not {:.6g}", name, found.at(name).get<double>(),
                                  claims.at(name).get<double>()));
}

std::string line_of(const Again& again, const PictureBound& bound, const VdvrFile& file, RenderMode mode) {
  if (mode != RenderMode::iso) return bound_line(bound, file.certificate, again.bounds.light);
  return fmt::format("{:.1f} % of the pixels show the surface for sure, {:.1f} % may, {:.1f} % do not",
                     100 * again.surface.share(2), 100 * again.surface.share(1),
                     100 * again.surface.share(0));
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
  if (picture.options.mode != RenderMode::slice && file.certificate.covered &&
      (picture.covered.radius > file.certificate.covered->radius ||
       picture.options.clip->radius > file.certificate.covered->radius ||
       picture.options.clip->low[2] < file.certificate.covered->z.first ||
       picture.options.clip->high[2] > file.certificate.covered->z.second))
    wrong.emplace_back("the picture shows more than the volume says is covered");

  picture.certify.window = file.certificate.window;
  const Again again = made_again(common, picture, file, certificate_path.string(), progress.callback());
  const RenderMode mode = picture.options.mode;
  const bool iso = mode == RenderMode::iso;
  const PictureBound bound = iso ? PictureBound{} : bound_of_picture(again.bounds, again.drawn.image);
  const bool same_pixels = sha256_of_pixels(again.drawn.image) == picture.pixels_sha256;
  if (!same_pixels && again.same_device) wrong.emplace_back("the picture that it describes is another one");
  if (claims.statement != statement_of(mode, again.bounds.light) ||
      (!iso && claims.light != text_of(again.bounds.light)))
    wrong.push_back(
        fmt::format("what is proved is not what it says, but: {}", statement_of(mode, again.bounds.light)));
  compare_sampler(picture, again, wrong);
  if (iso) compare_surface(claims.iso, again.surface, wrong);
  else compare(claims, bound, again, wrong);
  std::optional<RayCheck> rays;
  if (args.has("projections") && evaluates_f(picture))
    rays = check_rays(args, picture, file, again, progress.callback());
  if (rays && rays->outside > 0)
    wrong.push_back(fmt::format("F lies outside of what is certain in {} places", rays->outside));
  progress.clear();

  Json json = {{"picture", certificate_path.string()},
               {"file", path.string()},
               {"holds", wrong.empty()},
               {"same_pixels", same_pixels},
               {"failures", wrong}};
  if (iso) json["iso"] = surface_json(again.surface, file.volume.grid.unit);
  else json.update(bound_json(bound));
  if (rays) json["rays"] = {{"count", rays->rays}, {"outside", rays->outside}, {"worst_share", rays->worst}};
  print_result(common, json, [&] {
    fmt::print("{}: {}\n  {}\n", certificate_path.string(), wrong.empty() ? "holds" : "DOES NOT HOLD",
               line_of(again, bound, file, mode));
    if (!same_pixels) fmt::print("  this device draws other pixels; the bound is of what it draws\n");
    if (rays)
      fmt::print(
          "  F along {} random rays: {} times outside{}\n", rays->rays, rays->outside,
          iso ? "" : fmt::format("; it takes at most {:.0f} % of half an interval", 100 * rays->worst));
    else if (args.has("projections"))
      fmt::print(
          "  F was not evaluated: light as drawn is compared with the buffer sampler and --gradient "
          "central\n");
  });
  if (!wrong.empty()) throw MismatchError(fmt::format("{}: {}", certificate_path.string(), wrong.front()));
  return 0;
}

}  // namespace vdvr::cli
