// vdvr render: a picture, or a turntable of pictures.
#include <fmt/format.h>

#include <chrono>

#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/pictures.hpp"
#include "apps/vdvr/progress.hpp"
#include "host/error_slice.hpp"
#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

const std::vector<std::string> kMethods{"vdvr", "dvr", "d2vr"}, kSupportedMethods{"vdvr", "dvr"};
const std::vector<std::string> kModes{"dvr", "iso", "mip", "slice", "error"};
const std::vector<std::string> kCameraOptions{"camera-position", "camera-focal-point", "camera-view-up",
                                              "camera-view-angle"};

void add_options(Arguments& args) {
  args.positional("FILE", "a certified volume or an MHA/NRRD volume")
      .value("output,o", "IMG.png", "the picture; with --turntable a folder");
  add_limited(args, "method", kMethods, kSupportedMethods, "the mixed volume, or its base samples alone");
  args.value("mode", "dvr|iso|mip|slice|error", "default dvr; error: |V - F| on a slice, needs --projections")
      .value("size", "512x512", "pixels")
      .value("tf", "FILE.json|NAME",
             "transfer function (default, grey, bone, soft, mip); without it one that suits the volume")
      .value("iso", "V", "density of the iso-surface (default: between background and object)")
      .value("slice-axis", "x|y|z", "default z")
      .value("slice-position", "P", "world (default: the middle)")
      .value("step", "S", "in base cells (default 1)")
      .value("turntable", "N", "N pictures over a full turn, frame-0000.png and so on")
      .value("sampler", "auto|image3d|buffer", "default auto")
      .value("projections", "IN", "with --mode error: the projections")
      .flag("unverified", "render although content and certificate do not match");
  add_scan(args);
  args.group("Camera")
      .value("azimuth", "DEG", "about z; 0 looks along -y with x to the right (default 30)")
      .value("elevation", "DEG", "default 20")
      .value("zoom", "Z", "1 fits the volume (default 1)")
      .value("camera-position", "X,Y,Z", "instead of azimuth, elevation and zoom")
      .value("camera-focal-point", "X,Y,Z", "default: the volume's centre")
      .value("camera-view-up", "X,Y,Z", "default 0,0,-1: detector row 0 is up")
      .value("camera-view-angle", "DEG", "vertical (default 30)");
}

struct Orbit {
  double azimuth = 30, elevation = 20, zoom = 1;
};

Orbit orbit_options(const Arguments& args) {
  Orbit orbit;
  orbit.azimuth = args.number_or("azimuth", orbit.azimuth);
  orbit.elevation = args.number_or("elevation", orbit.elevation);
  orbit.zoom = args.positive_or("zoom", orbit.zoom);
  return orbit;
}

bool has_free_camera(const Arguments& args) {
  bool any = false;
  for (const auto& name : kCameraOptions) any = any || args.has(name);
  return any;
}

Camera camera_for(const Arguments& args, const Grid& grid, const Orbit& orbit) {
  Camera camera = orbit_camera(grid, orbit.azimuth, orbit.elevation, orbit.zoom);
  if (!has_free_camera(args)) return camera;
  camera.position = args.vec3("camera-position").value_or(camera.position);
  camera.focal_point = args.vec3("camera-focal-point").value_or(camera.focal_point);
  camera.view_up = args.vec3("camera-view-up").value_or(camera.view_up);
  camera.view_angle_deg = args.positive_or("camera-view-angle", camera.view_angle_deg);
  if (camera.view_angle_deg >= 180)
    throw InputError(fmt::format("--camera-view-angle: {} is not below 180", camera.view_angle_deg));
  return camera;
}

TransferFunction transfer_for(const Arguments& args, const Brightness& b) {
  if (!args.has("tf")) return two_material_transfer(b);
  const std::string name = args.text("tf");
  const std::filesystem::path file(name);
  if (file.extension() == ".json") return read_transfer_function(file);
  return transfer_preset(name, b.lo, b.hi);
}

