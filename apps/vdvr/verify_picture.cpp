#include "apps/vdvr/verify_picture.hpp"

#include <fmt/format.h>

#include <optional>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

std::string line_of(const PictureVerification& v, double epsilon) {
  if (v.mode != RenderMode::iso) return bound_line(v.bound, epsilon, v.light);
  return fmt::format("{:.1f} % of the pixels show the surface for sure, {:.1f} % may, {:.1f} % do not",
                     100 * v.surface.share(2), 100 * v.surface.share(1), 100 * v.surface.share(0));
}

Json verification_json(const PictureVerification& v, const std::filesystem::path& certificate,
                       const std::filesystem::path& file, const std::string& unit) {
  Json json = {{"picture", certificate.string()},
               {"file", file.string()},
               {"holds", v.holds},
               {"same_pixels", v.same_pixels},
               {"failures", v.failures}};
  if (v.mode == RenderMode::iso) json["iso"] = Json::parse(surface_json(v.surface, unit));
  else json.update(Json::parse(bound_json(v.bound)));
  if (v.rays)
    json["rays"] = {{"count", v.rays->rays}, {"outside", v.rays->outside}, {"worst_share", v.rays->worst}};
  return json;
}

void print_rays(const PictureVerification& v) {
  fmt::print("  F along {} random rays: {} times outside{}\n", v.rays->rays, v.rays->outside,
             v.mode == RenderMode::iso
                 ? ""
                 : fmt::format("; it takes at most {:.0f} % of half an interval", 100 * v.rays->worst));
}

}  // namespace

int verify_picture_command(const Arguments& args, const CommonOptions& common) {
  const auto path = args.path("FILE"), certificate = args.path("picture");
  VerifyPictureOptions options;
  options.rays = args.integer_or("rays", options.rays, 1, 1'000'000);
  ProgressLine progress(args.who(), common.quiet);
  const VdvrFile file = open_certified(path, args);
  std::optional<ProjectionSet> scan;
  if (args.has("projections")) {
    const auto projections = args.path("projections");
    scan = load_certified_scan(projections, args, file.certificate, progress.callback());
    check_projections(projections, *scan, file.certificate);
    options.scan = &*scan;
  }
  Device device = open_device(common);
  const PictureVerification v = verify_picture(device, file, certificate, options, progress.callback());
  progress.clear();
  print_result(common, verification_json(v, certificate, path, file.volume.grid.unit), [&] {
    fmt::print("{}: {}\n  {}\n", certificate.string(), v.holds ? "holds" : "DOES NOT HOLD",
               line_of(v, file.certificate.epsilon));
    if (!v.same_pixels) fmt::print("  this device draws other pixels; the bound is of what it draws\n");
    if (v.rays) print_rays(v);
    else if (scan)
      fmt::print(
          "  F was not evaluated: light as drawn is compared with the buffer sampler and --gradient "
          "central\n");
  });
  if (!v.holds) throw MismatchError(fmt::format("{}: {}", certificate.string(), v.failures.front()));
  return 0;
}

}  // namespace vdvr::cli
