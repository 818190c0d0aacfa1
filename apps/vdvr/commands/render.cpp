// vdvr render: a picture, the values behind it, or a turntable.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify_options.hpp"
#include "apps/vdvr/certify_render.hpp"
#include "apps/vdvr/clip.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/frames.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/overlay.hpp"
#include "apps/vdvr/render_options.hpp"
#include "apps/vdvr/sampler_json.hpp"
#include "apps/vdvr/source.hpp"
#include "apps/vdvr/view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/animation.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/trust.hpp"
#include "vdvr/expert/volume_file.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::cli {
namespace {

// Twenty pictures a second: a turn of 60 takes three.
constexpr int kFrameMs = 50;

void write_error_slice(const std::filesystem::path& output, OutputKind kind, const ErrorSlice& slice) {
  if (kind == OutputKind::values) write_npy(output, slice.errors);
  else write_png(output, slice.image);
}

int print_in_sigma(const CommonOptions& common, const std::filesystem::path& output, const ErrorSlice& slice,
                   const Certificate& certificate, BrickQuantity quantity) {
  const bool is_sigma = quantity == BrickQuantity::sigma;
  const NoiseRecord& noise = *certificate.noise;
  const Json json = {{"output", output.string()},
                     {"mode", "error"},
                     {is_sigma ? "sigma" : "bound_in_sigma", slice.max_error},
                     {"median_sigma", noise.median},
                     {"noise_source", noise.source},
                     {"tolerance_sigmas", noise.tolerance_sigmas ? Json(*noise.tolerance_sigmas) : Json()},
                     {"pixels", slice.pixels}};
  print_result(common, json, [&] {
    if (is_sigma)
      fmt::print("{}: sigma of F is up to {:.6g} on {} pixels, by an estimate from {}\n", output.string(),
                 slice.max_error, slice.pixels, noise.source);
    else
      fmt::print(
          "{}: |V - F| is at most {:.4g} sigma on {} pixels, where covered; sigma is an estimate, from {}\n",
          output.string(), slice.max_error, slice.pixels, noise.source);
  });
  return 0;
}

/// What the certificate alone says of a slice, but for a texture unit, which the device must tell.
int render_bound(const CommonOptions& common, const RenderOptions& o, const std::filesystem::path& output,
                 OutputKind kind, const Scene& scene, const ErrorSliceOptions& options,
                 BrickQuantity quantity) {
  const bool image3d = o.sampler == SamplerKind::image3d;
  const auto on_device = [&] {
    Device device = open_device(common);
    require_trusted(device, "bounding a slice");
    return certificate_on(device, scene.volume, *scene.certificate);
  };
  const Certificate certificate = image3d ? on_device() : *scene.certificate;
  const ErrorSlice slice = bound_slice(scene.volume, certificate, image3d, options, quantity);
  write_error_slice(output, kind, slice);
  if (quantity != BrickQuantity::bound) return print_in_sigma(common, output, slice, certificate, quantity);
  const double epsilon = certificate.epsilon_abs;
  const Json json = {{"output", output.string()},
                     {"mode", "error"},
                     {"bound", slice.max_error},
                     {"epsilon_abs", epsilon},
                     {"sampler", image3d ? "image3d" : "buffer"},
                     {"sampler_term", sampler_term_json(certificate, image3d)},
                     {"pixels", slice.pixels},
                     {"not_covered_fraction", scene.certificate->not_covered_fraction}};
  print_result(common, json, [&] {
    fmt::print(
        "{}: |V - F| is at most {:.6g} on {} pixels, {:.1f} % of epsilon {:.6g}, by the certificate\n"
        "  not covered  {:.3g} % of the samples, which the file does not tell apart; --projections does\n",
        output.string(), slice.max_error, slice.pixels, 100 * slice.max_error / epsilon, epsilon,
        100 * scene.certificate->not_covered_fraction);
  });
  return 0;
}

int render_error(const Arguments& args, const CommonOptions& common, const RenderOptions& o,
                 const std::filesystem::path& output, OutputKind kind) {
  const auto path = args.path("FILE");
  ProgressLine progress(args.who(), common.quiet);
  const Scene scene = open_scene(path, args, "vdvr", false);
  if (!scene.certificate)
    throw InputError(fmt::format("{}: has no certificate to measure against", path.string()));
  const Grid& g = scene.volume.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  const double middle = g.origin[axis] + 0.5 * static_cast<double>(g.cells[axis]) * g.spacing[axis];
  // Values have no frame: the slice alone has the size asked for.
  const bool framed = kind == OutputKind::picture && !args.has("plain");
  const ErrorSliceOptions options{o.slice_axis, o.slice_position.value_or(middle), o.width, o.height, framed};
  if (!args.has("projections"))
    return render_bound(common, o, output, kind, scene, options, brick_quantity(args));
  const auto projections = args.path("projections");
  const ProjectionSet scan = load_certified_scan(projections, args, *scene.certificate, progress.callback());
  check_projections(projections, scan, *scene.certificate);
  Device device = open_device(common);
  const ErrorSlice slice =
      error_slice(device, scan, scene.volume, *scene.certificate, options, progress.callback());
  throw_if_stopped();
  write_error_slice(output, kind, slice);
  progress.clear();
  const double epsilon = scene.certificate->epsilon_abs;
  const Json json = {{"output", output.string()},    {"mode", "error"},
                     {"max_error", slice.max_error}, {"epsilon_abs", epsilon},
                     {"worst_at", slice.worst_at},   {"pixels", slice.pixels}};
  print_result(common, json, [&] {
    fmt::print("{}: largest |V - F| on {} pixels is {:.6g}, {:.1f} % of epsilon {:.6g}\n", output.string(),
               slice.pixels, slice.max_error, 100 * slice.max_error / epsilon, epsilon);
  });
  return 0;
}

/// What a turntable needs beside its frames.
struct Stage {
  Source& source;
  const Overlay& overlay;
  bool certified;
  OrbitFrame frame;

