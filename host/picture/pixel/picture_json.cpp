#include "host/picture/pixel/picture_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/surface_picture.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::ordered_json;

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

constexpr std::array<std::pair<const char*, RenderMode>, 5> kModes{{{"dvr", RenderMode::dvr},
                                                                    {"iso", RenderMode::iso},
                                                                    {"mip", RenderMode::mip},
                                                                    {"slice", RenderMode::slice},
                                                                    {"integral", RenderMode::integral}}};

const char* mode_name(RenderMode mode) {
  return std::find_if(kModes.begin(), kModes.end(), [&](const auto& m) { return m.second == mode; })->first;
}

/// A real number of any size is no count: to convert it is undefined.
std::int64_t count_of(const Json& j, const char* name, const std::filesystem::path& path) {
  const Json& member = j.at(name);
  if (!member.is_number_integer())
    throw FileError(fmt::format("{}: `{}`: {} is no whole number", path.string(), name, member.dump()));
  return member.get<std::int64_t>();
}

std::pair<double, double> range_of(const Json& j, const char* name) {
  const auto ends = j.at(name).get<std::array<double, 2>>();
  return {ends[0], ends[1]};
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
        {"axis", o.slice_axis}, {"position", o.slice_position.value()}, {"range", o.slice_range.value()}};
  if (o.mode == RenderMode::integral) json["integral"] = {{"range", o.slice_range.value()}};
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
  if (o.mode == RenderMode::integral) o.slice_range = range_of(j.at("integral"), "range");
  if (o.mode != RenderMode::slice) return;
  const Json& slice = j.at("slice");
  const std::int64_t axis = count_of(slice, "axis", path);
  if (axis < 0 || axis > 2)
    throw FileError(fmt::format("{}: `slice.axis`: {} is not 0, 1 or 2", path.string(), axis));
  o.slice_axis = static_cast<int>(axis);
  o.slice_position = slice.at("position").get<double>();
  o.slice_range = range_of(slice, "range");
}

Json picture_json(const PictureRecord& record, const std::string& name, const std::string& sha256,
                  const PictureFile& file) {
  const RenderOptions& o = record.options;
  Json json = {{"file", name},
               {"sha256", record.pixels_sha256},
               {"file_sha256", sha256},
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
               {"lights", o.lights},
               {"clip", clip_json(o.clip.value_or(Clip{}))},
               {"overlays", file.overlays}};
  json.update(mode_json(o));
  if (file.band_at_white) json["band_at_white"] = *file.band_at_white;
  return json;
}

