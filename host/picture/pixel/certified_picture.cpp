// Draws a picture so finely that little of its bound is the drawing's, certifies it, and writes both.
#include "vdvr/certified_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "host/picture/pixel/picture_json.hpp"
#include "host/picture/render/check_render_options.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/safe_sampler.hpp"
#include "vdvr/expert/stop.hpp"
#include "vdvr/expert/surface_picture.hpp"
#include "vdvr/expert/trust.hpp"

namespace fs = std::filesystem;

namespace vdvr {
namespace {

constexpr double finest = 1.0 / 32;  // base cells

// --- what is certified ---

bool is_by_ray(RenderMode mode) {
  return mode == RenderMode::iso || mode == RenderMode::mip || mode == RenderMode::integral;
}

/// Numbers that somebody changed, or that do not follow from each other, promise nothing.
void check_file(const VdvrFile& file) {
  if (!file.altered.empty()) throw MismatchError("nothing is certain of an altered volume: " + file.altered);
  if (file.certificate.comparison) return;  // check_certificate() says it better
  if (const std::string wrong = contradiction(file.certificate); !wrong.empty())
    throw MismatchError("the certificate contradicts itself: " + wrong);
}

void check_certificate(const Certificate& c, const PictureRequest& request) {
  const RenderOptions& o = request.options;
  const bool known = o.mode == RenderMode::dvr || o.mode == RenderMode::slice || is_by_ray(o.mode);
  if (!known || o.output != RenderOutput::colour)
    throw InputError("pictures of `mode` dvr, iso, mip, integral and slice are certified, of their colours");
  if (o.mode == RenderMode::iso && o.surfaces.size() != 1)
    throw InputError(fmt::format("one surface at a time is certified, not {}", o.surfaces.size()));
  if (c.comparison) throw InputError("the volume is for comparison and certifies nothing; build it without");
  if (!c.window || is_by_ray(o.mode)) return;  // CertifiedRays refuses a window itself
  const std::string within = fmt::format("the volume was certified within `window` {:.6g},{:.6g}",
                                         c.window->first, c.window->second);
  if (request.lit)
    throw InputError(within +
                     "; differences of F across its ends are unknown, and so is its light: take "
                     "`certify_light` as-drawn, or build without `window`");
  if (o.mode == RenderMode::slice)
    throw InputError(within +
                     "; where F lies outside of it is unknown, so that no pixel of a slice is known: build "
                     "without `window`");
  if (!is_clear_outside(o.transfer, *c.window))
    throw InputError(
        within +
        ", outside of which F is unknown, and the transfer function shows values there: name one "
        "by `tf` whose opacity is 0 below and above the window, or build without `window`");
}

Clip covered_part(const Certificate& here, const PictureRequest& request) {
  const auto covered = here.covered ? here.covered : request.covered;
  if (!covered)
    throw InputError(
        "the volume does not say where it is covered: what a single row covers has no height, and earlier "
        "versions "
        "did not say; of the latter name the scan by `covered_from`, or build it again");
  return certified_part(*covered, here);
}

/// A part of what is covered is a box of it, or the covered cylinder itself.
void check_part(const RenderOptions& o) {
  check_options(o);
  if (o.clip && (o.clip->axis[0] != 0 || o.clip->axis[1] != 0))
    throw InputError(
        "`clip`: a certified picture is of a box within the covered region, about no other axis");
}

/// Of what is drawn, what lies where F's differences are known.
void cut_to_differences(Clip& clip, const Clip& covered, const Grid& grid) {
  const Clip inside = inside_of_differences(covered, grid);
  for (std::size_t a = 0; a < 3; ++a)
    if (!(inside.low[a] < inside.high[a]))
      throw InputError(
          fmt::format("`certify_light` lit: light of F needs half a base cell to either side, and along {} "
                      "no more than one "
                      "cell is covered: take `certify_light` as-drawn",
                      "xyz"[a]));
  cut_to(clip, inside);
}

// --- how finely it is drawn ---

/// One picture of mode dvr or slice, and what it takes to make it.
struct Drawing {
  DrawnVolume& volume;
  const Certificate& here;
  const PictureRequest& request;
  Clip covered;
  const Progress& progress;

