#include "apps/vdvr/clip.hpp"

#include <fmt/format.h>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"

namespace vdvr::cli {
namespace {

Clip covered_clip(const Arguments& args, const Scene& scene, const Progress& progress) {
  const std::string name = args.path("FILE").string();
  if (!scene.certificate)
    throw InputError(fmt::format("{}: has no certificate, so nothing in it is covered", name));
  const auto named = covered_of(args, scene, progress);
  const auto& covered = named ? named : scene.certificate->covered;
  if (!covered)
    throw InputError(fmt::format(
        "{}: does not say where it is covered: what a single row covers has no height, and earlier "
        "versions did not say; of the latter name the scan by --covered-from, or build it again",
        name));
  return certified_part(*covered, *scene.certificate);
}

}  // namespace

void add_clip(Arguments& args) {
  args.value("clip", "X0,Y0,Z0,X1,Y1,Z1",
             "draw what lies in this box alone, world units; not of slices, which cut by themselves")
      .flag("clip-covered", "draw the covered region alone, of which the certificate speaks")
      .value("covered-from", "IN", "the scan, which says where a file of an earlier version is covered");
}

std::optional<CoveredCylinder> covered_of(const Arguments& args, const Scene& scene,
                                          const Progress& progress) {
  if (!args.has("covered-from")) return std::nullopt;
  const auto path = args.path("covered-from");
  const ProjectionSet scan = load_certified_scan(path, args, *scene.certificate, progress);
  check_projections(path, scan, *scene.certificate);
  return CertifiedRegion(scan, scene.certificate->field).cylinder();
}

std::optional<Clip> clip_for(const Arguments& args, const Scene& scene, const Progress& progress) {
  const auto box = args.numbers("clip", 6);
  if (!box && !args.has("clip-covered")) return std::nullopt;
  Clip clip = args.has("clip-covered") ? covered_clip(args, scene, progress) : Clip{}, asked;
  if (box)
    for (std::size_t a = 0; a < 3; ++a) {
      asked.low[a] = (*box)[a];
      asked.high[a] = (*box)[a + 3];
      if (!(asked.low[a] < asked.high[a]))
        throw InputError(
            fmt::format("--clip: {} is not below {} along {}", asked.low[a], asked.high[a], "xyz"[a]));
    }
  cut_to(clip, asked);
  return clip;
}

}  // namespace vdvr::cli
