// A volume's facts for viewers, and the options of a view.
#include "vdvr/expert/live_view.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/scan/geometry/vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr std::size_t kBins = 128;
constexpr const char* kModeNames[] = {"dvr", "iso", "mip", "slice", "error"};

std::vector<double> shares(const std::vector<float>& samples, double lo, double hi) {
  std::vector<double> bins(kBins, 0.0);
  const double scale = hi > lo ? static_cast<double>(kBins) / (hi - lo) : 0;
  for (const float s : samples) {
    const double at = (static_cast<double>(s) - lo) * scale;
    bins[static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(kBins - 1)))] += 1;
  }
  for (double& b : bins) b /= static_cast<double>(samples.size());
  return bins;
}

/// Of the sphere that fits the picture at zoom 1.
double diameter(const OrbitFrame& frame) {
  return 2 * frame.distance * std::sin(Camera{}.view_angle_deg / 2 * std::numbers::pi / 180);
}

OrbitFrame first_frame(const MixedVolume& volume, const Brightness& brightness) {
  if (is_thin(volume.grid)) return frame_grid(volume.grid);
  RenderOptions o;
  o.height = o.width;
  o.transfer = two_material_transfer(brightness);
  return frame_turn(volume, o, LiveView{}.elevation_deg);
}

void require(bool good, const std::string& what) {
  if (!good) throw InputError(what);
}

Vec3 unit(const Vec3& v) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

}  // namespace

LiveScene live_scene(const MixedVolume& volume, const std::optional<Certificate>& certificate) {
  LiveScene scene;
  scene.grid = volume.grid;
  scene.brightness = brightness_of(volume);
  scene.frame = first_frame(volume, scene.brightness);
  const std::vector<float> samples = on_grid(volume).samples;
  const auto [lo, hi] = std::minmax_element(samples.begin(), samples.end());
  scene.range = {static_cast<double>(*lo), static_cast<double>(*hi)};
  scene.histogram = shares(samples, scene.range.first, scene.range.second);
  if (certificate) scene.sampler = SamplerKind::buffer;
  scene.has_bounds = certificate && !certificate->comparison && !certificate->brick_totals.empty();
  if (certificate) scene.epsilon_abs = certificate->epsilon_abs;
  return scene;
}

LiveView first_view(const LiveScene& scene, std::int64_t width, std::int64_t height) {
  LiveView view;
  const Brightness& b = scene.brightness;
  view.transfer = two_material_transfer(b);
  view.iso = b.threshold;
  view.slice_position = b.dense_center[static_cast<std::size_t>(view.slice_axis)];
  view.slice_range = {b.grey_lo, b.grey_hi};
  if (width < height) view.zoom = std::max(0.25, static_cast<double>(width) / static_cast<double>(height));
  if (is_thin(scene.grid)) view.mode = RenderMode::slice;
  return view;
}

void check_view(const LiveView& v, const LiveScene& scene) {
  require(std::isfinite(v.azimuth_deg) && std::abs(v.azimuth_deg) <= 1e6,
          fmt::format("`azimuth` {} is not an angle", v.azimuth_deg));
  require(v.elevation_deg >= -90 && v.elevation_deg <= 90,
          fmt::format("`elevation` {} lies outside -90 to 90", v.elevation_deg));
  require(v.zoom >= 0.25 && v.zoom <= 64, fmt::format("`zoom` {} lies outside 0.25 to 64", v.zoom));
  for (const double p : v.pan) require(p >= -2 && p <= 2, fmt::format("`pan` {} lies outside -2 to 2", p));
  require(std::isfinite(v.iso), fmt::format("`iso` {} is not finite", v.iso));
  require(v.slice_axis >= 0 && v.slice_axis <= 2,
          fmt::format("`slice_axis` {} is not 0 (x), 1 (y) or 2 (z)", v.slice_axis));
  const auto a = static_cast<std::size_t>(v.slice_axis);
  const double lo = scene.grid.origin[a],
               hi = lo + static_cast<double>(scene.grid.cells[a]) * scene.grid.spacing[a];
  require(v.slice_position >= lo && v.slice_position <= hi,
          fmt::format("`slice_position` {} lies outside the volume, {} to {}", v.slice_position, lo, hi));
  const auto [black, white] = v.slice_range;
  require(std::isfinite(black) && std::isfinite(white) && black <= white,
          fmt::format("`slice_range` {}, {} must be finite and in order", black, white));
  if (v.clip)
    for (std::size_t i = 0; i < 3; ++i)
      require(
          std::isfinite((*v.clip)[i]) && std::isfinite((*v.clip)[i + 3]) && (*v.clip)[i] < (*v.clip)[i + 3],
          fmt::format("`clip` {} to {} along {} must be finite and in order", (*v.clip)[i], (*v.clip)[i + 3],
                      "xyz"[i]));
  require(v.mode != RenderMode::integral, "`mode` integral is of `render`; a live view has none");
  require(scene.has_bounds || (!v.bound && v.mode != RenderMode::error),
          "the volume has no certificate to take a bound from");
}

