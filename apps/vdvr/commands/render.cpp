// vdvr render: a picture, the values behind it, or a turntable.
#include <fmt/format.h>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify_render.hpp"
#include "apps/vdvr/clip.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/frames.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/integral_certificate.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/overlay.hpp"
#include "apps/vdvr/ray_certificate.hpp"
#include "apps/vdvr/source.hpp"
#include "apps/vdvr/view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/error_slice.hpp"
#include "vdvr/vdvr_file.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kOutputs{"colour", "depth", "normal", "error", "bound",
                                        "lo",     "hi",    "middle", "class", "band"};
const std::vector<std::string> kModes{"dvr", "iso", "mip", "integral", "slice", "error"};
constexpr Orbit kOrbit{30, 20, 1};
// Twenty pictures a second: a turn of 60 takes three.
constexpr int kFrameMs = 50;

void add_options(Arguments& args) {
  args.positional(
          "FILE",
          "a certified volume, or a uniform one: MHA, NRRD, FILE.h5:/dataset, TIFF slices; or with --method "
          "d2vr projections")
      .value("output,o", "IMG.png|X.npy",
             "the picture; or as float32 what lies behind its pixels: opacity, depth, maximum, integral, "
             "field, error; "
             "with "
             "--turntable a folder, or T.apng or T.gif");
  add_method(args);
  args.value("mode", "dvr|iso|mip|integral|slice|error",
             "default dvr; integral: an X-ray picture, the field summed up along each ray; error: on a slice "
             "|V - F|, or without --projections what the certificate bounds "
             "it by")
      .value("size", "512x512", "pixels");
  add_transfer(args);
  args.value("iso", "V[,V...]",
             "densities of up to 8 iso-surfaces (default: one between background and object)")
      .value("iso-opacity", "O[,O...]", "of each (default 1; of several the densest 1, others 0.3)")
      .value(
          "show", "colour|depth|normal|error|bound|lo|hi|middle|class|band",
          "what a pixel says: its colour, how far what is seen lies from the eye, which way it faces, or "
          "how far the samples it was made of can lie from the scan; with --certify the bound of each pixel, "
          "the ends of its interval or their middle; of iso the class of each pixel, or "
          "the band of its depth")
      .value("background", "R,G,B[,R,G,B]", "colour behind the volume, or at the top and the bottom; 0 to 1")
      .value("slice-axis", "x|y|z", "default z")
      .value("slice-position", "P", "world (default: the middle)")
      .value("step", "S", "of dvr and mip, in base cells (default 1); iso goes from cell to cell")
      .value(
          "step-mode", "adaptive|fixed|level",
          "of dvr; adaptive: finer steps where the transfer function changes much along one; level: step / "
          "2^l in bricks of level l (default adaptive; of preintegrated and d2vr fixed)")
      .value("classification", "post|preintegrated",
             "of dvr; post: colour of each sample; preintegrated: of the path between two (default post)")
      .value(
          "gradient", "auto|central|stored|analytic",
          "which way a surface faces: differences over one base cell, the same kept at the samples, or the "
          "derivative of the cell itself (default auto: stored for dvr where there is room, else central)")
      .values("light", "head|X,Y,Z",
              "at the eye, or from a direction in world axes; may be given several times (default head)")
      .flag("no-shading", "colours of the transfer function alone, without light")
      .value("turntable", "N", "N pictures over a full turn, frame-0000.png and so on")
      .value("sampler", "auto|image3d|buffer", "default auto")
      .value("projections", "IN", "with --mode error: the projections to measure against")
      .flag("resume", "keep the frames that an interrupted turntable of the same command left in the folder")
      .flag("unverified", "render although content and certificate do not match");
  add_give_up(args, "rank 0 draws its frames; of vdvr-mpi");
  add_certify(args);
  add_clip(args);
  add_scan(args);
  add_projection_options(args);
  args.group("Camera");
  add_orbit(args, kOrbit, "what is shown");
  add_frame(args);
  add_free_camera(args);
  add_overlay(args);
}

/// What the name of the output asks for.
enum class OutputKind { picture, values, folder, apng, gif };