  [[nodiscard]] RenderResult draw(const RenderOptions& o) const {
    return render_with_overlay(source, o, overlay, certified);
  }
};

/// Frame `f` of a turn of `frames`.
RenderResult draw_frame(const Arguments& args, const Stage& stage, RenderOptions o, std::int64_t f,
                        std::int64_t frames, const Progress& progress) {
  report(progress, "turntable", static_cast<double>(f) / static_cast<double>(frames));
  Orbit orbit = orbit_options(args, kRenderOrbit);
  orbit.azimuth += 360.0 * static_cast<double>(f) / static_cast<double>(frames);
  o.camera = camera_for(args, stage.frame, orbit);
  return stage.draw(o);
}

/// The words of a command but for those that do not change its pictures, and what they are pictures of.
std::string key_of(const Arguments& args, const Scene& scene) {
  static const std::vector<std::string> flags{"--force", "--resume", "--quiet", "--json"};
  static const std::vector<std::string> values{"--device",  "--max-memory", "--scratch",
                                               "--give-up", "--output",     "-o"};
  const auto is_in = [](const std::vector<std::string>& list, const std::string& word) {
    return std::find(list.begin(), list.end(), word.substr(0, word.find('='))) != list.end();
  };
  Json words = Json::array();
  const auto& all = args.words();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_in(flags, all[i])) continue;
    if (!is_in(values, all[i])) words.push_back(all[i]);
    else if (all[i].find('=') == std::string::npos) ++i;
  }
  const Json key = {{"version", VDVR_VERSION},
                    {"command", words},
                    {"content_sha256", scene.verified && scene.certificate ? scene.certificate->content_sha256
                                                                           : content_sha256(scene.volume)}};
  return key.dump(1) + "\n";
}

struct Turned {
  RenderResult last;
  FramesDrawn frames;
};

Turned turn_into_folder(const Arguments& args, const CommonOptions& common, const Stage& stage,
                        const RenderOptions& o, std::int64_t frames, const Progress& progress) {
  const Scene& scene = stage.source.scene();
  FramesOptions options{
      args.path("output"), frames, common.force, args.has("resume"), scene.certificate.has_value(),
      key_of(args, scene)};
  Turned turned;
  const auto draw = [&](std::int64_t f, const std::filesystem::path& path) {
    turned.last = draw_frame(args, stage, o, f, frames, progress);
    write_png(path, turned.last.image);
  };
  turned.frames = draw_frames(options, draw, [&](OutputFolder& folder) {
    if (scene.certificate) folder.finish(to_json(*scene.certificate));
  });
  return turned;
}

