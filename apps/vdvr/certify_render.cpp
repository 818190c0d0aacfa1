#include "apps/vdvr/certify_render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/vdvr/certify_options.hpp"
#include "apps/vdvr/clip.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/explain_pixel.hpp"
#include "vdvr/expert/surface_picture.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

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

std::vector<std::string> overlay_names(const Overlay& overlay) {
  std::vector<std::string> names;
  if (overlay.axes) names.emplace_back("axes");
  if (overlay.box) names.emplace_back("box");
  if (overlay.colour_bar) names.emplace_back("colorbar");
  if (overlay.caption) names.emplace_back("caption");
  return names;
}

std::string line_of(const CertifiedPicture& picture) {
  return bound_line(picture.bound, picture.epsilon, picture.bounds.light);
}

std::vector<std::string> caption_of(const CertifiedPicture& picture) {
  if (picture.record.options.mode == RenderMode::slice)
    return {line_of(picture), "Certified: F at the middles of pixels, where it is covered."};
  return {line_of(picture),
          fmt::format("Certified, {}: the ideal picture of F inside the covered region. Overlays are not.",
                      text_of(picture.bounds.light))};
}

/// A slice within its frame.
struct Framed {
  SliceFrame frame;
  std::int64_t width = 0, height = 0;  ///< of both; the slice alone is smaller
};

/// The slice alone where there is a frame around it.
Framed set_slice(RenderOptions& o, const Scene& scene) {
  const Grid& g = scene.volume.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  if (!o.slice_position)
    o.slice_position = g.origin[axis] + 0.5 * static_cast<double>(g.cells[axis]) * g.spacing[axis];
  Framed framed{frame_of_slice(o, g, scene.certificate), o.width, o.height};
  framed.frame.caption_lines = 3;  // what it says is known later
  const SlicePlace place = slice_place(framed.frame, o.width, o.height);
  o.width = place.width;
  o.height = place.height;
  return framed;
}

/// What --show asks for in place of the picture: values, or a picture of them.
FloatImage values_of(const std::string& show, const CertifiedPicture& p) {
  const RenderMode mode = p.record.options.mode;
  if (mode == RenderMode::iso) {
    if (show == "class")
      return {p.surface.first.width, p.surface.first.height, {p.surface.hit.begin(), p.surface.hit.end()}, 1};
    return show == "lo" ? p.surface.first : show == "hi" ? p.surface.last : band_of(p.surface);
  }
  if (show == "bound") return p.bound.levels;
  if (mode == RenderMode::mip) return show == "lo" ? p.maxima.low : p.maxima.high;
  if (mode == RenderMode::integral) return show == "lo" ? p.integrals.low : p.integrals.high;
  return end_of(p.bounds, show);
}

Image picture_of(const std::string& show, const CertifiedPicture& p, const std::optional<double>& at_white) {
  if (show == "class") return class_picture(p.surface);
  if (show == "band") return band_picture(p.surface, at_white && *at_white > 0 ? *at_white : 1);
  return show == "bound" ? picture_of_bound(p.bound, p.bounds) : as_image(end_of(p.bounds, show));
}

Image with_overlay(CertifiedPicture& picture, const Scene& scene, const Overlay& overlay,
                   std::optional<Framed>& framed) {
  const RenderMode mode = picture.record.options.mode;
  const auto caption = caption_of(picture);
  if (framed) {
    framed->frame.caption = caption;
    return framed_slice(framed->frame, picture.drawn.image, framed->width, framed->height);
  }
  RenderResult drawn = picture.drawn;
  if (mode == RenderMode::dvr) draw_overlay(drawn, scene, picture.record.options, overlay, true, caption);
  return std::move(drawn.image);
}

/// What is written as the picture.
PictureFile file_of(const std::string& show, CertifiedPicture& picture, const Scene& scene,
                    const Overlay& overlay, std::optional<Framed>& framed, bool values) {
  const RenderMode mode = picture.record.options.mode;
  PictureFile file;
  if (framed) file.overlays = {"frame"};
  else if (!is_certified_by_ray(mode)) file.overlays = overlay_names(overlay);
  if (show == "band") file.band_at_white = band_quantile(picture.surface, 0.99);
  if (show != "colour")
    file.write = [&, show, values, at_white = file.band_at_white](const fs::path& path) {
      if (values) write_npy(path, values_of(show, picture));
      else write_png(path, picture_of(show, picture, at_white));
    };
  else if (!is_certified_by_ray(mode))
    file.write = [&](const fs::path& path) {
      write_png(path, with_overlay(picture, scene, overlay, framed));
    };
  return file;
}

// --- --explain ---

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

