// Views as JSON, and what of them depends on the volume.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "vdvr/automatic_view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::json;
constexpr std::int64_t most_pixels = 4096;
constexpr std::size_t most_views = 1000, most_bytes = std::size_t{1} << 22;

class ViewsReader {
 public:
  explicit ViewsReader(const std::filesystem::path& path) : path_(path) {}

  WantedViews read() {
    std::ifstream file(path_, std::ios::binary);
    if (!file) throw FileError(fmt::format("{}: cannot be read", path_.string()));
    std::string text(most_bytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (text.size() > most_bytes) fail("", "is larger than 4 MiB, which no list of views is");
    const Json json = Json::parse(text, nullptr, false);
    if (!json.is_object()) fail("", "is no JSON object with `views`");
    WantedViews out;
    Sha256 sha;
    sha.update(text.data(), text.size());
    out.sha256 = sha.hex();
    for (const auto& [name, value] : json.items()) take(out, name, value);
    if (out.views.empty())
      fail("views", "is missing: a list of {\"azimuth\", \"elevation\", \"zoom\"} or of cameras");
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& member, const std::string& what) const {
    throw FileError(
        fmt::format("{}{}: {}", path_.string(), member.empty() ? "" : ", `" + member + "`", what));
  }
  [[nodiscard]] double number(const std::string& member, const Json& json) const {
    if (!json.is_number() || !std::isfinite(json.get<double>())) fail(member, json.dump() + " is no number");
    return json.get<double>();
  }
  [[nodiscard]] std::vector<double> numbers(const std::string& member, const Json& json) const {
    if (!json.is_array()) fail(member, "is no list of numbers");
    std::vector<double> out;
    for (const Json& one : json) out.push_back(number(member, one));
    return out;
  }
  [[nodiscard]] Vec3 vec3(const std::string& member, const Json& json) const {
    const auto v = numbers(member, json);
    if (v.size() != 3) fail(member, fmt::format("has {} numbers, not 3", v.size()));
    return {v[0], v[1], v[2]};
  }

  void take(WantedViews& out, const std::string& name, const Json& value) const {
    if (name == "size") {
      const auto size = numbers(name, value);
      const auto good = [](double n) { return n >= 1 && n <= most_pixels && n == std::floor(n); };
      if (size.size() != 2 || !good(size[0]) || !good(size[1]))
        fail(name, fmt::format("is {}; [width, height] are 1 to {}", value.dump(), most_pixels));
      out.width = static_cast<std::int64_t>(size[0]);
      out.height = static_cast<std::int64_t>(size[1]);
    } else if (name == "tf") {
      if (!value.is_string() || value.get<std::string>().empty())
        fail(name, "is no name of a preset or a file");
      out.transfer = value.get<std::string>();
    } else if (name == "tf_range") {
      const auto range = numbers(name, value);
      if (range.size() != 2 || !(range[0] < range[1])) fail(name, value.dump() + " is no [low, high]");
      out.transfer_range = {range[0], range[1]};
    } else if (name == "background") {
      const auto rgb = numbers(name, value);
      if (rgb.size() != 3 && rgb.size() != 6) fail(name, "has neither 3 nor 6 numbers");
      for (std::size_t i = 0; i < rgb.size(); ++i) {
        if (!(rgb[i] >= 0 && rgb[i] <= 1)) fail(name, "has a number outside of 0 to 1");
        (i < 3 ? out.background_top : out.background_bottom)[i % 3] = rgb[i];
        if (rgb.size() == 3) out.background_bottom[i] = rgb[i];
      }
    } else if (name == "views") {
      if (!value.is_array() || value.empty() || value.size() > most_views)
        fail(name, fmt::format("is no list of 1 to {} views", most_views));
      for (const Json& one : value) out.views.push_back(view(one));
    } else {
      fail(name, "is not known; there are size, tf, tf_range, background and views");
    }
  }

  [[nodiscard]] WantedView view(const Json& json) const {
    if (!json.is_object()) fail("views", json.dump() + " is no view");
    WantedView out;
    if (json.contains("position")) {
      Camera camera;
      for (const auto& [name, value] : json.items()) {
        if (name == "position") camera.position = vec3(name, value);
        else if (name == "focal_point") camera.focal_point = vec3(name, value);
        else if (name == "view_up") camera.view_up = vec3(name, value);
        else if (name == "view_angle") camera.view_angle_deg = number(name, value);
        else fail(name, "is not of a camera: position, focal_point, view_up, view_angle");
      }
      try {
        check_camera(camera);
      } catch (const InputError& e) {
        fail("views", e.what());
      }
      out.camera = camera;
      return out;
    }
    for (const auto& [name, value] : json.items()) {
      if (name == "azimuth") out.azimuth_deg = number(name, value);
      else if (name == "elevation") out.elevation_deg = number(name, value);
      else if (name == "zoom") out.zoom = number(name, value);
      else fail(name, "is not of a view: azimuth, elevation, zoom, or position and so on");
    }
    if (!(out.zoom > 0)) fail("zoom", fmt::format("is {}, not above 0", out.zoom));
    return out;
  }

  std::filesystem::path path_;
};

}  // namespace

WantedViews read_views(const std::filesystem::path& path) {
  WantedViews views = ViewsReader(path).read();
  // A file of a transfer function lies beside the views.
  const std::filesystem::path transfer(views.transfer);
  if (transfer.extension() == ".json" && transfer.is_relative())
    views.transfer = (path.parent_path() / transfer).string();
  return views;
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