OutputKind output_kind(const std::filesystem::path& output, bool turntable) {
  const std::string e = output.extension().string();
  if (turntable) {
    if (e == ".apng") return OutputKind::apng;
    if (e == ".gif") return OutputKind::gif;
    if (e == ".png" || e == ".npy")
      throw InputError(
          fmt::format("{}: a turntable goes into a folder, or moves as .apng or .gif", output.string()));
    return OutputKind::folder;
  }
  if (e == ".png") return OutputKind::picture;
  if (e == ".npy") return OutputKind::values;
  if (e == ".apng" || e == ".gif")
    throw InputError(fmt::format("{}: moving pictures need --turntable N", output.string()));
  throw InputError(fmt::format("{}: give the output a name that ends in .png, or .npy for float32 values",
                               output.string()));
}

void set_background(const Arguments& args, RenderOptions& o) {
  const auto given = args.numbers("background", 0);
  if (!given) return;
  if (given->size() != 3 && given->size() != 6)
    throw InputError("--background: give three numbers, or six for the top and the bottom");
  for (std::size_t c = 0; c < 3; ++c) {
    o.background_top[c] = (*given)[c];
    o.background_bottom[c] = (*given)[given->size() - 3 + c];
  }
  for (const double x : *given)
    if (!(x >= 0 && x <= 1)) throw InputError(fmt::format("--background: {} is not within 0 and 1", x));
}

void set_light(const Arguments& args, RenderOptions& o) {
  o.shading = !args.has("no-shading");
  if (!o.shading) refuse(args, {"light"}, "excludes --no-shading");
  if (!o.shading && o.output != RenderOutput::normal) refuse(args, {"gradient"}, "excludes --no-shading");
  o.gradient = gradient_option(args);
  if (!args.has("light")) return;
  o.head_light = false;
  for (const std::string& light : args.texts("light")) {
    if (light == "head") o.head_light = true;
    else o.lights.push_back(parse_vec3("--light", light));
  }
}

/// One at the threshold, unless others are asked for.
std::vector<IsoSurface> surfaces_for(const Arguments& args, double threshold) {
  const std::vector<double> values = args.numbers("iso", 0).value_or(std::vector<double>{threshold});
  return iso_surfaces(values, args.numbers("iso-opacity", args.has("iso-opacity") ? values.size() : 0));
}

/// Steps adapt where they can.
StepMode step_mode_option(const Arguments& args, const RenderOptions& o) {
  const bool can =
      o.mode == RenderMode::dvr && o.classification == Classification::post && method_option(args) != "d2vr";
  const std::string asked =
      args.choice("step-mode", {"adaptive", "fixed", "level"}, can ? "adaptive" : "fixed");
  return asked == "adaptive" ? StepMode::adaptive : asked == "level" ? StepMode::level : StepMode::fixed;
}

/// Everything that the words alone decide; what depends on the volume is filled in by `complete`.
RenderOptions render_options(const Arguments& args) {
  RenderOptions o;
  const std::string mode = args.choice("mode", kModes, "dvr");
  o.mode = mode == "iso"        ? RenderMode::iso
           : mode == "mip"      ? RenderMode::mip
           : mode == "slice"    ? RenderMode::slice
           : mode == "error"    ? RenderMode::error
           : mode == "integral" ? RenderMode::integral
                                : RenderMode::dvr;
  if (const auto size = args.sizes("size", 2)) {
    o.width = (*size)[0];
    o.height = (*size)[1];
    if (o.width > 16384 || o.height > 16384) throw InputError("--size: a side is above 16384 pixels");
  }
  o.step = args.positive_or("step", o.step);
  o.classification = args.choice("classification", {"post", "preintegrated"}, "post") == "preintegrated"
                         ? Classification::preintegrated
                         : Classification::post;
  o.step_mode = step_mode_option(args, o);
  const std::string output = args.choice("show", kOutputs, "colour");
  o.output = output == "depth"    ? RenderOutput::depth
             : output == "normal" ? RenderOutput::normal
             : output == "error"  ? RenderOutput::error
                                  : RenderOutput::colour;
  set_light(args, o);
  set_background(args, o);
  const std::string axis = args.choice("slice-axis", {"x", "y", "z"}, "z");
  o.slice_axis = axis[0] - 'x';
  o.slice_position = args.number("slice-position");
  const std::string sampler = args.choice("sampler", {"auto", "image3d", "buffer"}, "auto");
  o.sampler = sampler == "auto"     ? SamplerKind::automatic
              : sampler == "buffer" ? SamplerKind::buffer
                                    : SamplerKind::image3d;
  return o;
}