std::optional<Explained> explained(const Arguments& args, const Source& source,
                                   const CertifiedPicture& picture) {
  const auto pixel = args.numbers("explain", 2);
  if (!pixel) return std::nullopt;
  Explained e{static_cast<std::int64_t>((*pixel)[0]), static_cast<std::int64_t>((*pixel)[1]), {}};
  const Certificate& certificate = source.certificate();
  e.why = explain_pixel(source.scene().volume,
                        brick_bounds(certificate, picture.bounds.sampler == SamplerKind::image3d),
                        picture.record.options, e.x, e.y, certificate.window.has_value());
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

void print_explained(const Explained& e, const MixedVolume& volume, const CertifiedPicture& picture) {
  const RenderOptions& o = picture.record.options;
  const auto bound =
      static_cast<double>(picture.bound.levels.values[static_cast<std::size_t>(e.y * o.width + e.x)]);
  fmt::print("  pixel ({}, {}): bound {:.1f} levels; to first order {:.1f}, of which\n", e.x, e.y, bound,
             e.why.levels);
  const Index3 n = volume.bricks();
  for (std::size_t i = 0; i < std::min<std::size_t>(6, e.why.bricks.size()); ++i) {
    const BrickShare& b = e.why.bricks[i];
    const auto at = static_cast<std::int64_t>(b.brick);
    const LevelTriple& l = volume.level[b.brick];
    fmt::print("    {:>5.1f}  brick ({}, {}, {}), level zyx {}{}{}, |V - F| <= {:.4g}\n", b.levels, at % n[0],
               at / n[0] % n[1], at / (n[0] * n[1]), l[0], l[1], l[2], b.bound);
  }
  const auto worst = std::max_element(e.why.of_points.begin(), e.why.of_points.end());
  if (worst == e.why.of_points.end() || !(*worst > 0)) return;
  const TransferPoint& p = o.transfer.points[static_cast<std::size_t>(worst - e.why.of_points.begin())];
  fmt::print("    {:>5.1f}  at the transfer function's point {:.6g} (opacity {:.3g})\n", *worst, p.value,
             p.opacity);
}

/// Levels of what is shown, and how well the value of F behind it is known: `member` of the JSON.
void print_known(const Json& json, const std::string& shown, const char* member, const char* what) {
  const Json &known = json.at(member), &levels = json.at("levels");
  fmt::print(
      "  {:<12} {:.0f} % of the pixels certain to 4 levels of 255, {:.0f} % to 8; mean {:.1f}, worst "
      "{:.1f}\n",
      shown, 100 * json.at("within").at("4").get<double>(), 100 * json.at("within").at("8").get<double>(),
      levels.at("mean").get<double>(), levels.at("max").get<double>());
  fmt::print("  certain      the {} of F to +- {:.4g} in the mean, {:.4g} at most\n", what,
             known.at("half_width_mean").get<double>(), known.at("half_width_max").get<double>());
}

}  // namespace

CertifiedRender certify_render(const Arguments& args, const CommonOptions& common, Source& source,
                               const RenderOptions& options, const Overlay& overlay, const fs::path& output,
                               const Progress& progress) {
  const Scene& scene = source.scene();
  const std::string name = args.path("FILE").string(), show = args.text_or("show", "colour");
  if (!scene.certificate || !scene.verified)
    throw InputError(fmt::format(
        "{}: --certify needs a certified volume whose content was compared; `vdvr build` makes one of a scan",
        name));
  check_pixel(args, options);
  for (const auto& path : beside_picture(output, options.mode)) check_output(path, common.force, {});
  PictureRequest request = picture_request(args, options, covered_of(args, scene, progress));
  const bool values = output.extension() == ".npy";
  std::optional<Framed> framed;
  if (options.mode == RenderMode::slice && !overlay.plain && show == "colour")
    framed = set_slice(request.options, scene);
  CertifiedRender made;
  try {
    made.picture = certify_picture(source.volume(), source.certificate(), request, progress);
  } catch (InputError& e) {
    e.add_context(name);
    throw;
  }
  made.json = Json::parse(write_certified_picture(
      output, made.picture, file_of(show, made.picture, scene, overlay, framed, values)));
  if (options.mode != RenderMode::iso) made.beyond = pixels_beyond(args, made.picture.bound);
  return made;
}

void say_certified(const Arguments& args, const CommonOptions& common, Source& source,
                   const CertifiedRender& made, const fs::path& output) {
  const CertifiedPicture& picture = made.picture;
  const RenderOptions& o = picture.record.options;
  const auto why = explained(args, source, picture);
  Json printed = made.json;
  printed["output"] = output.string();
  printed["seconds"] = {{"draw", picture.drawn.seconds}, {"certify", picture.bounds.seconds}};
  printed["paging"] = paging_json(source.paging());
  if (made.beyond) printed["picture_tolerance"] = tolerance_json(*made.beyond);
  if (why) printed["explain"] = explained_json(*why);
  print_result(common, printed, [&] {
    const bool slice = o.mode == RenderMode::slice;
    const auto beside = beside_picture(output, o.mode);
    fmt::print("{}\n", line_of(picture));
    fmt::print("  {}: {} x {}{}; bound in {}, certificate in {}\n", output.string(), o.width, o.height,
               slice ? "" : fmt::format(", light {}", text_of(picture.bounds.light)), beside.back().string(),
               beside.front().string());
    if (!slice)
      fmt::print("  {:.1f} parts a ray; drawn in {:.3f} s, certified in {:.3f} s on {}\n",
                 picture.bound.parts_mean, picture.drawn.seconds, picture.bounds.seconds,
                 picture.bounds.light == CertifiedLight::lit ? "the host" : source.device().info().name);
    print_paging(source.paging());
    if (why) print_explained(*why, source.scene().volume, picture);
    print_tolerance(made.beyond);
  });
  require_within(output, made.beyond);
}

void print_certain(const CertifiedRender& made) {
  const Json& json = made.json;
  const RenderMode mode = made.picture.record.options.mode;
  if (mode == RenderMode::iso) {
    const Json& iso = json.at("iso");
    fmt::print(
        "  certain      {:.1f} % of the pixels show the surface for sure, {:.1f} % may, {:.1f} % do not; its "
        "depth to {:.3g} in the median, {:.3g} in 99 % ({})\n",
        100 * iso.at("sure").get<double>(), 100 * iso.at("possible").get<double>(),
        100 * iso.at("none").get<double>(), iso.at("band_median").get<double>(),
        iso.at("band_p99").get<double>(), iso.at("unit").get<std::string>());
    return;
  }
  if (mode == RenderMode::mip) print_known(json, "colours", "mip", "maximum");
  else print_known(json, "greys", "integral", "integral");
  print_tolerance(made.beyond);
}

}  // namespace vdvr::cli