void read_picture(const Json& j, const std::filesystem::path& path, PictureRecord& record) {
  RenderOptions& o = record.options;
  read_mode(j, path, o);
  record.pixels_sha256 = j.at("sha256").get<std::string>();
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
const char* text_of_step(const PictureRecord& record) {
  return record.certify.box || record.certify.fast || record.lit ? "box" : "joint";
}
/// Files without the member are older than joint steps.
bool is_box(const std::string& step, const std::filesystem::path& path) {
  if (step != "box" && step != "joint")
    throw FileError(fmt::format("{}: is no certificate of a picture: its step is '{}', neither box nor joint",
                                path.string(), step));
  return step == "box";
}

/// How well values are known, in their own units, over the rays that have one: not those of NaN, nor those of
/// 0 in `met`, where it is not empty.
Json half_widths_json(const FloatImage& low, const FloatImage& high,
                      const std::vector<std::uint8_t>& met = {}) {
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

Json json_of(const PictureBound& b) {
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

Json json_of(const SurfaceShares& s, const std::string& unit) {
  return {{"sure", s.sure},
          {"possible", s.possible},
          {"none", s.none},
          {"band_mean", s.band_mean},
          {"band_median", s.band_median},
          {"band_p99", s.band_p99},
          {"unit", unit}};
}

SurfaceShares read_shares(const Json& j) {
  return {j.at("sure").get<double>(),      j.value("possible", 0.0),          j.at("none").get<double>(),
          j.at("band_mean").get<double>(), j.at("band_median").get<double>(), j.at("band_p99").get<double>()};
}

Json sampler_json(const std::optional<ChargedSampler>& s) {
  if (!s) return nullptr;
  return {{"sampler", s->sampler}, {"value", s->value}, {"method", s->method}};
}

std::optional<ChargedSampler> read_sampler(const Json& j) {
  if (j.is_null()) return std::nullopt;
  return ChargedSampler{j.at("sampler").get<std::string>(), j.at("value").get<double>(),
                        j.value("method", std::string())};
}

/// What certificates of all modes have.
Json certificate_head(const CertifiedPicture& picture, const Json& described) {
  const PictureRecord& r = picture.record;
  return {{"format", kFormat},
          {"statement", statement_of(r.options.mode, picture.bounds.light)},
          {"volume",
           {{"content_sha256", r.content_sha256},
            {"epsilon", picture.epsilon},
            {"epsilon_abs", picture.epsilon_abs}}},
          {"picture", described},
          {"covered", {{"radius", r.covered.radius}, {"z", r.covered.z}}},
          {"sampler", r.options.sampler == SamplerKind::image3d ? "image3d" : "buffer"},
          {"sampler_term", sampler_json(r.sampler)},
          {"kappa", r.certify.kappa},
          {"theta", r.certify.theta},
          {"fast", r.certify.fast},
          {"step", text_of_step(r)},
          {"device", r.device},
          {"driver", r.driver},
          {"device_test", r.device_test},
          {"window", r.certify.window ? Json(*r.certify.window) : Json()}};
}

PictureClaims read_claims(const Json& j, const std::filesystem::path& path, RenderMode mode) {
  PictureClaims claims;
  claims.file = j.at("picture").at("file").get<std::string>();
  claims.file_sha256 = j.at("picture").at("file_sha256").get<std::string>();
  claims.statement = j.at("statement").get<std::string>();
  if (mode == RenderMode::iso) {
    claims.iso = read_shares(j.at("iso"));
    return claims;
  }
  claims.light = j.at("light").get<std::string>();
  claims.mean = j.at("levels").at("mean").get<double>();
  claims.max = j.at("levels").at("max").get<double>();
  claims.within = j.at("within").get<std::map<std::string, double>>();
  claims.certified = count_of(j.at("pixels"), "certified", path);
  return claims;
}

PictureRecord read_record(const Json& j, const std::filesystem::path& path) {
  PictureRecord record;
  RenderOptions& o = record.options;
  read_picture(j.at("picture"), path, record);
  record.content_sha256 = j.at("volume").at("content_sha256").get<std::string>();
  record.device = j.at("device").get<std::string>();
  record.driver = j.at("driver").get<std::string>();
  record.sampler = read_sampler(j.value("sampler_term", Json()));
  record.certify.kappa = j.at("kappa").get<double>();
  record.certify.theta = j.at("theta").get<double>();
  record.certify.fast = j.at("fast").get<bool>();
  record.certify.box = is_box(j.value("step", "box"), path);
  record.covered.radius = j.at("covered").at("radius").get<double>();
  record.covered.z = range_of(j.at("covered"), "z");
  o.sampler = j.at("sampler").get<std::string>() == "image3d" ? SamplerKind::image3d : SamplerKind::buffer;
  record.lit = o.mode == RenderMode::dvr && o.shading &&
               j.at("light").get<std::string>() == text_of(CertifiedLight::lit);
  return record;
}

}  // namespace

std::string sha256_of_pixels(const Image& image) {
  Sha256 hash;
  hash.update(image.rgb.data(), image.rgb.size());
  return hash.hex();
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

std::string bound_json(const PictureBound& bound) { return json_of(bound).dump(); }

SurfaceShares shares_of(const SurfaceBounds& bounds) {
  double sum = 0;
  std::int64_t count = 0;
  for (const float band : band_of(bounds).values)
    if (!std::isnan(band)) {
      sum += static_cast<double>(band);
      ++count;
    }
  return {bounds.share(2),
          bounds.share(1),
          bounds.share(0),
          count > 0 ? sum / static_cast<double>(count) : 0,
          band_quantile(bounds, 0.5),
          band_quantile(bounds, 0.99)};
}

std::string surface_json(const SurfaceBounds& bounds, const std::string& unit) {
  return json_of(shares_of(bounds), unit).dump();
}

std::string picture_certificate_json(const CertifiedPicture& picture, const std::string& name,
                                     const std::string& sha256, const PictureFile& file) {
  const RenderMode mode = picture.record.options.mode;
  Json json = certificate_head(picture, picture_json(picture.record, name, sha256, file));
  if (mode == RenderMode::iso) {
    json["iso"] = json_of(shares_of(picture.surface), picture.unit);
    return json.dump(2);
  }
  json["light"] = text_of(picture.bounds.light);
  json["ray_offset_pixels"] = picture.bounds.ray_offset_pixels;
  json["parts"] = picture.bound.parts_mean;
  json.update(json_of(picture.bound));
  if (mode == RenderMode::mip) json["mip"] = half_widths_json(picture.maxima.low, picture.maxima.high);
  if (mode == RenderMode::integral)
    json["integral"] = half_widths_json(picture.integrals.low, picture.integrals.high, picture.integrals.met);
  return json.dump(2);
}

std::pair<PictureRecord, PictureClaims> read_picture_certificate(const std::filesystem::path& path) {
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
    PictureRecord record = read_record(j, path);
    PictureClaims claims = read_claims(j, path, record.options.mode);
    return {std::move(record), std::move(claims)};
  } catch (const Json::exception& e) {
    throw FileError(fmt::format("{}: is no certificate of a picture: {}", path.string(), e.what()));
  }
}

std::string bound_line(const PictureBound& b, double epsilon, CertifiedLight light) {
  std::string line = fmt::format(
      "certain: {:.0f} % of the pixels to 4 levels of 255, {:.0f} % to 8; mean {:.1f}, worst {:.1f}",
      100 * b.within[2].second, 100 * b.within[3].second, b.mean, b.max);
  // The bound is linear in epsilon (docs/pixel-bounds.md); under F's own light it is not, where any may fall.
  if (b.mean > 1 && light != CertifiedLight::lit)
    line += fmt::format("; certain to 1 level in the mean near epsilon {:.2g}", epsilon / b.mean);
  if (b.untested > 0) line += fmt::format("; {} pixels see bricks that were not tested", b.untested);
  return line;
}

}  // namespace vdvr