RenderResult turn_into_file(const Arguments& args, const CommonOptions& common, const Stage& stage,
                            const RenderOptions& o, std::int64_t frames, OutputKind kind,
                            const Progress& progress) {
  // Palette and encoder want all frames together.
  const double bytes =
      3.0 * static_cast<double>(o.width) * static_cast<double>(o.height) * static_cast<double>(frames);
  const double limit = common.max_memory != 0 ? static_cast<double>(common.max_memory) : 0x1p32;
  if (bytes > limit)
    throw ResourceError(fmt::format(
        "{} frames need {:.0f} MiB together; take fewer, a smaller --size, or a folder as the output", frames,
        bytes / (1 << 20)));
  std::vector<Image> images;
  RenderResult last;
  for (std::int64_t f = 0; f < frames; ++f) {
    last = draw_frame(args, stage, o, f, frames, progress);
    images.push_back(last.image);
  }
  report(progress, "encode", 0);
  if (kind == OutputKind::gif) write_gif(args.path("output"), images, kFrameMs);
  else write_apng(args.path("output"), images, kFrameMs);
  return last;
}

Json transfer_json(const TransferFunction& f) {
  return {{"name", f.name}, {"range", {f.points.front().value, f.points.back().value}}, {"note", f.note}};
}

/// What was asked for lies beside the volume, so that the picture shows nothing of it.
std::vector<std::string> notes_on(const Arguments& args, const RenderOptions& o, const Source& source) {
  std::vector<std::string> notes;
  if (o.mode == RenderMode::iso) {
    const auto [lo, hi] = source.value_range();
    for (const IsoSurface& s : o.surfaces)
      if (!(s.value >= static_cast<double>(lo) && s.value <= static_cast<double>(hi)))
        notes.push_back(fmt::format(
            "--iso {:.6g} lies outside of the volume's values, {:.6g} to {:.6g}: no surface is there",
            s.value, lo, hi));
  }
  const Grid& g = source.scene().volume.grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const double low = g.origin[a], high = low + static_cast<double>(g.cells[a]) * g.spacing[a];
    if (args.has("clip") && o.clip && !(o.clip->low[a] < high && o.clip->high[a] > low))
      notes.push_back(
          fmt::format("--clip lies outside of the volume along {}, {:.6g} to {:.6g}: nothing is there",
                      "xyz"[a], low, high));
  }
  return notes;
}

/// One picture, or the values behind it.
RenderResult draw_one(const Stage& stage, const RenderOptions& o, const std::filesystem::path& output,
                      OutputKind kind) {
  if (kind == OutputKind::picture) {
    RenderResult result = stage.draw(o);
    throw_if_stopped();
    write_png(output, result.image);
    return result;
  }
  RenderResult result = stage.source.draw(o);
  throw_if_stopped();
  write_npy(output, result.values);
  return result;
}

/// What the command makes of its words.
struct Request {
  RenderOptions options;
  Overlay overlay;
  std::filesystem::path output;
  OutputKind kind = OutputKind::picture;
  bool turntable = false;
  std::int64_t frames = 1;
  std::string method;
};

/// Throws InputError for whatever can be refused before anything is read.
Request request_of(const Arguments& args, const CommonOptions& common) {
  Request a;
  a.options = render_options(args);
  check_combination(args, a.options);
  a.overlay = overlay_options(args, a.options.mode);
  a.output = args.path("output");
  a.turntable = args.has("turntable");
  a.frames = args.integer_or("turntable", 1, 1, 9999);
  a.kind = output_kind(a.output, a.turntable);
  if (a.kind == OutputKind::values)
    refuse(args, {"axes", "box", "colorbar", "caption", "plain"}, "is of pictures, not of values");
  if (a.kind != OutputKind::folder)
    refuse(args, {"resume", "give-up"}, "is of a turntable in a folder, whose frames are kept");
  give_up_option(args);
  const auto volume = file_of_volume(args.path("FILE"));
  if (a.kind != OutputKind::folder) check_output(a.output, common.force, {volume});
  if (asks_certify(args))
    for (const auto& beside : beside_picture(a.output, a.options.mode))
      check_output(beside, common.force, {volume});
  a.method = method_option(args);
  return a;
}

