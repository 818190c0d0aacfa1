#include "apps/vdvr/render_options.hpp"

#include <fmt/format.h>

#include "apps/vdvr/certify_options.hpp"
#include "apps/vdvr/clip.hpp"
#include "apps/vdvr/crew.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/options.hpp"
#include "apps/vdvr/overlay.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

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

/// Steps adapt where they can.
StepMode step_mode_option(const Arguments& args, const RenderOptions& o) {
  const bool can =
      o.mode == RenderMode::dvr && o.classification == Classification::post && method_option(args) != "d2vr";
  const std::string asked = args.choice("step-mode", can ? "adaptive" : "fixed");
  return asked == "adaptive" ? StepMode::adaptive : asked == "level" ? StepMode::level : StepMode::fixed;
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

}  // namespace

void add_render_options(Arguments& args) {
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
      .value("show", "colour|depth|normal|error|sigma|error-in-sigma|bound|lo|hi|middle|class|band",
             "what a pixel says: its colour, how far what is seen lies from the eye, which way it faces, how "
             "far the "
             "samples it was made of can lie from the scan, what the scan's own noise leaves in them (sigma, "
             "estimated), or the former in units of the latter; with --certify the bound of each pixel, "
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
  add_volume_input(args);
  add_projection_options(args);
  args.group("Camera");
  add_orbit(args, kRenderOrbit, "what is shown");
  add_frame(args);
  add_free_camera(args);
  add_overlay(args);
}

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

std::vector<IsoSurface> surfaces_for(const Arguments& args, double threshold) {
  const std::vector<double> values = args.numbers("iso", 0).value_or(std::vector<double>{threshold});
  return iso_surfaces(values, args.numbers("iso-opacity", args.has("iso-opacity") ? values.size() : 0));
}

BrickQuantity brick_quantity(const Arguments& args) {
  const std::string show = args.text_or("show", "colour");
  return show == "sigma"            ? BrickQuantity::sigma
         : show == "error-in-sigma" ? BrickQuantity::bound_in_sigma
                                    : BrickQuantity::bound;
}

RenderOptions render_options(const Arguments& args) {
  RenderOptions o;
  const std::string mode = args.choice("mode", "dvr");
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
  o.classification = args.choice("classification", "post") == "preintegrated" ? Classification::preintegrated
                                                                              : Classification::post;
  o.step_mode = step_mode_option(args, o);
  const std::string output = args.choice("show", "colour");
  o.output = output == "depth"                                                   ? RenderOutput::depth
             : output == "normal"                                                ? RenderOutput::normal
             : output == "error" || brick_quantity(args) != BrickQuantity::bound ? RenderOutput::error
                                                                                 : RenderOutput::colour;
  set_light(args, o);
  set_background(args, o);
  o.slice_axis = args.choice("slice-axis", "z")[0] - 'x';
  o.slice_position = args.number("slice-position");
  o.sampler = sampler_option(args);
  return o;
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
  const bool in_sigma = brick_quantity(args) != BrickQuantity::bound;
  if (flat && !asks_certify(args) && !(in_sigma && o.mode == RenderMode::error))
    refuse(args, {"show"}, "does not apply to a slice without --certify, but for sigma in --mode error");
  if (in_sigma && o.mode == RenderMode::error)
    refuse(args, {"projections"}, "goes with the error itself, not with --show sigma and error-in-sigma");
  // What a slice takes of it is the window; an error picture's colours always run to epsilon.
  if (o.mode == RenderMode::error) refuse(args, {"tf-range"}, "does not apply to --mode error");
  if (!flat) refuse(args, {"slice-axis", "slice-position"}, "applies to --mode slice and error");
  if (o.mode == RenderMode::mip)
    refuse(args, {"no-shading", "gradient", "light"}, "does not apply to --mode mip, which has no light");
  if (o.mode == RenderMode::integral) {
    refuse(args, {"no-shading", "gradient", "light", "background", "tf", "step"},
           "does not apply to --mode integral, which sums up densities cell by cell");
    const std::string show = args.text_or("show", "colour");
    if (show == "depth" || o.output == RenderOutput::error || show == "normal")
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
    const std::string show = args.text_or("show", "error");
    refuse(args, {"caption"}, fmt::format("is part of --show {}", show));
    if (method_option(args) != "vdvr" || args.has("unverified"))
      throw InputError(fmt::format(
          "--show {} is of certified volumes: it does not go with --method or --unverified", show));
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

}  // namespace vdvr::cli
