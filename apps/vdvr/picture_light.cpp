#include "apps/vdvr/picture_light.hpp"

#include <fmt/format.h>

#include "apps/vdvr/clip.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kLights{"as-drawn", "lit"};

}  // namespace

void add_picture_light(Arguments& args) {
  args.value(
      "certify-light", "as-drawn|lit",
      "as-drawn: colour and opacity of F under the light of the volume that is drawn. lit: under F's own, by "
      "its differences over one base cell, of what lies half a cell within the covered region; bounds are of "
      "use where epsilon is 0.2 % of the range or less (default as-drawn)");
}

bool asks_lit(const Arguments& args) {
  return args.has("certify-light") && args.choice("certify-light", kLights, "as-drawn") == "lit";
}

void check_picture_light(const Arguments& args, const RenderOptions& o) {
  if (!args.has("certify-light")) return;
  if (!args.has("certify") && !args.has("picture-tolerance"))
    refuse(args, {"certify-light"}, "goes with --certify");
  if (o.mode != RenderMode::dvr) refuse(args, {"certify-light"}, "is of --mode dvr");
  if (!o.shading) refuse(args, {"certify-light"}, "is of pictures with light: leave --no-shading out");
  if (!asks_lit(args)) return;
  const std::string form = args.has("certify") ? args.text_or("certify", "exact") : "exact";
  if (form == "fast")
    throw InputError("--certify fast does not go with --certify-light lit, which has two passes: --certify");
  if (o.gradient != GradientKind::automatic && o.gradient != GradientKind::central)
    throw InputError(
        "--certify-light lit: light of F is that of its differences over one base cell: take --gradient "
        "central");
  refuse(args, {"explain"}, "is of colours and opacity, not of --certify-light lit");
}

void cut_to_differences(Clip& clip, const Clip& known, const Grid& grid) {
  const Clip inside = inside_of_differences(known, grid);
  for (std::size_t a = 0; a < 3; ++a)
    if (!(inside.low[a] < inside.high[a]))
      throw InputError(
          fmt::format("--certify-light lit: light of F needs half a base cell to either side, and along {} "
                      "no more than one cell "
                      "is covered: take --certify-light as-drawn",
                      "xyz"[a]));
  cut(clip, inside.low, inside.high);
  clip.radius = std::min(clip.radius, inside.radius);
  require_some(clip);
}

PixelBounds certify_lit(const Source& source, const Clip& known, const RenderOptions& options,
                        const CertifyPictureOptions& certify, const Progress& progress) {
  const Scene& scene = source.scene();
  return certify_lit_pixels(scene.volume, brick_bounds(*scene.certificate, false), known,
                            source.value_range(), options, certify, progress);
}

}  // namespace vdvr::cli
