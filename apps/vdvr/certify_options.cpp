#include "apps/vdvr/certify_options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/vdvr/options.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

using Names = std::vector<std::string>;

const Names kForms{"exact", "box", "fast"};
const Names kLights{"as-drawn", "lit"};

bool is_one_of(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string form_of(const Arguments& args) {
  return args.has("certify") ? args.choice("certify", kForms, "exact") : "exact";
}

bool asks_lit(const Arguments& args) {
  return args.has("certify-light") && args.choice("certify-light", kLights, "as-drawn") == "lit";
}

std::string shown(const Arguments& args) { return args.text_or("show", "colour"); }

/// What --show may be of a certified picture, and which of it is written as .npy alone.
Names shows_of(RenderMode mode) {
  if (mode == RenderMode::iso) return {"class", "band", "lo", "hi"};
  if (is_certified_by_ray(mode)) return {"bound", "lo", "hi"};
  return {"bound", "lo", "hi", "middle"};
}

std::string list_of(const Names& names) {
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) text += (i + 1 < names.size() ? ", " : " and ") + names[i];
  return text;
}

void check_light(const Arguments& args, const RenderOptions& o) {
  if (!args.has("certify-light")) return;
  if (!asks_certify(args)) refuse(args, {"certify-light"}, "goes with --certify");
  if (o.mode != RenderMode::dvr) refuse(args, {"certify-light"}, "is of --mode dvr");
  if (!o.shading) refuse(args, {"certify-light"}, "is of pictures with light: leave --no-shading out");
  if (!asks_lit(args)) return;
  if (form_of(args) == "fast")
    throw InputError("--certify fast does not go with --certify-light lit, which has two passes: --certify");
  if (o.gradient != GradientKind::automatic && o.gradient != GradientKind::central)
    throw InputError(
        "--certify-light lit: light of F is that of its differences over one base cell: take --gradient "
        "central");
  refuse(args, {"explain"}, "is of colours and opacity, not of --certify-light lit");
}

/// What is shown, and as what it is written.
void check_shown(const Arguments& args, RenderMode mode) {
  const bool values = args.path("output").extension() == ".npy";
  const std::string show = shown(args);
  const Names shows = shows_of(mode);
  if (show != "colour" && !is_one_of(shows, show))
    throw InputError(fmt::format("--certify: --show {} is none of --mode {}, which has {}", show,
                                 args.text_or("mode", "dvr"), list_of(shows)));
  if (values && show == "colour")
    throw InputError(fmt::format("--certify: as .npy there are --show {}", list_of(shows)));
  if (is_certified_by_ray(mode) && !values && (show == "lo" || show == "hi"))
    throw InputError(fmt::format("--show {}: is written as .npy", show));
}

void check_mode(const Arguments& args, const RenderOptions& o) {
  if (o.mode == RenderMode::error)
    throw InputError(
        "--certify: pictures of --mode dvr, iso, mip, integral and slice are certified, not of error");
  if (o.mode == RenderMode::dvr) return;
  refuse(args, {"certify-parts", "explain"}, "is of --mode dvr");
  if (const std::string form = form_of(args); form != "exact")
    throw InputError(
        fmt::format("--certify {} is of --mode dvr; other modes have the exact one alone", form));
  if (o.mode == RenderMode::iso) {
    refuse(args, {"picture-tolerance"}, "is of colours, in levels of 255; a surface has a band of depth");
    if (const auto iso = args.numbers("iso", 0); iso && iso->size() > 1)
      throw InputError("--certify: one surface at a time; give --iso one value");
  }
  if (is_certified_by_ray(o.mode))
    refuse(args, {"axes", "box", "colorbar", "caption"},
           "does not go with --certify, which is of one plain picture of the certified field");
  else refuse(args, {"colorbar", "caption"}, "is part of a certified slice, but for --plain");
}

}  // namespace

void add_certify(Arguments& args) {
  args.group("Certified pictures")
      .value_or_flag(
          "certify", "exact|box|fast", "exact",
          "for every pixel an interval that holds the colour of the ideal picture: writes beside "
          "X.png also X.bound.png, in levels of 255, and X.certificate.json. Draws the covered "
          "region alone. box: by steps that take opacity and colour apart, some per cent wider; fast: in one "
          "pass, 1.4 to 3 times as "
          "wide. Of slices, mip and integrals alike; of iso: where "
          "F has the surface for sure, may have it (striped), or not")
      .value("certify-parts", "K",
             "cut rays until the field spreads by at most 2 K times the bound on a part (default 0.5)")
      .value("explain", "X,Y",
             "what makes the bound of this pixel: bricks, and points of the transfer function")
      .value("picture-tolerance", "N", "exit with 1 where a pixel is not certain to N levels of 255")
      .value("certify-light", "as-drawn|lit",
             "as-drawn: colour and opacity of F under the light of the volume that is drawn. lit: under F's "
             "own, by "
             "its differences over one base cell, of what lies half a cell within the covered region; bounds "
             "are of "
             "use where epsilon is 0.2 % of the range or less (default as-drawn)");
}

bool asks_certify(const Arguments& args) { return args.has("certify") || args.has("picture-tolerance"); }

const Names& certified_outputs() {
  static const Names names{"class", "band", "lo", "hi", "bound", "middle"};
  return names;
}

void check_certify(const Arguments& args, const RenderOptions& o) {
  check_light(args, o);
  const std::string show = shown(args);
  const bool of_bounds = is_one_of(certified_outputs(), show);
  if (!asks_certify(args)) {
    refuse(args, {"certify-parts", "explain"}, "goes with --certify");
    if (of_bounds) throw InputError(fmt::format("--show {} goes with --certify", show));
    return;
  }
  check_mode(args, o);
  check_shown(args, o.mode);
  if (of_bounds) refuse(args, {"axes", "box", "colorbar", "caption"}, "is not drawn over bounds");
  if (args.has("turntable"))
    throw InputError("--certify: one picture at a time; give each its --azimuth instead of --turntable");
  if (args.text_or("method", "vdvr") != "vdvr")
    throw InputError("--certify: the certificate is of --method vdvr");
  if (o.gradient == GradientKind::stored && !is_certified_by_ray(o.mode))
    throw InputError("--gradient stored: a certified picture takes central or analytic");
  refuse(args, {"unverified"}, "excludes --certify");
  if (const auto levels = args.number("picture-tolerance"); levels && !(*levels >= 0 && *levels <= 255))
    throw InputError(fmt::format("--picture-tolerance: {:g} is not within 0 and 255 levels", *levels));
}

PictureRequest picture_request(const Arguments& args, const RenderOptions& options,
                               const std::optional<CoveredCylinder>& covered) {
  PictureRequest request;
  request.options = options;
  request.certify.fast = form_of(args) == "fast";
  request.certify.box = form_of(args) == "box";
  request.certify.kappa = args.positive_or("certify-parts", request.certify.kappa);
  request.lit = asks_lit(args);
  request.keep_steps = args.has("step") || args.has("classification") || args.has("step-mode");
  request.tolerance = args.number("picture-tolerance");
  request.covered = covered;
  return request;
}

}  // namespace vdvr::cli