/// Everything that the words alone decide; what depends on the volume is filled in by `complete`.
RenderOptions render_options(const Arguments& args) {
  RenderOptions o;
  const std::string mode = args.choice("mode", kModes, "dvr");
  o.mode = mode == "iso"     ? RenderMode::iso
           : mode == "mip"   ? RenderMode::mip
           : mode == "slice" ? RenderMode::slice
           : mode == "error" ? RenderMode::error
                             : RenderMode::dvr;
  if (const auto size = args.sizes("size", 2)) {
    o.width = (*size)[0];
    o.height = (*size)[1];
    if (o.width > 16384 || o.height > 16384) throw InputError("--size: a side is above 16384 pixels");
  }
  o.step = args.positive_or("step", o.step);
  const std::string axis = args.choice("slice-axis", {"x", "y", "z"}, "z");
  o.slice_axis = axis[0] - 'x';
  o.slice_position = args.number("slice-position");
  const std::string sampler = args.choice("sampler", {"auto", "image3d", "buffer"}, "auto");
  o.sampler = sampler == "auto"     ? SamplerKind::automatic
              : sampler == "buffer" ? SamplerKind::buffer
                                    : SamplerKind::image3d;
  return o;
}

void check_combination(const Arguments& args, const RenderOptions& o) {
  limited_choice(args, "method", kMethods, kSupportedMethods);
  const bool flat = o.mode == RenderMode::slice || o.mode == RenderMode::error;
  if (has_free_camera(args))
    refuse(args, {"azimuth", "elevation", "zoom", "turntable"}, "excludes the --camera- options");
  if (flat) refuse(args, kCameraOptions, "a slice has no camera");
  if (flat)
    refuse(args, {"azimuth", "elevation", "zoom", "turntable", "tf", "iso", "step"},
           "does not apply to a slice");
  if (!flat) refuse(args, {"slice-axis", "slice-position"}, "applies to --mode slice and error");
  if (o.mode != RenderMode::iso) refuse(args, {"iso"}, "applies to --mode iso");
  if (o.mode == RenderMode::iso) refuse(args, {"tf"}, "does not apply to --mode iso");
  if (o.mode != RenderMode::error) refuse(args, {"projections"}, "applies to --mode error");
  if (o.mode == RenderMode::error) {
    refuse(args, {"method", "unverified", "sampler"},
           "does not apply to --mode error, which measures the certified field");
    if (!args.has("projections"))
      throw InputError("--mode error needs --projections IN, which it measures against");
  }
}

int render_error(const Arguments& args, const CommonOptions& common, const RenderOptions& o,
                 const std::filesystem::path& output) {
  const auto path = args.path("FILE"), projections = args.path("projections");
  ProgressLine progress(args.command(), common.quiet);
  const Scene scene = open_scene(path, args, "vdvr", false);
  if (!scene.certificate)
    throw InputError(fmt::format("{}: has no certificate to measure against", path.string()));
  const ProjectionSet scan = load_scan(projections, args, scene.certificate->field, progress.callback());
  check_input(projections, scan, *scene.certificate);
  const Grid& g = scene.volume.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  const double middle = g.origin[axis] + 0.5 * static_cast<double>(g.cells[axis]) * g.spacing[axis];
  Device device = open_device(common);
  const ErrorSlice slice =
      error_slice(device, scan, scene.volume, *scene.certificate,
                  {o.slice_axis, o.slice_position.value_or(middle), o.width, o.height}, progress.callback());
  throw_if_interrupted();
  write_png(output, slice.image);
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

std::string frame_name(std::int64_t frame) { return fmt::format("frame-{:04}.png", frame); }

/// Renders `frames` pictures into a folder. Returns the last.
RenderResult render_turntable(const Arguments& args, const CommonOptions& common, Device& device,
                              const ResidentVolume& resident, const Scene& scene, RenderOptions o,
                              std::int64_t frames, const Progress& progress) {
  std::vector<std::string> names;
  for (std::int64_t f = 0; f < frames; ++f) names.push_back(frame_name(f));
  if (scene.certificate) names.emplace_back("certificate.json");
  OutputFolder folder(args.path("output"), names, common.force);
  folder.begin();
  RenderResult last;
  for (std::int64_t f = 0; f < frames; ++f) {
    report(progress, "turntable", static_cast<double>(f) / static_cast<double>(frames));
    Orbit orbit = orbit_options(args);
    orbit.azimuth += 360.0 * static_cast<double>(f) / static_cast<double>(frames);
    o.camera = camera_for(args, resident.grid(), orbit);
    last = raycast(device, resident, o);
    write_png(folder.file(frame_name(f)), last.image);
  }
  if (scene.certificate) folder.finish(to_json(*scene.certificate));
  return last;
}

}  // namespace