/// Before anything is read; the library refuses the same.
void check_d2vr(const Arguments& args, const RenderOptions& o) {
  if (o.mode != RenderMode::dvr)
    throw InputError(
        fmt::format("--mode {}: --method d2vr has projections instead of a volume and draws only "
                    "--mode dvr; build the volume for the others",
                    args.text("mode")));
  if (o.classification != Classification::post || o.step_mode != StepMode::fixed ||
      o.gradient == GradientKind::stored || o.sampler == SamplerKind::image3d)
    refuse(args, {"classification", "step-mode", "gradient", "sampler"},
           "--method d2vr has no stored samples: it classifies after sampling, steps evenly, takes gradients "
           "where they are needed and reads buffers");
  refuse(args, {"unverified"}, "--method d2vr has no certificate");
}

void check_combination(const Arguments& args, const RenderOptions& o) {
  check_certify(args, o);
  if (method_option(args) == "d2vr") check_d2vr(args, o);
  const bool flat = o.mode == RenderMode::slice || o.mode == RenderMode::error;
  frames_grid(args);
  if (has_free_camera(args))
    refuse(args, {"azimuth", "elevation", "zoom", "turntable"}, "excludes the --camera- options");
  if (flat) refuse(args, free_camera_options(), "a slice has no camera");
  if (flat) refuse(args, {"clip", "clip-covered", "covered-from"}, "does not apply to a slice");
  if (!args.has("clip-covered") && !asks_certify(args))
    refuse(args, {"covered-from"}, "goes with --clip-covered and --certify");
  if (flat)
    refuse(args,
           {"azimuth", "elevation", "zoom", "frame", "turntable", "tf", "iso", "step", "no-shading",
            "background", "gradient", "light", "step-mode", "classification"},
           "does not apply to a slice");
  if (flat && !asks_certify(args)) refuse(args, {"show"}, "does not apply to a slice without --certify");
  // What a slice takes of it is the window; an error picture's colours always run to epsilon.
  if (o.mode == RenderMode::error) refuse(args, {"tf-range"}, "does not apply to --mode error");
  if (!flat) refuse(args, {"slice-axis", "slice-position"}, "applies to --mode slice and error");
  if (o.mode == RenderMode::mip)
    refuse(args, {"no-shading", "gradient", "light"}, "does not apply to --mode mip, which has no light");
  if (o.mode == RenderMode::integral) {
    refuse(args, {"no-shading", "gradient", "light", "background", "tf", "step"},
           "does not apply to --mode integral, which sums up densities cell by cell");
    const std::string show = args.text_or("show", "colour");
    if (show == "depth" || show == "normal" || show == "error")
      throw InputError(fmt::format("--show {} does not apply to --mode integral: it is of whole rays", show));
  }
  if (o.mode != RenderMode::dvr) refuse(args, {"step-mode", "classification"}, "applies to --mode dvr");
  if (o.step_mode != StepMode::fixed && o.classification == Classification::preintegrated)
    throw InputError(
        fmt::format("--step-mode {} does not apply to --classification preintegrated, whose table is of one "
                    "step",
                    args.text("step-mode")));
  if (o.mode != RenderMode::iso) refuse(args, {"iso", "iso-opacity"}, "applies to --mode iso");
  if (o.output != RenderOutput::colour)
    refuse(args, {"axes", "box", "colorbar", "background", "no-shading", "light"},
           "applies to --show colour");
  if (o.output == RenderOutput::depth || o.output == RenderOutput::error)
    refuse(args, {"gradient"}, "applies to --show colour and normal");
  if (o.output == RenderOutput::error) {
    refuse(args, {"caption"}, "is part of --show error");
    if (method_option(args) != "vdvr" || args.has("unverified"))
      throw InputError("--show error is of certified volumes: it does not go with --method or --unverified");
  }
  if (o.output == RenderOutput::normal && o.mode == RenderMode::mip)
    throw InputError("--show normal does not apply to --mode mip: a maximum has no surface");
  if (o.mode == RenderMode::iso) refuse(args, {"tf", "tf-range"}, "does not apply to --mode iso");
  if (o.mode != RenderMode::error) refuse(args, {"projections"}, "applies to --mode error");
  if (o.mode == RenderMode::error) {
    refuse(args, {"method", "unverified"}, "does not apply to --mode error, which is of the certified field");
    if (args.has("projections"))
      refuse(args, {"sampler"}, "does not apply to what is measured against --projections");
  }
}