Camera camera_of(const LiveView& view, const OrbitFrame& frame) {
  Camera camera = orbit_camera(frame, view.azimuth_deg, view.elevation_deg, view.zoom);
  if (view.pan[0] == 0 && view.pan[1] == 0) return camera;
  const Vec3 forward{camera.focal_point[0] - camera.position[0], camera.focal_point[1] - camera.position[1],
                     camera.focal_point[2] - camera.position[2]};
  const Vec3 right = unit(cross(forward, camera.view_up)), up = unit(camera.view_up);
  const double d = diameter(frame);
  for (std::size_t a = 0; a < 3; ++a) {
    const double shift = d * (view.pan[1] * up[a] - view.pan[0] * right[a]);
    camera.position[a] += shift;
    camera.focal_point[a] += shift;
  }
  return camera;
}

RenderOptions options_of(const LiveView& view, const LiveScene& scene, std::int64_t width,
                         std::int64_t height) {
  RenderOptions o;
  o.mode = view.mode;
  o.width = width;
  o.height = height;
  o.camera = camera_of(view, scene.frame);
  o.transfer = view.transfer;
  o.surfaces = {{view.iso}};
  o.slice_axis = view.slice_axis;
  o.slice_position = view.slice_position;
  o.slice_range = view.slice_range;
  o.shading = view.shading;
  if (view.clip) {
    const auto& c = *view.clip;
    o.clip = Clip{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  }
  o.gradient = GradientKind::automatic;
  // As `render` takes them.
  if (o.mode == RenderMode::dvr) o.step_mode = StepMode::adaptive;
  o.sampler = scene.sampler;
  return o;
}

std::vector<std::string> render_words(const LiveView& v, const LiveScene& scene, std::int64_t width,
                                      std::int64_t height) {
  std::vector<std::string> words{"--mode", kModeNames[static_cast<std::size_t>(v.mode)], "--size",
                                 fmt::format("{}x{}", width, height)};
  const auto add = [&](const char* name, const std::string& value) {
    words.emplace_back(name);
    words.push_back(value);
  };
  if (v.mode == RenderMode::slice || v.mode == RenderMode::error) {
    // A viewer's controls stand around its slices.
    if (v.mode == RenderMode::slice) words.emplace_back("--plain");
    add("--slice-axis", std::string(1, "xyz"[v.slice_axis]));
    add("--slice-position", fmt::format("{}", v.slice_position));
    if (v.mode == RenderMode::slice && v.slice_range.first < v.slice_range.second)
      add("--tf-range", fmt::format("{},{}", v.slice_range.first, v.slice_range.second));
    return words;
  }
  if (v.mode == RenderMode::dvr) add("--step-mode", "adaptive");
  if (v.mode == RenderMode::iso) add("--iso", fmt::format("{}", v.iso));
  if (!v.shading && v.mode != RenderMode::mip) words.emplace_back("--no-shading");
  if (v.clip) add("--clip", fmt::format("{}", fmt::join(*v.clip, ",")));
  // In full, so that nothing depends on what `render` frames by itself.
  const Camera c = camera_of(v, scene.frame);
  const auto vec = [](const Vec3& p) { return fmt::format("{},{},{}", p[0], p[1], p[2]); };
  add("--camera-position", vec(c.position));
  add("--camera-focal-point", vec(c.focal_point));
  add("--camera-view-up", vec(c.view_up));
  add("--camera-view-angle", fmt::format("{}", c.view_angle_deg));
  return words;
}

}  // namespace vdvr