int render_command(Arguments& args) {
  add_options(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  RenderOptions o = render_options(args);
  check_combination(args, o);
  const auto path = args.path("FILE"), output = args.path("output");
  const bool turntable = args.has("turntable");
  const std::int64_t frames = args.integer_or("turntable", 1, 1, 9999);
  if (!turntable) {
    if (output.extension() != ".png")
      throw InputError(
          fmt::format("{}: pictures are PNG; give the output a name that ends in .png", output.string()));
    check_output(output, common.force, {path});
  }
  if (o.mode == RenderMode::error) return render_error(args, common, o, output);

  const Scene scene = open_scene(path, args, args.text_or("method", "vdvr"), args.has("unverified"));
  const Brightness bright = brightness_of(scene.volume);
  o.iso = args.number_or("iso", bright.threshold);
  o.transfer = transfer_for(args, bright);
  o.slice_range = std::pair{bright.grey_lo, bright.grey_hi};
  o.sampler = safe_sampler(o.sampler, scene.certificate);
  o.camera = camera_for(args, scene.volume.grid, orbit_options(args));

  Device device = open_device(common);
  ProgressLine progress(args.command(), common.quiet);
  const ResidentVolume resident(device, scene.volume);
  RenderResult result;
  if (turntable) {
    result = render_turntable(args, common, device, resident, scene, o, frames, progress.callback());
  } else {
    result = raycast(device, resident, o);
    throw_if_interrupted();
    write_png(output, result.image);
  }
  progress.clear();

  // The base samples alone are another field than the one certified.
  const bool certified = scene.verified && args.text_or("method", "vdvr") == "vdvr";
  const std::string stamp = certified        ? "certified"
                            : scene.verified ? "base samples alone: no certificate"
                            : scene.certificate
                                ? "UNVERIFIED: the content was not compared with the certificate"
                                : "no certificate";
  const Json json = {{"output", output.string()},
                     {"frames", frames},
                     {"verified", certified},
                     {"sampler", sampler_name(result.sampler)},
                     {"sampler_reason", result.sampler_reason},
                     {"samples", result.samples},
                     {"seconds", result.seconds},
                     {"epsilon_abs", certified ? Json(scene.certificate->epsilon_abs) : Json()},
                     {"outside_certificate", outside_certificate(o)},
                     {"device", device.info().name}};
  print_result(common, json, [&] {
    fmt::print("{}: {} x {}{}, {}\n", output.string(), o.width, o.height,
               turntable ? fmt::format(", {} pictures", frames) : "", stamp);
    fmt::print("  sampler      {} ({})\n", sampler_name(result.sampler), result.sampler_reason);
    if (certified)
      fmt::print("  certified    every sample of the field that was taken lies within {:.4g} of F\n",
                 scene.certificate->epsilon_abs);
    fmt::print("  not covered  {}\n", outside_certificate(o));
    // Slices count no samples along rays.
    fmt::print("  {}{:.3f} s on {}\n",
               result.samples == 0 ? "" : fmt::format("{} samples in ", result.samples), result.seconds,
               device.info().name);
  });
  return 0;
}

}  // namespace vdvr::cli
