#include "apps/vdvr/certify_render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/vdvr/certified_drawing.hpp"
#include "apps/vdvr/clip.hpp"
#include "apps/vdvr/picture_certificate.hpp"
#include "apps/vdvr/picture_light.hpp"
#include "apps/vdvr/picture_tolerance.hpp"
#include "apps/vdvr/sampler_json.hpp"
#include "vdvr/error.hpp"
#include "vdvr/explain_pixel.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/output_file.hpp"
#include "vdvr/stop.hpp"
#include "vdvr/trust.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kShown{"bound", "lo", "hi", "middle"};
const std::vector<std::string> kForms{"exact", "box", "fast"};

std::string form_of(const Arguments& args) {
  return args.has("certify") ? args.choice("certify", kForms, "exact") : "exact";
}

struct Outputs {
  std::filesystem::path picture, bound, certificate;
  bool values = false;  ///< .npy
};

Outputs outputs_of(const std::filesystem::path& picture) {
  Outputs o{picture, picture, picture, picture.extension() == ".npy"};
  o.bound.replace_extension(".bound.png");
  o.certificate.replace_extension(".certificate.json");
  return o;
}

/// Between or of the ends, values as float32 or as they are shown.
FloatImage end_of(const PixelBounds& b, const std::string& which) {
  FloatImage image = which == "lo" ? b.lo : b.hi;
  if (which == "middle")
    for (std::size_t i = 0; i < image.values.size(); ++i)
      image.values[i] = (b.lo.values[i] + b.hi.values[i]) / 2;
  return image;
}

Image as_image(const FloatImage& values) {
  Image image{values.width, values.height, {}};
  for (const float x : values.values)
    image.rgb.push_back(static_cast<std::uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f));
  return image;
}

CertifyPictureOptions certify_options(const Arguments& args, const Certificate& certificate,
                                      const RenderOptions& o) {
  CertifyPictureOptions c;
  c.window = certificate.window;
  c.fast = form_of(args) == "fast";
  c.box = form_of(args) == "box";
  c.kappa = args.positive_or("certify-parts", c.kappa);
  if (o.mode == RenderMode::dvr)
    c.theta = ending_share(c.theta, brick_bounds(certificate, false), o.transfer);
  return c;
}

std::vector<std::string> overlay_names(const Overlay& overlay) {
  std::vector<std::string> names;
  if (overlay.axes) names.emplace_back("axes");
  if (overlay.box) names.emplace_back("box");
  if (overlay.colour_bar) names.emplace_back("colorbar");
  if (overlay.caption) names.emplace_back("caption");
  return names;
}

std::vector<std::string> caption_of(const PictureBound& bound, const PixelBounds& bounds,
                                    const Certificate& certificate, bool slice) {
  if (slice)
    return {bound_line(bound, certificate, bounds.light),
            "Certified: F at the middles of pixels, where it is covered."};
  return {bound_line(bound, certificate, bounds.light),
          fmt::format("Certified, {}: the ideal picture of F inside the covered region. Overlays are not.",
                      text_of(bounds.light))};
}

/// The slice alone where there is a frame around it.
SliceFrame set_slice(RenderOptions& o, const Scene& scene, bool plain) {
  const Grid& g = scene.volume.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  if (!o.slice_position)
    o.slice_position = g.origin[axis] + 0.5 * static_cast<double>(g.cells[axis]) * g.spacing[axis];
  SliceFrame frame = frame_of_slice(o, g, scene.certificate);
  frame.caption_lines = 3;  // what it says is known later
  if (plain) return frame;
  const SlicePlace place = slice_place(frame, o.width, o.height);
  o.width = place.width;
  o.height = place.height;
  return frame;
}

void write_shown(const Outputs& out, const std::string& show, const PixelBounds& bounds,
                 const PictureBound& bound) {
  if (show == "bound") {
    if (out.values) write_npy(out.picture, bound.levels);
    else write_png(out.picture, picture_of_bound(bound, bounds));
    return;
  }
  const FloatImage values = end_of(bounds, show);
  if (out.values) write_npy(out.picture, values);
  else write_png(out.picture, as_image(values));
}

struct Explained {
  std::int64_t x = 0, y = 0;
  PixelExplanation why;
};

