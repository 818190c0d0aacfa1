// Views as JSON, and what of them depends on the volume.
#include <fmt/format.h>

#include <cmath>
#include <initializer_list>

#include "host/scan/geometry/description.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t longest_side = 4096;
constexpr std::size_t most_views = 1000;

void refuse(const io::Description& view, std::initializer_list<const char*> names, const char* why) {
  for (const char* name : names)
    if (view.has(name)) view.fail(fmt::format("{} {}", view.quoted(name), why));
}

Camera camera_of(const io::Description& view) {
  refuse(view, {"azimuth", "elevation", "zoom"}, "is of a view without 'position'");
  Camera camera;
  camera.position = view.vec3("position");
  if (view.has("focal_point")) camera.focal_point = view.vec3("focal_point");
  if (view.has("view_up")) camera.view_up = view.vec3("view_up");
  camera.view_angle_deg = view.number_or("view_angle", camera.view_angle_deg);
  try {
    check_camera(camera);
  } catch (const InputError& e) {
    view.fail(fmt::format("{}: {}", view.quoted("position"), e.what()));
  }
  return camera;
}

WantedView view_of(const io::Description& view) {
  WantedView out;
  if (view.has("position")) {
    out.camera = camera_of(view);
    return out;
  }
  refuse(view, {"focal_point", "view_up", "view_angle"}, "goes with 'position'");
  out.azimuth_deg = view.number_or("azimuth", out.azimuth_deg);
  out.elevation_deg = view.number_or("elevation", out.elevation_deg);
  if (view.has("zoom")) out.zoom = view.positive("zoom");
  return out;
}

void read_size(const io::Description& file, WantedViews& out) {
  const auto size = file.numbers("size");
  const auto good = [](double n) { return n >= 1 && n <= longest_side && n == std::floor(n); };
  if (size.size() != 2 || !good(size[0]) || !good(size[1]))
    file.fail(fmt::format("'size' must be [width, height], each 1 to {}", longest_side));
  out.width = static_cast<std::int64_t>(size[0]);
  out.height = static_cast<std::int64_t>(size[1]);
}

void read_background(const io::Description& file, WantedViews& out) {
  const auto rgb = file.numbers("background");
  if (rgb.size() != 3 && rgb.size() != 6) file.fail("'background' has neither 3 nor 6 numbers");
  for (std::size_t i = 0; i < 3; ++i) {
    out.background_top[i] = rgb[i];
    out.background_bottom[i] = rgb[rgb.size() - 3 + i];
  }
  for (const double part : rgb)
    if (!(part >= 0 && part <= 1)) file.fail("'background' has a number outside of 0 to 1");
}

}  // namespace

WantedViews read_views(const std::filesystem::path& path) {
  const io::Description file(path, {"size", "tf", "tf_range", "background", "views"});
  WantedViews out;
  out.sha256 = sha256_of_file(path);
  if (file.has("size")) read_size(file, out);
  if (file.has("background")) read_background(file, out);
  if (file.has("tf_range")) {
    const auto range = file.numbers("tf_range");
    if (range.size() != 2 || !(range[0] < range[1])) file.fail("'tf_range' is no [low, high]");
    out.transfer_range = {range[0], range[1]};
  }
  const std::set<std::string> known{"azimuth",     "elevation", "zoom",      "position",
                                    "focal_point", "view_up",   "view_angle"};
  for (const io::Description& view : file.members("views", known, most_views))
    out.views.push_back(view_of(view));
  if (!file.has("tf")) return out;
  out.transfer = file.text("tf");
  if (out.transfer.empty()) file.fail("'tf' is no name of a preset or a file");
  // A file of a transfer function lies beside the views.
  const std::filesystem::path transfer(out.transfer);
  if (transfer.extension() == ".json" && transfer.is_relative())
    out.transfer = (path.parent_path() / transfer).string();
  return out;
}

PictureViews views_of(const WantedViews& wanted, const MixedVolume& volume) {
  PictureViews out{{}, wanted.width, wanted.height, {}, wanted.background_top, wanted.background_bottom};
  for (const WantedView& v : wanted.views)
    out.cameras.push_back(v.camera ? *v.camera
                                   : orbit_camera(volume.grid, v.azimuth_deg, v.elevation_deg, v.zoom));
  if (std::filesystem::path(wanted.transfer).extension() == ".json") {
    out.transfer = read_transfer_function(wanted.transfer);
    if (wanted.transfer_range)
      out.transfer =
          stretched(std::move(out.transfer), wanted.transfer_range->first, wanted.transfer_range->second);
    out.transfer = per_base_cell(std::move(out.transfer), volume.grid);
    return out;
  }
  const Brightness bright = brightness_of(volume);
  const auto range = wanted.transfer_range.value_or(std::pair{bright.lo, bright.hi});
  if (!wanted.transfer.empty()) out.transfer = transfer_preset(wanted.transfer, range.first, range.second);
  else if (wanted.transfer_range)
    out.transfer = stretched(two_material_transfer(bright), range.first, range.second);
  else out.transfer = two_material_transfer(bright);
  return out;
}

}  // namespace vdvr
