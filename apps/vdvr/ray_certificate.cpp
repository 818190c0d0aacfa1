#include "apps/vdvr/ray_certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/vdvr/output.hpp"
#include "vdvr/certified_rays.hpp"
#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/output_file.hpp"
#include "vdvr/surface_picture.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {
namespace {

constexpr const char* surface_statement =
    "F passes the value first, on the ray through a pixel's centre within the covered cylinder, between "
    "`first` and "
    "`last` where the pixel is sure; nowhere where it is none; and not before `first` where it is possible";
constexpr const char* maximum_statement =
    "the largest F on the ray through a pixel's centre, within the covered cylinder, lies between `lo` and "
    "`hi`";

bool is_values(const fs::path& output) { return output.extension() == ".npy"; }

Json camera_json(const Camera& c) {
  return {{"position", c.position},
          {"focal_point", c.focal_point},
          {"view_up", c.view_up},
          {"view_angle", c.view_angle_deg}};
}

std::string pixels_sha256(const Image& image) {
  Sha256 sha;
  sha.update(image.rgb.data(), image.rgb.size());
  return sha.hex();
}

Json head_json(const Scene& scene, const RenderOptions& o, const fs::path& output, const char* statement) {
  return {{"format", "vdvr picture certificate 1"},
          {"statement", statement},
          {"volume",
           {{"content_sha256", scene.certificate->content_sha256},
            {"epsilon_abs", scene.certificate->epsilon_abs}}},
          {"picture",
           {{"file", output.filename().string()},
            {"width", o.width},
            {"height", o.height},
            {"mode", o.mode == RenderMode::iso ? "iso" : "mip"},
            {"camera", camera_json(o.camera)}}}};
}

Json surface(const std::string& show, const CertifiedRays& rays, const RenderOptions& o, const Scene& scene,
             Image image, const fs::path& output, const Progress& progress) {
  const double value = o.surfaces.front().value;
  const SurfaceBounds bounds = rays.surface(o.camera, o.width, o.height, value, progress);
  const double p99 = band_quantile(bounds, 0.99), median = band_quantile(bounds, 0.5);
  if (is_values(output)) {
    FloatImage classes{o.width, o.height, {bounds.hit.begin(), bounds.hit.end()}, 1};
    write_npy(output, show == "class" ? classes
                      : show == "lo"  ? bounds.first
                      : show == "hi"  ? bounds.last
                                      : band_of(bounds));
  } else {
    if (show == "class") image = class_picture(bounds);
    else if (show == "band") image = band_picture(bounds, p99 > 0 ? p99 : 1);
    else hatch_possible(image, bounds);
    write_png(output, image);
  }
  Json json = head_json(scene, o, output, surface_statement);
  json["picture"]["iso"] = value;
  if (!is_values(output)) json["picture"]["sha256"] = pixels_sha256(image);
  if (show == "band") json["picture"]["band_at_white"] = p99;
  double sum = 0;
  std::int64_t count = 0;
  for (const float band : band_of(bounds).values)
    if (!std::isnan(band)) {
      sum += static_cast<double>(band);
      ++count;
    }
  json["iso"] = {
      {"sure", bounds.share(2)},       {"possible", bounds.share(1)},
      {"none", bounds.share(0)},       {"band_mean", count > 0 ? sum / static_cast<double>(count) : 0},
      {"band_median", median},         {"band_p99", p99},
      {"unit", scene.volume.grid.unit}};
  return json;
}

Json maximum(const std::string& show, const CertifiedRays& rays, const RenderOptions& o, const Scene& scene,
             const Image& image, const fs::path& output, const Progress& progress) {
  const MaximumBounds bounds = rays.maximum(o.camera, o.width, o.height, progress);
  if (is_values(output)) write_npy(output, show == "lo" ? bounds.low : bounds.high);
  else write_png(output, image);
  double sum = 0, most = 0;
  std::int64_t count = 0, untested = 0;
  for (std::size_t i = 0; i < bounds.low.values.size(); ++i) {
    const double width =
        static_cast<double>(bounds.high.values[i]) - static_cast<double>(bounds.low.values[i]);
    if (std::isnan(width)) continue;
    if (!std::isfinite(width)) {
      ++untested;
      continue;
    }
    sum += width;
    most = std::max(most, width);
    ++count;
  }
  Json json = head_json(scene, o, output, maximum_statement);
  if (!is_values(output)) json["picture"]["sha256"] = pixels_sha256(image);
  json["mip"] = {{"half_width_mean", count > 0 ? 0.5 * sum / static_cast<double>(count) : 0},
                 {"half_width_max", 0.5 * most},
                 {"pixels", count},
                 {"untested", untested}};
  return json;
}

}  // namespace

void check_ray_certificate(const Arguments& args, RenderMode mode, bool values) {
  const std::string show = args.text_or("show", "colour");
  const bool certified_show =
      std::find(certified_outputs().begin(), certified_outputs().end(), show) != certified_outputs().end();
  const bool by_ray = mode == RenderMode::iso || mode == RenderMode::mip;
  if (args.has("certify") && !by_ray) return;  // certify_render.hpp
  if (!args.has("certify")) {
    if (certified_show) throw InputError(fmt::format("--show {}: goes with --certify", show));
    return;
  }
  refuse(args, {"turntable", "method", "unverified", "axes", "box", "colorbar", "caption"},
         "does not go with --certify, which is of one plain picture of the certified field");
  if (show != "colour" && !certified_show)
    throw InputError(fmt::format("--show {}: has no certificate; class, band, lo and hi have", show));
  if (values && !certified_show) throw InputError("--certify writes values of --show class, band, lo or hi");
  if (!values && (show == "lo" || show == "hi"))
    throw InputError(fmt::format("--show {}: is written as .npy", show));
  if (mode == RenderMode::mip && (show == "class" || show == "band"))
    throw InputError(fmt::format("--show {}: is of --mode iso", show));
  if (const auto iso = args.numbers("iso", 0); iso && iso->size() > 1)
    throw InputError("--certify: one surface at a time; give --iso one value");
}

fs::path ray_certificate_path(const fs::path& output) {
  fs::path path = output;
  return path.replace_extension(".certificate.json");
}

Json write_ray_certificate(const Arguments& args, const Scene& scene, const RenderOptions& options,
                           Image image, const fs::path& output, const Progress& progress) {
  if (!scene.certificate) throw InputError("--certify: the volume has no certificate");
  const CertifiedRays rays(scene.volume, *scene.certificate, options.sampler == SamplerKind::image3d);
  const std::string show = args.text_or("show", "colour");
  const Json json = options.mode == RenderMode::iso
                        ? surface(show, rays, options, scene, std::move(image), output, progress)
                        : maximum(show, rays, options, scene, image, output, progress);
  io::write_file(ray_certificate_path(output), json.dump(2) + "\n");
  return json;
}

void print_ray_certificate(const Json& json) {
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
  const Json& mip = json.at("mip");
  fmt::print("  certain      the maximum of F to +- {:.4g} in the mean, {:.4g} at most\n",
             mip.at("half_width_mean").get<double>(), mip.at("half_width_max").get<double>());
}

}  // namespace vdvr::cli