/// Before anything is written.
void check_pixel(const Arguments& args, const RenderOptions& o) {
  const auto pixel = args.numbers("explain", 2);
  const auto inside = [](double at, std::int64_t size) {
    return at >= 0 && at < static_cast<double>(size) && at == std::floor(at);
  };
  if (pixel && !(inside((*pixel)[0], o.width) && inside((*pixel)[1], o.height)))
    throw InputError(fmt::format("--explain: {},{} is no pixel of {}x{}; 0,0 is the first", (*pixel)[0],
                                 (*pixel)[1], o.width, o.height));
}

std::optional<Explained> explained(const Arguments& args, const Scene& scene, const Certificate& certificate,
                                   const RenderOptions& o, SamplerKind sampler) {
  const auto pixel = args.numbers("explain", 2);
  if (!pixel) return std::nullopt;
  Explained e{static_cast<std::int64_t>((*pixel)[0]), static_cast<std::int64_t>((*pixel)[1]), {}};
  e.why = explain_pixel(scene.volume, brick_bounds(certificate, sampler == SamplerKind::image3d), o, e.x, e.y,
                        certificate.window.has_value());
  return e;
}

Json explained_json(const Explained& e) {
  Json bricks = Json::array();
  for (const BrickShare& b : e.why.bricks)
    bricks.push_back({{"brick", b.brick},
                      {"bound", std::isfinite(b.bound) ? Json(b.bound) : Json()},
                      {"levels", b.levels}});
  return {{"pixel", Json::array({e.x, e.y})}, {"bricks", bricks}, {"of_points", e.why.of_points}};
}

void print_explained(const Explained& e, const Scene& scene, const RenderOptions& o, double bound) {
  fmt::print("  pixel ({}, {}): bound {:.1f} levels; to first order {:.1f}, of which\n", e.x, e.y, bound,
             e.why.levels);
  const Index3 n = scene.volume.bricks();
  for (std::size_t i = 0; i < std::min<std::size_t>(6, e.why.bricks.size()); ++i) {
    const BrickShare& b = e.why.bricks[i];
    const auto at = static_cast<std::int64_t>(b.brick);
    const LevelTriple& l = scene.volume.level[b.brick];
    fmt::print("    {:>5.1f}  brick ({}, {}, {}), level zyx {}{}{}, |V - F| <= {:.4g}\n", b.levels, at % n[0],
               at / n[0] % n[1], at / (n[0] * n[1]), l[0], l[1], l[2], b.bound);
  }
  const auto worst = std::max_element(e.why.of_points.begin(), e.why.of_points.end());
  if (worst == e.why.of_points.end() || !(*worst > 0)) return;
  const TransferPoint& p = o.transfer.points[static_cast<std::size_t>(worst - e.why.of_points.begin())];
  fmt::print("    {:>5.1f}  at the transfer function's point {:.6g} (opacity {:.3g})\n", *worst, p.value,
             p.opacity);
}

/// What of it is written as the picture.
struct Show {
  std::string what;
  bool slice = false, framed = false;
  SliceFrame frame;
  std::int64_t width = 0, height = 0;  ///< asked for; a slice in a frame is smaller
};

void write_picture(const Outputs& out, Show& show, CertifiedDrawing& made, const PictureBound& bound,
                   const Scene& scene, const RenderOptions& o, const Overlay& overlay) {
  if (show.what != "colour") {
    write_shown(out, show.what, made.bounds, bound);
    return;
  }
  const auto caption = caption_of(bound, made.bounds, *scene.certificate, show.slice);
  if (show.framed) {
    show.frame.caption = caption;
    write_png(out.picture, framed_slice(show.frame, made.drawn.image, show.width, show.height));
    return;
  }
  if (!show.slice) draw_overlay(made.drawn, scene, o, overlay, true, caption);
  write_png(out.picture, made.drawn.image);
}

