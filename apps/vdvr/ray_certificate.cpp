#include "apps/vdvr/ray_certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/vdvr/certify_render.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/picture_certificate.hpp"
#include "apps/vdvr/sampler_json.hpp"
#include "vdvr/certified_rays.hpp"
#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/output_file.hpp"
#include "vdvr/stop.hpp"
#include "vdvr/surface_picture.hpp"
#include "vdvr/trust.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

/// Where the parts of a certified picture are written, until all are.
struct Parts {
  Parts(const fs::path& output, RenderMode mode) : values(output.extension() == ".npy") {
    picture = files.add(output);
    for (const auto& beside : ray_certificate_paths(output, mode))
      (beside.extension() == ".png" ? bound : certificate) = files.add(beside);
  }
  io::AtomicFiles files;
  fs::path picture, bound, certificate;
  bool values;
};

}  // namespace

CertifiedPicture described(Source& source, const RenderOptions& options, const RenderResult& drawn,
                           const fs::path& output) {
  const Scene& scene = source.scene();
  CertifiedPicture picture;
  picture.options = options;
  picture.options.sampler = drawn.sampler;
  if (options.mode == RenderMode::iso && drawn.gradient != GradientKind::automatic)
    picture.options.gradient = drawn.gradient;
  picture.certify.window = scene.certificate->window;
  if (scene.certificate->covered) picture.covered = *scene.certificate->covered;
  picture.content_sha256 = scene.certificate->content_sha256;
  picture.file = output.filename().string();
  picture.pixels_sha256 = sha256_of_pixels(drawn.image);
  picture.device = source.device().info().name;
  picture.driver = source.device().info().driver;
  picture.device_test = test_of(source.device()).names();
  picture.sampler_term = sampler_term_json(source.certificate(), false);  // intervals are of the host
  return picture;
}

namespace {

void write_surface(const std::string& show, const SurfaceBounds& bounds, Image image, const Parts& parts) {
  if (parts.values) {
    const FloatImage classes{
        bounds.first.width, bounds.first.height, {bounds.hit.begin(), bounds.hit.end()}, 1};
    write_npy(parts.picture, show == "class" ? classes
                             : show == "lo"  ? bounds.first
                             : show == "hi"  ? bounds.last
                                             : band_of(bounds));
    return;
  }
  const double p99 = band_quantile(bounds, 0.99);
  if (show == "class") image = class_picture(bounds);
  else if (show == "band") image = band_picture(bounds, p99 > 0 ? p99 : 1);
  else hatch_possible(image, bounds);
  write_png(parts.picture, image);
}

RayCertificate surface(const std::string& show, const CertifiedRays& rays, CertifiedPicture& picture,
                       const Scene& scene, const Image& image, const Parts& parts, const Progress& progress) {
  const RenderOptions& o = picture.options;
  const SurfaceBounds bounds = rays.surface(o.camera, o.width, o.height, o.surfaces.front().value, progress);
  throw_if_stopped();
  write_surface(show, bounds, image, parts);
  picture.file_sha256 = sha256_of_file(parts.picture);
  picture.overlays = {"stripes over possible hits"};
  Json json = certificate_head(picture, *scene.certificate, statement_of(RenderMode::iso));
  json["iso"] = surface_json(bounds, scene.volume.grid.unit);
  if (show == "band") json["picture"]["band_at_white"] = json["iso"]["band_p99"];
  return {std::move(json), std::nullopt};
}

RayCertificate maximum(const Arguments& args, const std::string& show, const CertifiedRays& rays,
                       CertifiedPicture& picture, const Scene& scene, const Image& image, const Parts& parts,
                       const Progress& progress) {
  const RenderOptions& o = picture.options;
  const MaximumBounds maxima = rays.maximum(o.camera, o.width, o.height, progress);
  throw_if_stopped();
  const PixelBounds bounds = colours_of_maxima(maxima, o);
  const PictureBound bound = bound_of_picture(bounds, image);
  const Image bounds_image = picture_of_bound(bound, bounds);
  if (parts.values)
    write_npy(parts.picture, show == "lo" ? maxima.low : show == "hi" ? maxima.high : bound.levels);
  else write_png(parts.picture, show == "bound" ? bounds_image : image);
  write_png(parts.bound, bounds_image);
  picture.file_sha256 = sha256_of_file(parts.picture);
  Json json = picture_certificate_json(picture, bounds, bound, *scene.certificate);
  json["mip"] = half_widths_json(maxima.low, maxima.high);
  return {std::move(json), pixels_beyond(args, bound)};
}

}  // namespace

