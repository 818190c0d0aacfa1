#include "apps/vdvr/view.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

using Range = std::pair<double, double>;

bool is_file(const std::string& name) {
  const std::filesystem::path path(name);
  std::error_code error;
  return path.extension() == ".json" || path.has_parent_path() ||
         std::filesystem::is_regular_file(path, error);
}

void add_note(TransferFunction& f, const std::string& text) { f.note += (f.note.empty() ? "" : "; ") + text; }

}  // namespace

void add_transfer(Arguments& args) {
  std::string names;
  for (const auto& p : transfer_presets()) names += (names.empty() ? "" : ", ") + p.name;
  args.value(
          "tf", "FILE.json|NAME|list",
          "transfer function: a preset (" + names +
              "; `list` says what each is for), or a file of VDVR, 3D Slicer (.vp.json) or ParaView; without "
              "it one that suits the volume")
      .value("tf-range", "LO,HI|auto",
             "stretch it over these values; auto: the bulk of the volume's (default: presets auto, files as "
             "they stand); of a slice LO,HI is the window, black to white");
}

std::string preset_table() {
  std::string text;
  for (const auto& p : transfer_presets()) text += fmt::format("  {:<16} {}\n", p.name, p.purpose);
  return text;
}

std::optional<Range> given_range(const Arguments& args) {
  if (!args.has("tf-range") || args.text("tf-range") == "auto") return std::nullopt;
  const auto given = args.numbers("tf-range", 2);
  if (!((*given)[0] < (*given)[1]))
    throw InputError(fmt::format("--tf-range: {} is not below {}", (*given)[0], (*given)[1]));
  return Range{(*given)[0], (*given)[1]};
}

TransferFunction transfer_for(const Arguments& args, const Brightness& b, const Grid& grid) {
  std::optional<Range> range = given_range(args);
  if (!range && args.has("tf-range")) range = Range{b.lo, b.hi};
  if (!args.has("tf")) {
    const TransferFunction f = two_material_transfer(b);
    return range ? stretched(f, range->first, range->second) : f;
  }
  const std::string name = args.text("tf");
  if (!is_file(name)) {
    return range ? transfer_preset(name, range->first, range->second) : preset_for(name, b);
  }
  TransferFunction f = read_transfer_function(name);
  if (range) f = stretched(std::move(f), range->first, range->second);
  if (f.points.back().value < b.lo || f.points.front().value > b.hi)
    add_note(
        f, fmt::format("it spans {:.6g} to {:.6g}, the volume {:.6g} to {:.6g}: --tf-range auto stretches it",
                       f.points.front().value, f.points.back().value, b.lo, b.hi));
  return per_base_cell(std::move(f), grid);
}

void add_orbit(Arguments& args, const Orbit& fallback, const std::string& what) {
  args.value("azimuth", "DEG",
             fmt::format("about z; 0 looks along -y with x to the right (default {})", fallback.azimuth))
      .value("elevation", "DEG", fmt::format("towards view-up, -z (default {})", fallback.elevation))
      .value("zoom", "Z", fmt::format("1 fits {} (default {})", what, fallback.zoom));
}

Orbit orbit_options(const Arguments& args, const Orbit& fallback) {
  return {args.number_or("azimuth", fallback.azimuth), args.number_or("elevation", fallback.elevation),
          args.positive_or("zoom", fallback.zoom)};
}

void add_free_camera(Arguments& args) {
  args.value("camera-position", "X,Y,Z", "the eye, instead of azimuth, elevation and zoom (default theirs)")
      .value("camera-focal-point", "X,Y,Z", "default: the middle of what is framed")
      .value(
          "camera-view-up", "X,Y,Z",
          "default 0,0,-1: detector row 0 is up; looking along z the y direction that leaves x to the right")
      .value("camera-view-angle", "DEG", "vertical (default 30)");
}

const std::vector<std::string>& free_camera_options() {
  static const std::vector<std::string> names{"camera-position", "camera-focal-point", "camera-view-up",
                                              "camera-view-angle"};
  return names;
}

bool has_free_camera(const Arguments& args) {
  const auto& names = free_camera_options();
  return std::any_of(names.begin(), names.end(), [&](const auto& name) { return args.has(name); });
}

void add_frame(Arguments& args) {
  args.value("frame", "shown|grid",
             "what zoom 1 fits: what the transfer function or the surfaces show, or the whole grid (default "
             "shown; with --box grid)");
}

bool frames_grid(const Arguments& args) {
  return args.choice("frame", args.has("box") ? "grid" : "shown") == "grid";
}

OrbitFrame frame_for(const Arguments& args, const MixedVolume& volume, const RenderOptions& o,
                     const Orbit& orbit) {
  if (frames_grid(args) || o.mode == RenderMode::slice) return frame_grid(volume.grid);
  return args.has("turntable") ? frame_turn(volume, o, orbit.elevation)
                               : frame_view(volume, o, orbit.azimuth, orbit.elevation);
}

Camera camera_for(const Arguments& args, const OrbitFrame& frame, const Orbit& orbit) {
  const Camera camera = orbit_camera(frame, orbit.azimuth, orbit.elevation, orbit.zoom);
  if (!has_free_camera(args)) return camera;
  return look_at(args.vec3("camera-position").value_or(camera.position),
                 args.vec3("camera-focal-point").value_or(camera.focal_point), args.vec3("camera-view-up"),
                 args.positive_or("camera-view-angle", camera.view_angle_deg));
}

const char* sampler_name(SamplerKind kind) {
  return kind == SamplerKind::image3d ? "image3d" : kind == SamplerKind::buffer ? "buffer" : "auto";
}

SamplerKind sampler_option(const Arguments& args) {
  const std::string asked = args.choice("sampler", "auto");
  return asked == "auto"     ? SamplerKind::automatic
         : asked == "buffer" ? SamplerKind::buffer
                             : SamplerKind::image3d;
}

constexpr std::array<std::pair<const char*, GradientKind>, 4> kGradients{
    {{"auto", GradientKind::automatic},
     {"central", GradientKind::central},
     {"stored", GradientKind::stored},
     {"analytic", GradientKind::analytic}}};

GradientKind gradient_option(const Arguments& args) {
  const std::string asked = args.choice("gradient", "auto");
  return std::find_if(kGradients.begin(), kGradients.end(), [&](const auto& g) { return asked == g.first; })
      ->second;
}

const char* gradient_name(GradientKind kind) {
  return std::find_if(kGradients.begin(), kGradients.end(), [&](const auto& g) { return kind == g.second; })
      ->first;
}

}  // namespace vdvr::cli