  [[nodiscard]] RenderResult drawn(const RenderOptions& o) const {
    throw_if_stopped();
    report(progress, "draw", 0);
    return volume.draw(o, progress);
  }
  [[nodiscard]] PixelBounds bounds(const PictureRecord& record, const RenderOptions& o) const {
    throw_if_stopped();
    report(progress, "certify", 0);
    if (record.lit)
      return certify_lit_pixels(volume.volume(), brick_bounds(here, false), covered, volume.value_range(), o,
                                record.certify, progress);
    return volume.certify(brick_bounds(here, volume.sampler(o.sampler) == SamplerKind::image3d), o,
                          record.certify, progress);
  }
};

/// Of pixels that show something, levels of 255.
struct Shown {
  double bound = 0, half_width = 0;  ///< means
  double worst = 0;
};
Shown shown_of(const PixelBounds& b, const Image& image) {
  const PictureBound bound = bound_of_picture(b, image);
  Shown shown;
  double pixels = 0;
  for (std::size_t i = 0; i < b.parts.size(); ++i) {
    if (b.parts[i] == 0) continue;
    double width = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      width = std::max(width, std::clamp(static_cast<double>(b.hi.values[c]), 0.0, 1.0) -
                                  std::clamp(static_cast<double>(b.lo.values[c]), 0.0, 1.0));
    shown.bound += static_cast<double>(bound.levels.values[i]);
    shown.half_width += 255 * width / 2;
    ++pixels;
  }
  shown.bound /= std::max(1.0, pixels);
  shown.half_width /= std::max(1.0, pixels);
  shown.worst = bound.max;
  return shown;
}

/// A byte rounds by half a level, a quarter of what F leaves open is hardly seen beside it, and where F
/// leaves open more than the drawing is ever off, nothing is to be gained.
bool is_much(const Shown& s, const std::optional<double>& tolerance) {
  constexpr double byte = 0.5, coarse_drawing = 8;  // levels
  return (s.half_width < coarse_drawing && s.bound - s.half_width > std::max(byte, s.half_width / 4)) ||
         (tolerance && s.worst > *tolerance);
}

bool is_better(const Shown& s, const Shown& before, const std::optional<double>& tolerance) {
  return s.bound < 0.9 * before.bound ||
         (tolerance && before.worst > *tolerance && s.worst < 0.95 * before.worst);
}

/// Draws with half the step as long as the picture is much of its bound and that helps. Intervals of light as
/// drawn depend on the step and are made each time.
void draw_finer(const Drawing& drawing, CertifiedPicture& made) {
  const bool as_drawn = made.bounds.light == CertifiedLight::as_drawn;
  const auto& tolerance = drawing.request.tolerance;
  RenderOptions& o = made.record.options;
  Shown shown = shown_of(made.bounds, made.drawn.image);
  while (o.step > finest && is_much(shown, tolerance)) {
    RenderOptions finer = o;
    finer.step = o.step / 2;
    RenderResult drawn = drawing.drawn(finer);
    PixelBounds bounds;
    if (as_drawn) bounds = drawing.bounds(made.record, finer);
    drawn.seconds += made.drawn.seconds;
    bounds.seconds += made.bounds.seconds;
    const Shown next = shown_of(as_drawn ? bounds : made.bounds, drawn.image);
    if (!is_better(next, shown, tolerance)) break;
    made.drawn = std::move(drawn);
    if (as_drawn) made.bounds = std::move(bounds);
    shown = next;
    o.step = finer.step;
  }
}

void draw_colours(const Drawing& drawing, CertifiedPicture& made) {
  PictureRecord& record = made.record;
  RenderOptions& o = record.options;
  const PictureRequest& request = drawing.request;
  if (record.lit) cut_to_differences(*o.clip, drawing.covered, drawing.volume.volume().grid);
  record.certify = request.certify;
  record.certify.window = drawing.here.window;
  record.certify.theta = ending_share(request.certify.theta, brick_bounds(drawing.here, false), o.transfer);
  if (!request.keep_steps) {
    o.classification = Classification::preintegrated;
    o.step_mode = StepMode::fixed;  // a pre-integrated table is of one step
  }
  o.termination = 1 - record.certify.theta;
  if (o.gradient == GradientKind::automatic) o.gradient = GradientKind::central;
  // First what needs more memory: where it is too little, the error says how much would do for both.
  made.bounds = drawing.bounds(record, o);
  made.drawn = drawing.drawn(o);
  if (!request.keep_steps) draw_finer(drawing, made);
}

void draw_slice(const Drawing& drawing, CertifiedPicture& made) {
  RenderOptions& o = made.record.options;
  const Grid& g = drawing.volume.volume().grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  if (!o.slice_position)
    o.slice_position = g.origin[axis] + 0.5 * static_cast<double>(g.cells[axis]) * g.spacing[axis];
  made.record.certify = drawing.request.certify;
  made.record.certify.window = drawing.here.window;
  made.drawn = drawing.drawn(o);
  made.bounds = certify_slice(drawing.volume.volume(), drawing.here, o, drawing.progress);
  clear_absent(made.drawn.image, made.bounds);
}

/// Surfaces, maxima and integrals: ray by ray on the host.
void draw_rays(const Drawing& drawing, CertifiedPicture& made) {
  RenderOptions& o = made.record.options;
  made.record.certify.window = drawing.here.window;
  made.drawn = drawing.drawn(o);
  const CertifiedRays rays(drawing.volume.volume(), drawing.here, false, box_of(o.clip));
  if (o.mode == RenderMode::iso) {
    if (made.drawn.gradient != GradientKind::automatic) o.gradient = made.drawn.gradient;
    made.surface = rays.surface(o.camera, o.width, o.height, o.surfaces.front().value, drawing.progress);
  } else if (o.mode == RenderMode::mip) {
    made.maxima = rays.maximum(o.camera, o.width, o.height, drawing.progress);
    made.bounds = colours_of_maxima(made.maxima, o);
  } else {
    if (!o.slice_range) o.slice_range = range_of_values(made.drawn.values);
    made.integrals = rays.integral(o.camera, o.width, o.height, drawing.progress);
    made.bounds = greys_of_integrals(made.integrals, o);
  }
  throw_if_stopped();
}

}  // namespace

std::optional<ChargedSampler> charged_sampler(const Certificate& certificate, bool image3d) {
  const SamplerTerms& terms = certificate.budget.sampler;
  if (!image3d) return ChargedSampler{"buffer", terms.buffer.value, terms.buffer.method};
  if (!terms.image3d) return std::nullopt;
  float largest = 0;
  for (const float term : terms.image3d_by_brick) largest = std::max(largest, term);
  return ChargedSampler{"image3d", static_cast<double>(largest), terms.image3d->method};
}

Clip certified_part(const CoveredCylinder& covered, const Certificate& certificate) {
  Clip clip;
  clip.radius = covered.radius;
  clip.low[2] = covered.z.first;
  clip.high[2] = covered.z.second;
  if (certificate.roi) {
    const std::array<double, 6>& r = *certificate.roi;
    for (std::size_t a = 0; a < 3; ++a) {
      clip.low[a] = std::max(clip.low[a], r[a]);
      clip.high[a] = std::min(clip.high[a], r[a + 3]);
    }
  }
  return clip;
}

void cut_to(Clip& clip, const Clip& other) {
  clip.radius = std::min(clip.radius, other.radius);
  for (std::size_t a = 0; a < 3; ++a) {
    clip.low[a] = std::max(clip.low[a], other.low[a]);
    clip.high[a] = std::min(clip.high[a], other.high[a]);
    const double reach = a < 2 ? clip.radius : std::numeric_limits<double>::infinity();
    if (!(std::max(clip.low[a], -reach) < std::min(clip.high[a], reach)))
      throw InputError(fmt::format("`clip`: the box holds nothing of the covered region along {}", "xyz"[a]));
  }
}

CertifiedPicture certify_picture(DrawnVolume& volume, const Certificate& here, const PictureRequest& request,
                                 const Progress& progress) {
  for (Device* device : volume.devices()) require_trusted(*device, "certifying a picture");
  check_certificate(here, request);
  const Clip covered = covered_part(here, request);
  CertifiedPicture made;
  PictureRecord& record = made.record;
  record.options = request.options;
  record.lit = request.lit && record.options.mode == RenderMode::dvr && record.options.shading;
  record.covered = {covered.radius, {covered.low[2], covered.high[2]}};
  if (record.options.mode != RenderMode::slice) {
    check_part(request.options);
    record.options.clip = covered;
    cut_to(*record.options.clip, request.options.clip.value_or(Clip{}));
  }
  const Drawing drawing{volume, here, request, covered, progress};
  if (record.options.mode == RenderMode::dvr) draw_colours(drawing, made);
  else if (record.options.mode == RenderMode::slice) draw_slice(drawing, made);
  else draw_rays(drawing, made);

  record.options.sampler = made.drawn.sampler;
  // All but unlit and drawn light are certified on the host.
  const bool by_image3d =
      record.options.mode == RenderMode::dvr && !record.lit && made.bounds.sampler == SamplerKind::image3d;
  record.sampler = charged_sampler(here, by_image3d);
  record.content_sha256 = here.content_sha256;
  record.pixels_sha256 = sha256_of_pixels(made.drawn.image);
  Device& device = *volume.devices().front();
  record.device = device.info().name;
  record.driver = device.info().driver;
  record.device_test = test_of(device).names();
  if (record.options.mode != RenderMode::iso) made.bound = bound_of_picture(made.bounds, made.drawn.image);
  made.epsilon = here.epsilon;
  made.epsilon_abs = here.epsilon_abs;
  made.unit = volume.volume().grid.unit;
  return made;
}

CertifiedPicture certify_picture(Device& device, const VdvrFile& file, const PictureRequest& request,
                                 const Progress& progress) {
  check_file(file);
  DrawnVolume volume({&device}, file.volume, progress);
  PictureRequest safe = request;
  if (volume.by_bricks()) safe.options.sampler = volume.sampler(request.options.sampler);
  const SafeSampler sampler = safe_sampler(device, file.volume, file.certificate, safe.options.sampler);
  safe.options.sampler = sampler.sampler;
  return certify_picture(volume, sampler.certificate.value_or(file.certificate), safe, progress);
}

std::vector<fs::path> beside_picture(const fs::path& picture, RenderMode mode) {
  std::vector<fs::path> paths{picture, picture};
  paths[0].replace_extension(".certificate.json");
  paths[1].replace_extension(".bound.png");
  if (mode == RenderMode::iso) paths.pop_back();
  return paths;
}

std::string write_certified_picture(const fs::path& path, const CertifiedPicture& picture,
                                    const PictureFile& file) {
  const RenderMode mode = picture.record.options.mode;
  const std::vector<fs::path> beside = beside_picture(path, mode);
  if (!file.write && path.extension() != ".png")
    throw InputError(fmt::format("{}: give a certified picture a name that ends in .png", path.string()));
  PictureFile shown = file;
  if (mode == RenderMode::iso && shown.overlays.empty()) shown.overlays = {"stripes over possible hits"};
  io::AtomicFiles files;
  const fs::path part = files.add(path), certificate = files.add(beside.front());
  if (shown.write) {
    shown.write(part);
  } else {
    Image image = picture.drawn.image;
    if (mode == RenderMode::iso) hatch_possible(image, picture.surface);
    write_png(part, image);
  }
  if (mode != RenderMode::iso)
    write_png(files.add(beside.back()), picture_of_bound(picture.bound, picture.bounds));
  std::string json = picture_certificate_json(picture, path.filename().string(), sha256_of_file(part), shown);
  io::write_file(certificate, json + "\n");
  files.commit();
  return json;
}

}  // namespace vdvr
