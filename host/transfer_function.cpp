// Transfer functions: presets and their JSON form. Called by the render, run and bench commands.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "vdvr/error.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {
namespace {

using Points = std::vector<TransferPoint>;

// Control points on [0, 1]; opacities are those of one base cell, so a few cells of dense material are opaque
// while soft material takes dozens.
const std::vector<std::pair<std::string, Points>>& presets() {
  static const std::vector<std::pair<std::string, Points>> table{
      // Air, and the noise and streaks around it, are clear; soft material is a warm veil; dense material is
      // bright.
      {"default",
       {{0.00, {0.00, 0.00, 0.00}, 0.0},
        {0.28, {0.35, 0.12, 0.06}, 0.0},
        {0.36, {0.62, 0.25, 0.12}, 0.015},
        {0.48, {0.85, 0.48, 0.25}, 0.06},
        {0.62, {0.95, 0.76, 0.52}, 0.20},
        {0.78, {0.99, 0.93, 0.82}, 0.50},
        {1.00, {1.00, 1.00, 0.98}, 0.85}}},
      {"grey", {{0.0, {0, 0, 0}, 0.0}, {0.12, {0.12, 0.12, 0.12}, 0.0}, {1.0, {1, 1, 1}, 0.35}}},
      {"bone",
       {{0.00, {0.30, 0.26, 0.22}, 0.0},
        {0.50, {0.70, 0.60, 0.48}, 0.0},
        {0.60, {0.88, 0.80, 0.68}, 0.25},
        {0.75, {0.96, 0.92, 0.84}, 0.60},
        {1.00, {1.00, 0.99, 0.96}, 0.90}}},
      {"soft",
       {{0.00, {0.25, 0.05, 0.05}, 0.0},
        {0.12, {0.45, 0.12, 0.10}, 0.0},
        {0.30, {0.80, 0.38, 0.30}, 0.05},
        {0.50, {0.95, 0.66, 0.52}, 0.09},
        {0.70, {0.98, 0.85, 0.74}, 0.07},
        {1.00, {1.00, 0.97, 0.92}, 0.20}}},
      {"mip", {{0.0, {0, 0, 0}, 1.0}, {1.0, {1, 1, 1}, 1.0}}},
  };
  return table;
}

double number_in(const nlohmann::json& value, const char* name, double lo, double hi) {
  if (!value.is_number()) throw FileError(fmt::format("'{}' must be a number", name));
  const double v = value.get<double>();
  if (!(v >= lo && v <= hi)) throw FileError(fmt::format("'{}' is {}, outside [{}, {}]", name, v, lo, hi));
  return v;
}

TransferPoint parse_point(const nlohmann::json& p) {
  for (const char* key : {"value", "rgb", "opacity"})
    if (!p.is_object() || !p.contains(key)) throw FileError(fmt::format("'{}' is missing", key));
  TransferPoint point;
  // Values and opacities reach the device as fp32.
  point.value = number_in(p["value"], "value", -1e30, 1e30);
  point.opacity = number_in(p["opacity"], "opacity", 0, 1);
  if (!p["rgb"].is_array() || p["rgb"].size() != 3) throw FileError("'rgb' must be three numbers in [0, 1]");
  for (std::size_t i = 0; i < 3; ++i) point.rgb[i] = number_in(p["rgb"][i], "rgb", 0, 1);
  return point;
}

}  // namespace

TransferFunction transfer_preset(const std::string& name, double lo, double hi) {
  if (!std::isfinite(lo) || !std::isfinite(hi) || hi < lo)
    throw InputError(fmt::format("transfer function '{}' cannot be stretched over [{}, {}]", name, lo, hi));
  std::string known;
  for (const auto& [preset, points] : presets()) {
    if (preset == name) {
      TransferFunction f{name, points};
      for (auto& p : f.points) p.value = lo + p.value * (hi - lo);
      return f;
    }
    known += (known.empty() ? "" : ", ") + preset;
  }
  throw InputError(
      fmt::format("there is no transfer function '{}'; take one of {}, or a JSON file", name, known));
}

TransferFunction read_transfer_function(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in)
    throw FileError(
        fmt::format("{}: cannot be opened; --tf takes a JSON file or the name of a preset", path.string()));
  TransferFunction f;
  f.name = path.stem().string();
  std::size_t index = 0;
  try {
    const auto json = nlohmann::json::parse(in);
    if (!json.is_object() || !json.contains("points") || !json["points"].is_array() || json["points"].empty())
      throw FileError("'points' must be a list of {\"value\", \"rgb\", \"opacity\"}");
    for (const auto& p : json["points"]) {
      f.points.push_back(parse_point(p));
      ++index;
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(fmt::format("{}: not a transfer function in JSON: {}", path.string(), e.what()));
  } catch (FileError& e) {
    e.add_context(fmt::format("{}: point {}", path.string(), index));
    throw;
  }
  for (std::size_t i = 1; i < f.points.size(); ++i)
    if (f.points[i].value < f.points[i - 1].value)
      throw FileError(
          fmt::format("{}: points must be in order of value, but point {} ({}) lies below point {} ({})",
                      path.string(), i, f.points[i].value, i - 1, f.points[i - 1].value));
  return f;
}

}  // namespace vdvr