/// What was drawn, for its words and its JSON.
struct Drawn {
  RenderOptions options;
  std::string method;
  SafeSampler safe;
  RenderResult result;
  FramesDrawn turned{1, 0};
  std::optional<CertifiedRender> made;
  std::vector<std::string> notes;
  bool certified = false;
  [[nodiscard]] bool of_integrals() const { return options.mode == RenderMode::integral; }
  [[nodiscard]] bool has_transfer() const {
    return options.mode == RenderMode::dvr || options.mode == RenderMode::mip;
  }
  [[nodiscard]] const std::string& sampler_reason() const {
    return safe.reason.empty() ? result.sampler_reason : safe.reason;
  }
};

bool is_comparison(const Scene& scene) { return scene.certificate && scene.certificate->comparison; }

/// What depends on the volume. Returns what the camera turns about.
OrbitFrame look_at_volume(const Arguments& args, Source& source, Drawn& drawn, const Progress& progress) {
  const Scene& scene = source.scene();
  RenderOptions& o = drawn.options;
  const Brightness bright = brightness_of(scene.volume);
  o.surfaces = surfaces_for(args, bright.threshold);
  // Of integrals it says what is framed, and --tf-range is no range of densities.
  o.transfer =
      drawn.of_integrals() ? two_material_transfer(bright) : transfer_for(args, bright, scene.volume.grid);
  o.slice_range = given_range(args);
  if (!o.slice_range && !drawn.of_integrals()) o.slice_range = std::pair{bright.grey_lo, bright.grey_hi};
  drawn.safe = source.take_sampler(o.sampler, args.has("unverified"));
  o.sampler = drawn.safe.sampler;
  const Orbit orbit = orbit_options(args, kRenderOrbit);
  const OrbitFrame frame = frame_for(args, scene.volume, o, orbit);
  o.camera = camera_for(args, frame, orbit);
  o.clip = clip_for(args, scene, progress);
  o.skip_empty = !args.has("no-skip");
  source.show(brick_quantity(args));
  drawn.notes = notes_on(args, o, source);
  // The base samples alone are another field than the one certified.
  drawn.certified = scene.verified && drawn.method == "vdvr" && !is_comparison(scene) && source.trusted();
  return frame;
}

/// A turn or one picture, into the output.
void draw_asked(const Arguments& args, const CommonOptions& common, const Request& asked, const Stage& stage,
                Drawn& drawn, const Progress& progress) {
  RenderOptions& o = drawn.options;
  // All frames have the window of the first.
  if (drawn.of_integrals() && asked.turntable && !o.slice_range)
    o.slice_range = range_of_values(stage.source.draw(o).values);
  if (asked.kind == OutputKind::folder) {
    Turned all = turn_into_folder(args, common, stage, o, asked.frames, progress);
    drawn.turned = all.frames;
    drawn.result = std::move(all.last);
  } else if (asked.turntable) {
    drawn.result = turn_into_file(args, common, stage, o, asked.frames, asked.kind, progress);
  } else if (drawn.made) {
    drawn.result = drawn.made->picture.drawn;
  } else {
    drawn.result = draw_one(stage, o, asked.output, asked.kind);
  }
  if (drawn.of_integrals() && !o.slice_range) o.slice_range = range_of_values(drawn.result.values);
}

std::string stamp_of(const Drawn& drawn, Source& source) {
  const Scene& scene = source.scene();
  return drawn.method == "d2vr" ? "D2VR, straight from the projections: no certificate"
         : drawn.certified      ? "certified"
         : !source.trusted()    ? "by a device that failed its test: no certificate"
         : is_comparison(scene) ? "for comparison: no certificate"
         : scene.verified       ? "base samples alone: no certificate"
         : scene.certificate    ? "UNVERIFIED: the content was not compared with the certificate"
                                : "no certificate";
}

Json drawn_json(const Request& asked, const Drawn& drawn, Source& source) {
  const RenderOptions& o = drawn.options;
  const RenderResult& result = drawn.result;
  const bool lit = (o.mode == RenderMode::dvr || o.mode == RenderMode::iso) &&
                   (o.output == RenderOutput::normal || (o.shading && o.output == RenderOutput::colour));
  const auto& made = drawn.made;
  return {{"output", asked.output.string()},
          {"frames", asked.frames},
          {"frames_kept", drawn.turned.kept},
          {"verified", drawn.certified},
          {"sampler", sampler_name(result.sampler)},
          {"sampler_reason", drawn.sampler_reason()},
          {"sampler_term",
           drawn.certified ? sampler_term_json(source.certificate(), result.sampler == SamplerKind::image3d)
                           : Json()},
          {"gradient", lit ? Json(gradient_name(result.gradient)) : Json()},
          {"samples", result.samples},
          {"seconds", result.seconds},
          {"epsilon_abs", drawn.certified ? Json(source.scene().certificate->epsilon_abs) : Json()},
          {"outside_certificate", outside_certificate(o)},
          {"transfer", drawn.has_transfer() ? transfer_json(o.transfer) : Json()},
          {"window", drawn.of_integrals() ? Json(*o.slice_range) : Json()},
          {"notes", drawn.notes},
          {"method", drawn.method},
          {"certificate", made ? made->json : Json()},
          {"picture_tolerance", made && made->beyond ? tolerance_json(*made->beyond) : Json()},
          {"resident_bytes", source.bytes()},
          {"paging", paging_json(source.paging())},
          {"device", source.device().info().name},
          {"device_trusted", source.trusted()}};
}