/// Prints what was found. Throws MismatchError where --picture-tolerance is not met.
int say(const Arguments& args, const CommonOptions& common, Source& source, const RenderOptions& o,
        const Outputs& out, const CertifiedDrawing& made, const PictureBound& bound, const Json& json) {
  const Scene& scene = source.scene();
  const auto why = explained(args, scene, source.certificate(), o, made.bounds.sampler);
  const std::optional<PixelsBeyond> beyond = pixels_beyond(args, bound);
  Json printed = json;
  printed["output"] = out.picture.string();
  printed["seconds"] = {{"draw", made.drawn.seconds}, {"certify", made.bounds.seconds}};
  printed["paging"] = paging_json(source.paging());
  if (beyond) printed["picture_tolerance"] = tolerance_json(*beyond);
  if (why) printed["explain"] = explained_json(*why);
  print_result(common, printed, [&] {
    const bool slice = o.mode == RenderMode::slice;
    fmt::print("{}\n", bound_line(bound, *scene.certificate, made.bounds.light));
    fmt::print("  {}: {} x {}{}; bound in {}, certificate in {}\n", out.picture.string(), o.width, o.height,
               slice ? "" : fmt::format(", light {}", text_of(made.bounds.light)), out.bound.string(),
               out.certificate.string());
    if (!slice)
      fmt::print("  {:.1f} parts a ray; drawn in {:.3f} s, certified in {:.3f} s on {}\n", bound.parts_mean,
                 made.drawn.seconds, made.bounds.seconds,
                 made.bounds.light == CertifiedLight::lit ? "the host" : source.device().info().name);
    print_paging(source.paging());
    if (why)
      print_explained(
          *why, scene, o,
          static_cast<double>(bound.levels.values[static_cast<std::size_t>(why->y * o.width + why->x)]));
    print_tolerance(beyond);
  });
  require_within(out.picture, beyond);
  return 0;
}

void check_file(const Arguments& args, const Scene& scene, const RenderOptions& o) {
  const std::string name = args.path("FILE").string();
  if (!scene.certificate || !scene.verified)
    throw InputError(fmt::format("{}: --certify needs a certified volume whose content was compared", name));
  if (scene.certificate->comparison)
    throw InputError(fmt::format("{}: is for comparison and certifies nothing; build it without", name));
  const auto& window = scene.certificate->window;
  if (window && asks_lit(args))
    throw InputError(
        fmt::format("{}: was certified within --window {:.6g},{:.6g}; differences of F across its ends are "
                    "unknown, and so is "
                    "its light: take --certify-light as-drawn, or build without --window",
                    name, window->first, window->second));
  if (window && o.mode == RenderMode::slice)
    throw InputError(fmt::format(
        "{}: was certified within --window {:.6g},{:.6g}; where F lies outside of it is unknown, so that no "
        "pixel of a slice is known: build without --window",
        name, window->first, window->second));
  if (window && !is_clear_outside(o.transfer, *window))
    throw InputError(fmt::format(
        "{}: was certified within --window {:.6g},{:.6g}, outside of which F is unknown, and the transfer "
        "function shows values there: name one by --tf whose opacity is 0 below and above the window, or "
        "build "
        "without --window",
        name, window->first, window->second));
}

}  // namespace

const std::vector<std::string>& bound_outputs() { return kShown; }

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
      .value("picture-tolerance", "N", "exit with 1 where a pixel is not certain to N levels of 255");
  add_picture_light(args);
}

bool asks_certify(const Arguments& args) { return args.has("certify") || args.has("picture-tolerance"); }

