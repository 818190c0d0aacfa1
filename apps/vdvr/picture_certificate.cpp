#include "apps/vdvr/picture_certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "vdvr/error.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/surface_picture.hpp"

namespace vdvr::cli {
namespace {

constexpr const char* kFormat = "vdvr picture certificate 1";

Json number_or_null(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
double number_or(const Json& j, double none) { return j.is_null() ? none : j.get<double>(); }

const char* text_of_steps(StepMode mode) {
  return mode == StepMode::level ? "level" : mode == StepMode::adaptive ? "adaptive" : "fixed";
}

Json camera_json(const Camera& c) {
  return {{"position", c.position},
          {"focal_point", c.focal_point},
          {"view_up", c.view_up},
          {"view_angle_deg", c.view_angle_deg}};
}

Json transfer_points(const TransferFunction& f) {
  Json points = Json::array();
  for (const TransferPoint& p : f.points)
    points.push_back({{"value", p.value}, {"rgb", p.rgb}, {"opacity", p.opacity}});
  return {{"name", f.name}, {"points", points}};
}

Json clip_json(const Clip& c) {
  Json low = Json::array(), high = Json::array();
  for (std::size_t a = 0; a < 3; ++a) {
    low.push_back(number_or_null(c.low[a]));
    high.push_back(number_or_null(c.high[a]));
  }
  return {{"low", low}, {"high", high}, {"radius", number_or_null(c.radius)}};
}

Clip clip_of(const Json& j) {
  constexpr double endless = std::numeric_limits<double>::infinity();
  Clip c;
  for (std::size_t a = 0; a < 3; ++a) {
    c.low[a] = number_or(j.at("low").at(a), -endless);
    c.high[a] = number_or(j.at("high").at(a), endless);
  }
  c.radius = number_or(j.at("radius"), endless);
  return c;
}

Json light_list(const std::vector<Vec3>& lights) {
  Json list = Json::array();
  for (const Vec3& l : lights) list.push_back(Json::array({l[0], l[1], l[2]}));
  return list;
}

constexpr std::array<std::pair<const char*, RenderMode>, 5> kModes{{{"dvr", RenderMode::dvr},
                                                                    {"iso", RenderMode::iso},
                                                                    {"mip", RenderMode::mip},
                                                                    {"slice", RenderMode::slice},
                                                                    {"integral", RenderMode::integral}}};

/// A real number of any size is no count: to convert it is undefined.
std::int64_t count_of(const Json& j, const char* name, const std::filesystem::path& path) {
  const Json& member = j.at(name);
  if (!member.is_number_integer())
    throw FileError(fmt::format("{}: `{}`: {} is no whole number", path.string(), name, member.dump()));
  return member.get<std::int64_t>();
}

/// From black to white.
Json window_json(const RenderOptions& o) {
  return Json::array({o.slice_range.value().first, o.slice_range.value().second});
}
void read_window(const Json& j, RenderOptions& o) {
  const auto range = j.at("range").get<std::array<double, 2>>();
  o.slice_range = std::pair{range[0], range[1]};
}

/// What a mode has of its own.
Json mode_json(const RenderOptions& o) {
  Json json = {{"mode", mode_name(o.mode)}};
  if (o.mode == RenderMode::iso && !o.surfaces.empty()) {
    json["iso"] = o.surfaces.front().value;
    json["iso_rgb"] = o.surfaces.front().rgb;
    json["iso_opacity"] = o.surfaces.front().opacity;
  }
  if (o.mode == RenderMode::slice)
    json["slice"] = {
        {"axis", o.slice_axis}, {"position", o.slice_position.value()}, {"range", window_json(o)}};
  if (o.mode == RenderMode::integral) json["integral"] = {{"range", window_json(o)}};
  return json;
}

void read_mode(const Json& j, const std::filesystem::path& path, RenderOptions& o) {
  const auto name = j.at("mode").get<std::string>();
  const auto mode =
      std::find_if(kModes.begin(), kModes.end(), [&](const auto& m) { return name == m.first; });
  if (mode == kModes.end())
    throw FileError(fmt::format("{}: `picture.mode`: '{}' is none that is certified", path.string(), name));
  o.mode = mode->second;
  if (o.mode == RenderMode::iso)
    o.surfaces = {{j.at("iso").get<double>(), j.at("iso_opacity").get<double>(),
                   j.at("iso_rgb").get<std::array<double, 3>>()}};
  if (o.mode == RenderMode::integral) read_window(j.at("integral"), o);
  if (o.mode != RenderMode::slice) return;
  const Json& slice = j.at("slice");
  const std::int64_t axis = count_of(slice, "axis", path);
  if (axis < 0 || axis > 2)
    throw FileError(fmt::format("{}: `slice.axis`: {} is not 0, 1 or 2", path.string(), axis));
  o.slice_axis = static_cast<int>(axis);
  o.slice_position = slice.at("position").get<double>();
  read_window(slice, o);
}

Json picture_json(const CertifiedPicture& picture) {
  const RenderOptions& o = picture.options;
  Json overlays = Json::array();
  for (const std::string& name : picture.overlays) overlays.push_back(name);
  Json json = {{"file", picture.file},
               {"sha256", picture.pixels_sha256},
               {"file_sha256", picture.file_sha256},
               {"width", o.width},
               {"height", o.height},
               {"camera", camera_json(o.camera)},
               {"transfer", transfer_points(o.transfer)},
               {"background_top", o.background_top},
               {"background_bottom", o.background_bottom},
               {"step", o.step},
               {"classification", o.classification == Classification::post ? "post" : "preintegrated"},
               {"step_mode", text_of_steps(o.step_mode)},
               {"termination", o.termination},
               {"shading", o.shading},
               {"gradient", o.gradient == GradientKind::analytic ? "analytic"
                            : o.gradient == GradientKind::stored ? "stored"
                                                                 : "central"},
               {"head_light", o.head_light},
               {"lights", light_list(o.lights)},
               {"clip", clip_json(o.clip.value_or(Clip{}))},
               {"overlays", overlays}};
  json.update(mode_json(o));
  return json;
}

void read_picture(const Json& j, const std::filesystem::path& path, CertifiedPicture& picture) {
  RenderOptions& o = picture.options;
  read_mode(j, path, o);
  picture.file = j.at("file").get<std::string>();
  picture.pixels_sha256 = j.at("sha256").get<std::string>();
  picture.file_sha256 = j.at("file_sha256").get<std::string>();
  picture.overlays = j.at("overlays").get<std::vector<std::string>>();
  o.width = count_of(j, "width", path);
  o.height = count_of(j, "height", path);
  const Json& c = j.at("camera");
  o.camera.position = c.at("position").get<Vec3>();
  o.camera.focal_point = c.at("focal_point").get<Vec3>();
  o.camera.view_up = c.at("view_up").get<Vec3>();
  o.camera.view_angle_deg = c.at("view_angle_deg").get<double>();
  o.transfer.name = j.at("transfer").at("name").get<std::string>();
  for (const Json& p : j.at("transfer").at("points"))
    o.transfer.points.push_back({p.at("value").get<double>(), p.at("rgb").get<std::array<double, 3>>(),
                                 p.at("opacity").get<double>()});
  o.background_top = j.at("background_top").get<std::array<double, 3>>();
  o.background_bottom = j.at("background_bottom").get<std::array<double, 3>>();
  o.step = j.at("step").get<double>();
  o.classification = j.at("classification").get<std::string>() == "post" ? Classification::post
                                                                         : Classification::preintegrated;
  const auto steps = j.at("step_mode").get<std::string>();
  o.step_mode = steps == "level"      ? StepMode::level
                : steps == "adaptive" ? StepMode::adaptive
                                      : StepMode::fixed;
  o.termination = j.at("termination").get<double>();
  o.shading = j.at("shading").get<bool>();
  const auto gradient = j.at("gradient").get<std::string>();
  o.gradient = gradient == "analytic" ? GradientKind::analytic
               : gradient == "stored" ? GradientKind::stored
                                      : GradientKind::central;
  o.head_light = j.at("head_light").get<bool>();
  o.lights = j.at("lights").get<std::vector<Vec3>>();
  o.clip = clip_of(j.at("clip"));
}

/// Light of F has box steps alone, and the one pass has them too.
const char* text_of_step(const CertifiedPicture& picture) {
  return picture.certify.box || picture.certify.fast || picture.lit ? "box" : "joint";
}
/// Files without the member are older than joint steps.
bool is_box(const std::string& step, const std::filesystem::path& path) {
  if (step != "box" && step != "joint")
    throw FileError(fmt::format("{}: is no certificate of a picture: its step is '{}', neither box nor joint",
                                path.string(), step));
  return step == "box";
}

}  // namespace

std::string sha256_of_pixels(const Image& image) {
  Sha256 hash;
  hash.update(image.rgb.data(), image.rgb.size());
  return hash.hex();
}

const char* mode_name(RenderMode mode) {
  return std::find_if(kModes.begin(), kModes.end(), [&](const auto& m) { return m.second == mode; })->first;
}

std::array<double, 6> box_of(const std::optional<Clip>& clip) {
  const Clip c = clip.value_or(Clip{});
  return {c.low[0], c.low[1], c.low[2], c.high[0], c.high[1], c.high[2]};
}

std::string statement_of(RenderMode mode, CertifiedLight light) {
  if (mode == RenderMode::slice)
    return "In every pixel the grey of F at the pixel's middle differs from the drawn one by at most the "
           "bound "
           "of that pixel; what is not covered is absent.";
  if (mode == RenderMode::mip)
    return "In every pixel and channel the colour of the largest F on the ray through the pixel's middle, "
           "inside "
           "the covered region, differs from the drawn one by at most the bound of that pixel.";
  if (mode == RenderMode::integral)
    return "In every pixel the grey of the integral of F along the ray through the pixel's middle, inside "
           "the "
           "covered region, differs from the drawn one by at most the bound of that pixel.";
  if (mode == RenderMode::iso)
    return "F passes the value first, on the ray through a pixel's middle inside the covered region, in the "
           "pixel's band where the pixel is sure; nowhere where it is none; and not before the band's "
           "beginning "
           "where it is possible.";
  if (light == CertifiedLight::lit)
    return "In every pixel and channel the ideal picture, continuous emission and absorption over F under "
           "the "
           "light of F's own differences over one base cell, inside the covered region and half a base cell "
           "from "
           "its rim, differs from the drawn one by at most the bound of that pixel.";
  return fmt::format(
      "In every pixel and channel the ideal picture, continuous emission and absorption over F inside the "
      "covered region{}, differs from the drawn one by at most the bound of that pixel.",
      light == CertifiedLight::unlit ? ", without light"
                                     : ", under the light that V was drawn with, step by step");
}

Json bound_json(const PictureBound& b) {
  Json within = Json::object();
  for (const auto& [levels, share] : b.within) within[std::to_string(levels)] = share;
  return {
      {"levels", {{"mean", b.mean}, {"p99", b.p99}, {"max", b.max}, {"half_width_mean", b.half_width_mean}}},
      {"worst_pixel", b.worst},
      {"within", within},
      {"pixels",
       {{"certified", b.pixels - b.untested},
        {"certainly_background", b.background},
        {"untested", b.untested}}}};
}

Json surface_json(const SurfaceBounds& bounds, const std::string& unit) {
  double sum = 0;
  std::int64_t count = 0;
  for (const float band : band_of(bounds).values)
    if (!std::isnan(band)) {
      sum += static_cast<double>(band);
      ++count;
    }
  return {{"sure", bounds.share(2)},
          {"possible", bounds.share(1)},
          {"none", bounds.share(0)},
          {"band_mean", count > 0 ? sum / static_cast<double>(count) : 0},
          {"band_median", band_quantile(bounds, 0.5)},
          {"band_p99", band_quantile(bounds, 0.99)},
          {"unit", unit}};
}

Json half_widths_json(const FloatImage& low, const FloatImage& high, const std::vector<std::uint8_t>& met) {
  double sum = 0, most = 0;
  std::int64_t count = 0, untested = 0;
  for (std::size_t i = 0; i < low.values.size(); ++i) {
    const double half = 0.5 * (static_cast<double>(high.values[i]) - static_cast<double>(low.values[i]));
    if (std::isnan(half) || (!met.empty() && met[i] == 0)) continue;
    if (!std::isfinite(half)) {
      ++untested;
      continue;
    }
    sum += half;
    most = std::max(most, half);
    ++count;
  }
  return {{"half_width_mean", count > 0 ? sum / static_cast<double>(count) : 0},
          {"half_width_max", most},
          {"pixels", count},
          {"untested", untested}};
}

Json certificate_head(const CertifiedPicture& picture, const Certificate& certificate,
                      const std::string& statement) {
  return {{"format", kFormat},
          {"statement", statement},
          {"volume",
           {{"content_sha256", picture.content_sha256},
            {"epsilon", certificate.epsilon},
            {"epsilon_abs", certificate.epsilon_abs}}},
          {"picture", picture_json(picture)},
          {"covered",
           {{"radius", picture.covered.radius},
            {"z", Json::array({picture.covered.z.first, picture.covered.z.second})}}},
          {"sampler", picture.options.sampler == SamplerKind::image3d ? "image3d" : "buffer"},
          {"sampler_term", picture.sampler_term},
          {"kappa", picture.certify.kappa},
          {"theta", picture.certify.theta},
          {"fast", picture.certify.fast},
          {"step", text_of_step(picture)},
          {"device", picture.device},
          {"driver", picture.driver},
          {"device_test", picture.device_test},
          {"window", picture.certify.window ? Json(*picture.certify.window) : Json()}};
}

Json picture_certificate_json(const CertifiedPicture& picture, const PixelBounds& bounds,
                              const PictureBound& bound, const Certificate& certificate) {
  Json json = certificate_head(picture, certificate, statement_of(picture.options.mode, bounds.light));
  json["light"] = text_of(bounds.light);
  json["ray_offset_pixels"] = bounds.ray_offset_pixels;
  json["parts"] = bound.parts_mean;
  json.update(bound_json(bound));
  return json;
}

std::pair<CertifiedPicture, PictureClaims> read_picture_certificate(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(fmt::format("{}: cannot be read", path.string()));
  std::ostringstream text;
  text << in.rdbuf();
  try {
    const Json j = Json::parse(text.str());
    if (j.at("format").get<std::string>() != kFormat)
      throw FileError(
          fmt::format("{}: is no certificate of a picture that this program reads: its format is "
                      "'{}', not '{}'",
                      path.string(), j.at("format").get<std::string>(), kFormat));
    CertifiedPicture picture;
    read_picture(j.at("picture"), path, picture);
    picture.content_sha256 = j.at("volume").at("content_sha256").get<std::string>();
    picture.device = j.at("device").get<std::string>();
    picture.driver = j.at("driver").get<std::string>();
    picture.sampler_term = j.value("sampler_term", Json());
    if (!picture.sampler_term.is_null()) {  // for the errors of what lacks a member
      static_cast<void>(picture.sampler_term.at("value").get<double>());
      static_cast<void>(picture.sampler_term.at("sampler").get<std::string>());
    }
    picture.certify.kappa = j.at("kappa").get<double>();
    picture.certify.theta = j.at("theta").get<double>();
    picture.certify.fast = j.at("fast").get<bool>();
    picture.certify.box = is_box(j.value("step", "box"), path);
    picture.covered.radius = j.at("covered").at("radius").get<double>();
    const auto z = j.at("covered").at("z").get<std::array<double, 2>>();
    picture.covered.z = {z[0], z[1]};
    picture.options.sampler =
        j.at("sampler").get<std::string>() == "image3d" ? SamplerKind::image3d : SamplerKind::buffer;
    picture.lit = picture.options.mode == RenderMode::dvr && picture.options.shading &&
                  j.at("light").get<std::string>() == text_of(CertifiedLight::lit);
    if (picture.options.mode == RenderMode::iso)
      return {std::move(picture),
              PictureClaims{j.at("statement").get<std::string>(), "", 0, 0, {}, 0, j.at("iso")}};
    return {std::move(picture), PictureClaims{j.at("statement").get<std::string>(),
                                              j.at("light").get<std::string>(),
                                              j.at("levels").at("mean").get<double>(),
                                              j.at("levels").at("max").get<double>(),
                                              j.at("within").get<std::map<std::string, double>>(),
                                              count_of(j.at("pixels"), "certified", path),
                                              {}}};
  } catch (const Json::exception& e) {
    throw FileError(fmt::format("{}: is no certificate of a picture: {}", path.string(), e.what()));
  }
}

std::string bound_line(const PictureBound& b, const Certificate& certificate, CertifiedLight light) {
  std::string line = fmt::format(
      "certain: {:.0f} % of the pixels to 4 levels of 255, {:.0f} % to 8; mean {:.1f}, worst {:.1f}",
      100 * b.within[2].second, 100 * b.within[3].second, b.mean, b.max);
  // The bound is linear in epsilon (docs/pixel-bounds.md); under F's own light it is not, where any may fall.
  if (b.mean > 1 && light != CertifiedLight::lit)
    line += fmt::format("; certain to 1 level in the mean near epsilon {:.2g}", certificate.epsilon / b.mean);
  if (b.untested > 0) line += fmt::format("; {} pixels see bricks that were not tested", b.untested);
  return line;
}

}  // namespace vdvr::cli