void write_error_slice(const std::filesystem::path& output, OutputKind kind, const ErrorSlice& slice) {
  if (kind == OutputKind::values) write_npy(output, slice.errors);
  else write_png(output, slice.image);
}

/// What the certificate alone says of a slice.
int render_bound(const CommonOptions& common, const RenderOptions& o, const std::filesystem::path& output,
                 OutputKind kind, const Scene& scene, const ErrorSliceOptions& options) {
  const bool image3d = o.sampler == SamplerKind::image3d;
  const ErrorSlice slice = bound_slice(scene.volume, *scene.certificate, image3d, options);
  write_error_slice(output, kind, slice);
  const double epsilon = scene.certificate->epsilon_abs;
  const Json json = {{"output", output.string()},
                     {"mode", "error"},
                     {"bound", slice.max_error},
                     {"epsilon_abs", epsilon},
                     {"sampler", image3d ? "image3d" : "buffer"},
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
  if (!args.has("projections")) return render_bound(common, o, output, kind, scene, options);
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
  Orbit orbit = orbit_options(args, kOrbit);
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

}  // namespace

int render_command(Arguments& args) {
  add_options(args);
  add_common(args);
  if (args.asks("tf", "list")) {
    fmt::print("transfer functions by name, stretched over the volume's own values:\n{}", preset_table());
    return 0;
  }
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  RenderOptions o = render_options(args);
  check_combination(args, o);
  const Overlay overlay = overlay_options(args, o.mode);
  const auto path = args.path("FILE"), output = args.path("output");
  const bool turntable = args.has("turntable");
  const std::int64_t frames = args.integer_or("turntable", 1, 1, 9999);
  const OutputKind kind = output_kind(output, turntable);
  if (kind == OutputKind::values)
    refuse(args, {"axes", "box", "colorbar", "caption", "plain"}, "is of pictures, not of values");
  if (kind != OutputKind::folder)
    refuse(args, {"resume", "give-up"}, "is of a turntable in a folder, whose frames are kept");
  give_up_option(args);
  if (kind != OutputKind::folder) check_output(output, common.force, {file_of_volume(path)});
  const bool of_integrals = o.mode == RenderMode::integral;
  if (of_integrals) check_integral_certificate(args, kind == OutputKind::values);
  else check_ray_certificate(args, o.mode, kind == OutputKind::values);
  // Colours are certified by the device, surfaces, maxima and integrals ray by ray on the host.
  const bool certifies = asks_certify(args) && is_certified_by_ray(o.mode);
  if (certifies)
    for (const auto& beside : ray_certificate_paths(output, o.mode))
      check_output(beside, common.force, {file_of_volume(path)});
  if (o.mode == RenderMode::error) return render_error(args, common, o, output, kind);

  const std::string method = method_option(args);
  ProgressLine progress(args.who(), common.quiet);
  Source source(args, common, method, args.has("unverified"), progress.callback());
  const Scene& scene = source.scene();
  const Brightness bright = brightness_of(scene.volume);
  o.surfaces = surfaces_for(args, bright.threshold);
  // Of integrals it says what is framed, and --tf-range is no range of densities.
  o.transfer = of_integrals ? two_material_transfer(bright) : transfer_for(args, bright, scene.volume.grid);
  o.slice_range = given_range(args);
  if (!o.slice_range && !of_integrals) o.slice_range = std::pair{bright.grey_lo, bright.grey_hi};
  o.sampler = safe_sampler(o.sampler, scene.certificate);
  const Orbit orbit = orbit_options(args, kOrbit);
  const OrbitFrame frame = frame_for(args, scene.volume, o, orbit);
  o.camera = camera_for(args, frame, orbit);
  o.clip = clip_for(args, scene, progress.callback());
  if (certifies) o.clip = certified_clip(args, scene, o, progress.callback());
  // The base samples alone are another field than the one certified.
  const bool certified = scene.verified && method == "vdvr";
  o.skip_empty = !args.has("no-skip");

  if (asks_certify(args) && !certifies) {
    const int code = certify_render(args, common, source, o, overlay, output, progress.callback());
    progress.clear();
    return code;
  }
  // All frames have the window of the first.
  if (of_integrals && turntable && !o.slice_range) o.slice_range = range_of_values(source.draw(o).values);
  const Stage stage{source, overlay, certified, frame};
  FramesDrawn turned{1, 0};
  const auto into_folder = [&] {
    Turned all = turn_into_folder(args, common, stage, o, frames, progress.callback());
    turned = all.frames;
    return std::move(all.last);
  };
  const RenderResult result = kind == OutputKind::folder ? into_folder()
                              : turntable
                                  ? turn_into_file(args, common, stage, o, frames, kind, progress.callback())
                              : certifies ? source.draw(o)
                                          : draw_one(stage, o, output, kind);
  RayCertificate ray_certificate;
  if (of_integrals && !o.slice_range) o.slice_range = range_of_values(result.values);
  if (certifies)
    ray_certificate = of_integrals
                          ? write_integral_certificate(args, source, o, result, output, progress.callback())
                          : write_ray_certificate(args, source, o, result, output, progress.callback());
  progress.clear();

  const std::string stamp = method == "d2vr" ? "D2VR, straight from the projections: no certificate"
                            : certified      ? "certified"
                            : scene.verified ? "base samples alone: no certificate"
                            : scene.certificate
                                ? "UNVERIFIED: the content was not compared with the certificate"
                                : "no certificate";
  const bool has_transfer = o.mode == RenderMode::dvr || o.mode == RenderMode::mip;
  const bool lit = (o.mode == RenderMode::dvr || o.mode == RenderMode::iso) &&
                   (o.output == RenderOutput::normal || (o.shading && o.output == RenderOutput::colour));
  const Json json = {
      {"output", output.string()},
      {"frames", frames},
      {"frames_kept", turned.kept},
      {"verified", certified},
      {"sampler", sampler_name(result.sampler)},
      {"sampler_reason", result.sampler_reason},
      {"gradient", lit ? Json(gradient_name(result.gradient)) : Json()},
      {"samples", result.samples},
      {"seconds", result.seconds},
      {"epsilon_abs", certified ? Json(scene.certificate->epsilon_abs) : Json()},
      {"outside_certificate", outside_certificate(o)},
      {"transfer", has_transfer ? transfer_json(o.transfer) : Json()},
      {"window", of_integrals ? Json(*o.slice_range) : Json()},
      {"method", method},
      {"certificate", ray_certificate.json},
      {"picture_tolerance", ray_certificate.beyond ? tolerance_json(*ray_certificate.beyond) : Json()},
      {"resident_bytes", source.bytes()},
      {"paging", paging_json(source.paging())},
      {"device", source.device().info().name}};
  print_result(common, json, [&] {
    fmt::print("{}: {} x {}{}, {}\n", output.string(), o.width, o.height,
               turntable ? fmt::format(", {} pictures", frames) : "", stamp);
    fmt::print("  sampler      {} ({})\n", sampler_name(result.sampler), result.sampler_reason);
    print_paging(source.paging());
    if (result.gradient == GradientKind::stored)
      fmt::print("  gradient     stored at the samples, {:.1f} MiB on the device in all\n",
                 static_cast<double>(source.bytes()) / (1 << 20));
    if (method == "d2vr")
      fmt::print("  projections  {:.1f} MiB on the device\n",
                 static_cast<double>(source.bytes()) / (1 << 20));
    if (certified)
      fmt::print("  certified    every sample of the field that was taken lies within {:.4g} of F\n",
                 scene.certificate->epsilon_abs);
    if (of_integrals)
      fmt::print("  grey         from {:.6g}, black, to {:.6g}, white\n", o.slice_range->first,
                 o.slice_range->second);
    if (certifies && of_integrals) print_integral_certificate(ray_certificate);
    else if (certifies) print_ray_certificate(ray_certificate);
    fmt::print("  not covered  {}\n", outside_certificate(o));
    if (has_transfer)
      fmt::print("  transfer     {}, from {:.6g} to {:.6g}\n", o.transfer.name,
                 o.transfer.points.front().value, o.transfer.points.back().value);
    if (has_transfer && !o.transfer.note.empty()) print_notes({o.transfer.note});
    // Slices count no samples along rays.
    fmt::print("  {}{:.3f} s on {}\n",
               result.samples == 0 ? "" : fmt::format("{} samples in ", result.samples), result.seconds,
               source.device().info().name);
  });
  require_within(output, ray_certificate.beyond);
  return 0;
}

}  // namespace vdvr::cli