void print_drawn(const Request& asked, const Drawn& drawn, Source& source) {
  const RenderOptions& o = drawn.options;
  const RenderResult& result = drawn.result;
  const double mebibytes = static_cast<double>(source.bytes()) / (1 << 20);
  fmt::print("{}: {} x {}{}, {}\n", asked.output.string(), o.width, o.height,
             asked.turntable ? fmt::format(", {} pictures", asked.frames) : "", stamp_of(drawn, source));
  fmt::print("  sampler      {} ({})\n", sampler_name(result.sampler), drawn.sampler_reason());
  print_paging(source.paging());
  if (result.gradient == GradientKind::stored)
    fmt::print("  gradient     stored at the samples, {:.1f} MiB on the device in all\n", mebibytes);
  if (drawn.method == "d2vr") fmt::print("  projections  {:.1f} MiB on the device\n", mebibytes);
  if (drawn.certified)
    fmt::print("  certified    every sample of the field that was taken lies within {:.4g} of F\n",
               source.scene().certificate->epsilon_abs);
  if (drawn.of_integrals())
    fmt::print("  grey         from {:.6g}, black, to {:.6g}, white\n", o.slice_range->first,
               o.slice_range->second);
  if (drawn.made) print_certain(*drawn.made);
  fmt::print("  not covered  {}\n", outside_certificate(o));
  std::vector<std::string> notes = drawn.notes;
  if (drawn.has_transfer()) {
    fmt::print("  transfer     {}, from {:.6g} to {:.6g}\n", o.transfer.name, o.transfer.points.front().value,
               o.transfer.points.back().value);
    if (!o.transfer.note.empty()) notes.push_back(o.transfer.note);
  }
  print_notes(notes);
  // Slices count no samples along rays.
  fmt::print("  {}{:.3f} s on {}\n", result.samples == 0 ? "" : fmt::format("{} samples in ", result.samples),
             result.seconds, source.device().info().name);
}

}  // namespace

int render_command(Arguments& args) {
  add_render_options(args);
  add_untrusted(args);
  add_common(args);
  if (args.asks("tf", "list")) {
    fmt::print("transfer functions by name, stretched over the volume's own values:\n{}", preset_table());
    return 0;
  }
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  untrusted_option(args);
  const Request asked = request_of(args, common);
  if (asked.options.mode == RenderMode::error)
    return render_error(args, common, asked.options, asked.output, asked.kind);

  ProgressLine progress(args.who(), common.quiet);
  Source source(args, common, asked.method, args.has("unverified"), progress.callback());
  if (asks_certify(args)) source.require_trusted("certifying a picture");
  Drawn drawn;
  drawn.options = asked.options;
  drawn.method = asked.method;
  const OrbitFrame frame = look_at_volume(args, source, drawn, progress.callback());
  if (asks_certify(args))
    drawn.made =
        certify_render(args, common, source, drawn.options, asked.overlay, asked.output, progress.callback());
  // Colours are certified by the device, surfaces, maxima and integrals ray by ray on the host.
  if (drawn.made && !is_certified_by_ray(drawn.options.mode)) {
    progress.clear();
    say_certified(args, common, source, *drawn.made, asked.output);
    return 0;
  }
  draw_asked(args, common, asked, {source, asked.overlay, drawn.certified, frame}, drawn,
             progress.callback());
  progress.clear();
  print_result(common, drawn_json(asked, drawn, source), [&] { print_drawn(asked, drawn, source); });
  if (drawn.made) require_within(asked.output, drawn.made->beyond);
  return 0;
}

}  // namespace vdvr::cli
