#include "apps/vdvr/clip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/certified_region.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

std::string name_of(const Arguments& args) { return args.path("FILE").string(); }

CoveredCylinder covered_from(const Arguments& args, const Certificate& certificate,
                             const Progress& progress) {
  const auto path = args.path("covered-from");
  const ProjectionSet scan = load_certified_scan(path, args, certificate, progress);
  check_projections(path, scan, certificate);
  return CertifiedRegion(scan, certificate.field).cylinder();
}

}  // namespace

void add_clip(Arguments& args) {
  args.value("clip", "X0,Y0,Z0,X1,Y1,Z1",
             "draw what lies in this box alone, world units; not of slices, which cut by themselves")
      .flag("clip-covered", "draw the covered region alone, of which the certificate speaks")
      .value("covered-from", "IN", "the scan, which says where a file of an earlier version is covered");
}

void cut(Clip& clip, const Vec3& low, const Vec3& high) {
  for (std::size_t a = 0; a < 3; ++a) {
    clip.low[a] = std::max(clip.low[a], low[a]);
    clip.high[a] = std::min(clip.high[a], high[a]);
  }
}

Clip covered_clip(const Arguments& args, const Scene& scene, const Progress& progress) {
  if (!scene.certificate)
    throw InputError(fmt::format("{}: has no certificate, so nothing in it is covered", name_of(args)));
  const Certificate& c = *scene.certificate;
  const std::optional<CoveredCylinder> covered =
      args.has("covered-from") ? covered_from(args, c, progress) : c.covered;
  if (!covered)
    throw InputError(
        fmt::format("{}: does not say where it is covered, since an earlier version wrote it; "
                    "name its scan by --covered-from, or build it again",
                    name_of(args)));
  return known_clip(*covered, c);
}

Clip known_clip(const CoveredCylinder& covered, const Certificate& certificate) {
  Clip clip;
  clip.radius = covered.radius;
  clip.low[2] = covered.z.first;
  clip.high[2] = covered.z.second;
  if (certificate.roi) {
    const std::array<double, 6>& r = *certificate.roi;
    cut(clip, {r[0], r[1], r[2]}, {r[3], r[4], r[5]});
  }
  return clip;
}

std::optional<Clip> clip_for(const Arguments& args, const Scene& scene, const Progress& progress) {
  const auto box = args.numbers("clip", 6);
  if (!box && !args.has("clip-covered")) return std::nullopt;
  Clip clip = args.has("clip-covered") ? covered_clip(args, scene, progress) : Clip{};
  if (box) {
    const std::vector<double>& b = *box;
    for (std::size_t a = 0; a < 3; ++a)
      if (!(b[a] < b[a + 3]))
        throw InputError(fmt::format("--clip: {} is not below {} along {}", b[a], b[a + 3], "xyz"[a]));
    cut(clip, {b[0], b[1], b[2]}, {b[3], b[4], b[5]});
  }
  require_some(clip);
  return clip;
}

Clip certified_clip(const Arguments& args, const Scene& scene, const RenderOptions& options,
                    const Progress& progress) {
  Clip clip = covered_clip(args, scene, progress);
  if (options.clip) cut(clip, options.clip->low, options.clip->high);
  require_some(clip);
  return clip;
}

void require_some(const Clip& clip) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double reach = a < 2 ? clip.radius : std::numeric_limits<double>::infinity();
    if (!(std::max(clip.low[a], -reach) < std::min(clip.high[a], reach)))
      throw InputError(fmt::format("--clip: the box holds nothing of the covered region along {}", "xyz"[a]));
  }
}

}  // namespace vdvr::cli