void check_certify(const Arguments& args, const RenderOptions& o) {
  check_picture_light(args, o);
  const std::string show = args.text_or("show", "colour");
  const bool of_bounds = std::find(kShown.begin(), kShown.end(), show) != kShown.end();
  if (!asks_certify(args)) {
    refuse(args, {"certify-parts", "explain"}, "goes with --certify");
    if (of_bounds) throw InputError(fmt::format("--show {} goes with --certify", show));
    return;
  }
  if (is_certified_by_ray(o.mode)) {  // ray_certificate.hpp
    refuse(args, {"certify-parts", "explain"}, "is of --mode dvr");
    if (o.mode == RenderMode::iso)
      refuse(args, {"picture-tolerance"}, "is of colours, in levels of 255; a surface has a band of depth");
    check_tolerance(args);
    if (const std::string form = form_of(args); form != "exact")
      throw InputError(
          fmt::format("--certify {} is of --mode dvr; iso, mip and integral have the exact one alone", form));
    return;
  }
  if (o.mode == RenderMode::error)
    throw InputError(
        "--certify: pictures of --mode dvr, iso, mip, integral and slice are certified, not of error");
  if (o.mode == RenderMode::slice) {
    refuse(args, {"certify-parts", "explain"}, "is of --mode dvr");
    refuse(args, {"colorbar", "caption"}, "is part of a certified slice, but for --plain");
    if (const std::string form = form_of(args); form != "exact")
      throw InputError(fmt::format("--certify {} is of --mode dvr; slices have the exact one alone", form));
  }
  if (show != "colour" && !of_bounds)
    throw InputError(fmt::format("--certify: --show {} is not certified; colours are", show));
  if (of_bounds) refuse(args, {"axes", "box", "colorbar", "caption"}, "is not drawn over bounds");
  if (args.has("turntable"))
    throw InputError("--certify: one picture at a time; give each its --azimuth instead of --turntable");
  if (args.text_or("method", "vdvr") != "vdvr")
    throw InputError("--certify: the certificate is of --method vdvr");
  if (o.gradient == GradientKind::stored)
    throw InputError("--gradient stored: a certified picture takes central or analytic");
  refuse(args, {"unverified"}, "excludes --certify");
  check_tolerance(args);
  if (args.path("output").extension() == ".npy" && !of_bounds)
    throw InputError("--certify: as .npy there are --show bound, lo, hi and middle");
}

int certify_render(const Arguments& args, const CommonOptions& common, Source& source, RenderOptions o,
                   const Overlay& overlay, const std::filesystem::path& output, const Progress& progress) {
  const Scene& scene = source.scene();
  check_file(args, scene, o);
  check_pixel(args, o);
  const Certificate& certificate = source.certificate();
  const Outputs out = outputs_of(output);
  for (const auto& path : {out.bound, out.certificate}) check_output(path, common.force, {});
  const Clip covered = covered_clip(args, scene, progress);
  const bool lit = asks_lit(args);
  const CertifyPictureOptions options = certify_options(args, certificate, o);
  Show show;
  show.what = args.text_or("show", "colour");
  show.slice = o.mode == RenderMode::slice;
  show.width = o.width;
  show.height = o.height;
  show.framed = show.slice && !overlay.plain && show.what == "colour";
  if (show.slice) {
    show.frame = set_slice(o, scene, !show.framed);
  } else {
    o.clip = certified_clip(args, scene, o, progress);
    if (lit) cut_to_differences(*o.clip, covered, scene.volume.grid);
    prepare_drawing(args, o, options.theta);
  }
  const Asked asked{options, lit ? std::optional(covered) : std::nullopt, args.number("picture-tolerance")};
  CertifiedDrawing made = draw_and_certify(source, o, asked, progress);
  if (!show.slice && !chose_steps(args)) draw_finer(source, o, asked, made, progress);
  o.sampler = made.drawn.sampler;
  const PictureBound bound = bound_of_picture(made.bounds, made.drawn.image);
  CertifiedPicture picture{
      o,
      options,
      lit,
      {covered.radius, {covered.low[2], covered.high[2]}},
      certificate.content_sha256,
      output.filename().string(),
      sha256_of_pixels(made.drawn.image),
      "",
      source.device().info().name,
      source.device().info().driver,
      test_of(source.device()).names(),
      // Slices and light of F are certified on the host.
      sampler_term_json(certificate, !show.slice && !lit && made.bounds.sampler == SamplerKind::image3d),
      show.framed ? std::vector<std::string>{"frame"} : overlay_names(overlay)};
  io::AtomicFiles files;
  const Outputs parts{files.add(out.picture), files.add(out.bound), files.add(out.certificate), out.values};
  write_picture(parts, show, made, bound, scene, o, overlay);
  write_png(parts.bound, picture_of_bound(bound, made.bounds));
  picture.file_sha256 = sha256_of_file(parts.picture);
  const Json json = picture_certificate_json(picture, made.bounds, bound, certificate);
  io::write_file(parts.certificate, json.dump(2) + "\n");
  files.commit();
  return say(args, common, source, o, out, made, bound, json);
}

}  // namespace vdvr::cli