void check_ray_certificate(const Arguments& args, RenderMode mode, bool values) {
  const std::string show = args.text_or("show", "colour");
  const bool certified_show =
      std::find(certified_outputs().begin(), certified_outputs().end(), show) != certified_outputs().end();
  const bool by_ray = mode == RenderMode::iso || mode == RenderMode::mip;
  if (asks_certify(args) && !by_ray) return;  // certify_render.hpp
  if (!asks_certify(args)) {
    if (certified_show) throw InputError(fmt::format("--show {}: goes with --certify", show));
    return;
  }
  refuse(args, {"turntable", "method", "unverified", "axes", "box", "colorbar", "caption"},
         "does not go with --certify, which is of one plain picture of the certified field");
  if (show != "colour" && !certified_show)
    throw InputError(fmt::format("--show {}: has no certificate; {} have", show,
                                 mode == RenderMode::mip ? "bound, lo and hi" : "class, band, lo and hi"));
  if (values && !certified_show)
    throw InputError(fmt::format("--certify writes values of --show {}",
                                 mode == RenderMode::mip ? "bound, lo or hi" : "class, band, lo or hi"));
  if (!values && (show == "lo" || show == "hi"))
    throw InputError(fmt::format("--show {}: is written as .npy", show));
  if (mode == RenderMode::mip && (show == "class" || show == "band"))
    throw InputError(fmt::format("--show {}: is of --mode iso", show));
  if (mode == RenderMode::iso && show == "bound")
    throw InputError("--show bound: of --mode iso there are class and band");
  if (const auto iso = args.numbers("iso", 0); iso && iso->size() > 1)
    throw InputError("--certify: one surface at a time; give --iso one value");
}

std::vector<fs::path> ray_certificate_paths(const fs::path& output, RenderMode mode) {
  std::vector<fs::path> paths{output, output};
  paths[0].replace_extension(".certificate.json");
  paths[1].replace_extension(".bound.png");
  if (mode == RenderMode::iso) paths.pop_back();
  return paths;
}

RayCertificate write_ray_certificate(const Arguments& args, Source& source, const RenderOptions& options,
                                     const RenderResult& drawn, const fs::path& output,
                                     const Progress& progress) {
  const Scene& scene = source.scene();
  CertifiedPicture picture = described(source, options, drawn, output);
  const CertifiedRays rays(scene.volume, *scene.certificate, false, box_of(options.clip));
  const std::string show = args.text_or("show", "colour");
  Parts parts(output, options.mode);
  RayCertificate made = options.mode == RenderMode::iso
                            ? surface(show, rays, picture, scene, drawn.image, parts, progress)
                            : maximum(args, show, rays, picture, scene, drawn.image, parts, progress);
  io::write_file(parts.certificate, made.json.dump(2) + "\n");
  parts.files.commit();
  return made;
}

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

void print_ray_certificate(const RayCertificate& certificate) {
  const Json& json = certificate.json;
  if (json.contains("iso")) {
    const Json& iso = json.at("iso");
    fmt::print(
        "  certain      {:.1f} % of the pixels show the surface for sure, {:.1f} % may, {:.1f} % do not; its "
        "depth to {:.3g} in the median, {:.3g} in 99 % ({})\n",
        100 * iso.at("sure").get<double>(), 100 * iso.at("possible").get<double>(),
        100 * iso.at("none").get<double>(), iso.at("band_median").get<double>(),
        iso.at("band_p99").get<double>(), iso.at("unit").get<std::string>());
    return;
  }
  print_known(json, "colours", "mip", "maximum");
  print_tolerance(certificate.beyond);
}

}  // namespace vdvr::cli
