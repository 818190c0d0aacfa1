// Transfer functions from files: our own JSON, 3D Slicer's volume properties (.vp.json) and ParaView's colour
// presets, told apart by what they hold (docs/rendering.md).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/picture/render/transfer_curve.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {
namespace {

using nlohmann::json;

// No editor makes more; a file beyond either is not a transfer function.
constexpr std::size_t kMostPoints = 1 << 14;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{16} << 20;
// Values and opacities reach the device as fp32.
constexpr double kLargest = 1e30;

double number_in(const json& value, const std::string& name, double lo, double hi) {
  if (!value.is_number()) throw FileError(fmt::format("'{}' must be a number", name));
  const double v = value.get<double>();
  if (!(v >= lo && v <= hi)) throw FileError(fmt::format("'{}' is {}, outside [{}, {}]", name, v, lo, hi));
  return v;
}

const json& member(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) throw FileError(fmt::format("'{}' is missing", key));
  return object[key];
}

const json& list_of(const json& object, const char* key, const char* of_what) {
  const bool there = object.is_object() && object.contains(key) && object[key].is_array();
  if (!there || object[key].empty()) throw FileError(fmt::format("'{}' must be a list of {}", key, of_what));
  if (object[key].size() > 6 * kMostPoints)
    throw FileError(
        fmt::format("'{}' has {} entries, which is no transfer function", key, object[key].size()));
  return object[key];
}

Rgb colour_of(const json& value, const char* key) {
  if (!value.is_array() || value.size() != 3)
    throw FileError(fmt::format("'{}' must be three numbers in [0, 1]", key));
  return {number_in(value[0], key, 0, 1), number_in(value[1], key, 0, 1), number_in(value[2], key, 0, 1)};
}

void check_order(double before, double value, std::size_t index, const std::string& what) {
  if (value < before)
    throw FileError(fmt::format("{} must be in order of value, but point {} ({}) lies below point {} ({})",
                                what, index, value, index - 1, before));
}

void check_count(std::size_t count, const std::string& what) {
  if (count > kMostPoints)
    throw FileError(fmt::format("{} has {} points; at most {} are read", what, count, kMostPoints));
}

/// Runs `body` for each index, adding "what i" to what it throws.
template <class Body>
void each(std::size_t count, const std::string& what, Body&& body) {
  check_count(count, what);
  for (std::size_t i = 0; i < count; ++i) {
    try {
      body(i);
    } catch (FileError& e) {
      e.add_context(fmt::format("{} {}", what, i));
      throw;
    }
  }
}

// --- our own ---

TransferFunction read_own(const json& file) {
  const json& points = list_of(file, "points", "{\"value\", \"rgb\", \"opacity\"}");
  TransferFunction f;
  each(points.size(), "point", [&](std::size_t i) {
    TransferPoint p;
    p.value = number_in(member(points[i], "value"), "value", -kLargest, kLargest);
    p.rgb = colour_of(member(points[i], "rgb"), "rgb");
    p.opacity = number_in(member(points[i], "opacity"), "opacity", 0, 1);
    if (i > 0) check_order(f.points.back().value, p.value, i, "points");
    f.points.push_back(p);
  });
  return f;
}

// --- 3D Slicer ---

template <class Value, class ReadValue>
std::vector<CurveNode<Value>> slicer_nodes(const json& component, const char* key, ReadValue&& read) {
  const json& points = list_of(member(component, key), "points", "nodes");
  std::vector<CurveNode<Value>> nodes;
  each(points.size(), fmt::format("{}, point", key), [&](std::size_t i) {
    const json& p = points[i];
    CurveNode<Value> node;
    node.x = number_in(member(p, "x"), "x", -kLargest, kLargest);
    node.y = read(p);
    if (p.contains("midpoint")) node.midpoint = number_in(p["midpoint"], "midpoint", 0, 1);
    if (p.contains("sharpness")) node.sharpness = number_in(p["sharpness"], "sharpness", 0, 1);
    if (i > 0) check_order(nodes.back().x, node.x, i, key);
    nodes.push_back(node);
  });
  return nodes;
}

bool is_constant_one(const json& curve) {
  if (!curve.is_object() || !curve.contains("points") || !curve["points"].is_array()) return true;
  return std::all_of(curve["points"].begin(), curve["points"].end(),
                     [](const json& p) { return p.is_object() && p.contains("y") && p["y"] == 1.0; });
}

TransferFunction read_slicer(const json& file) {
  const json& properties = list_of(file, "volumeProperties", "volume properties");
  const json& components = list_of(properties[0], "components", "components");
  const json& c = components[0];
  TransferFunction f;
  const auto opacities = slicer_nodes<double>(
      c, "scalarOpacity", [](const json& p) { return number_in(member(p, "y"), "y", 0, 1); });
  const auto colours = slicer_nodes<Rgb>(
      c, "rgbTransferFunction", [](const json& p) { return colour_of(member(p, "color"), "color"); });
  f.points = joined(colours, opacities, ColourSpace::rgb);
  // VTK's default, which Slicer leaves out of older files.
  f.opacity_length = 1;
  if (c.contains("scalarOpacityUnitDistance"))
    f.opacity_length = number_in(c["scalarOpacityUnitDistance"], "scalarOpacityUnitDistance", 1e-12, 1e12);
  if (properties.size() > 1 || components.size() > 1)
    f.note = fmt::format("the first of {} volume properties and {} components", properties.size(),
                         components.size());
  const bool gradients = !(c.contains("disableGradientOpacity") && c["disableGradientOpacity"] == true);
  if (gradients && c.contains("gradientOpacity") && !is_constant_one(c["gradientOpacity"]))
    f.note += std::string(f.note.empty() ? "" : "; ") + "its opacity by gradient is left out";
  return f;
}

// --- ParaView ---

ColourSpace colour_space(const json& preset, std::string& note) {
  const std::string name = preset.contains("ColorSpace") && preset["ColorSpace"].is_string()
                               ? preset["ColorSpace"].get<std::string>()
                               : "RGB";
  const bool wrap = preset.contains("HSVWrap") && (preset["HSVWrap"] == true || preset["HSVWrap"] == 1);
  if (name == "RGB") return ColourSpace::rgb;
  if (name == "HSV") return wrap ? ColourSpace::hsv_wrap : ColourSpace::hsv;
  if (name == "Lab") return ColourSpace::lab;
  if (name == "Diverging") return ColourSpace::diverging;
  if (name == "Step") return ColourSpace::step;
  if (name == "Lab/CIEDE2000") {
    note = "colours interpolated in Lab instead of Lab/CIEDE2000";
    return ColourSpace::lab;
  }
  throw FileError(
      fmt::format("'ColorSpace' is '{}'; there are RGB, HSV, Lab, Lab/CIEDE2000, Diverging and Step", name));
}

ColourNodes paraview_colours(const json& preset) {
  const json& values = list_of(preset, "RGBPoints", "numbers, four a point: value, r, g, b");
  if (values.size() % 4 != 0)
    throw FileError(
        fmt::format("'RGBPoints' has {} numbers, not four a point (value, r, g, b)", values.size()));
  ColourNodes nodes;
  each(values.size() / 4, "RGBPoints, point", [&](std::size_t i) {
    CurveNode<Rgb> node;
    node.x = number_in(values[4 * i], "value", -kLargest, kLargest);
    for (std::size_t c = 0; c < 3; ++c) node.y[c] = number_in(values[4 * i + 1 + c], "r, g, b", 0, 1);
    if (i > 0) check_order(nodes.back().x, node.x, i, "RGBPoints");
    nodes.push_back(node);
  });
  return nodes;
}

/// Four numbers a node (value, opacity, midpoint, sharpness) or, in older files, three.
std::optional<OpacityNodes> paraview_opacities(const json& values, std::size_t width) {
  if (values.size() % width != 0) return std::nullopt;
  OpacityNodes nodes;
  for (std::size_t i = 0; i < values.size(); i += width) {
    const auto at = [&](std::size_t k) { return values[i + k].get<double>(); };
    CurveNode<double> node{at(0), at(1), at(2), width > 3 ? at(3) : 0};
    const auto is_part = [](double v) { return v >= 0 && v <= 1; };
    if (!(std::abs(node.x) <= kLargest) || !is_part(node.y) || !is_part(node.midpoint) ||
        !is_part(node.sharpness) || (!nodes.empty() && node.x < nodes.back().x))
      return std::nullopt;
    nodes.push_back(node);
  }
  return nodes;
}

OpacityNodes paraview_opacities(const json& preset) {
  const json& values =
      list_of(preset, "Points", "numbers, four a point: value, opacity, midpoint, sharpness");
  for (const auto& v : values)
    if (!v.is_number()) throw FileError("'Points' must hold numbers only");
  check_count(values.size() / 4, "Points");
  // A length that both divide is read as fours wherever that makes sense.
  for (const std::size_t width : {std::size_t{4}, std::size_t{3}})
    if (auto nodes = paraview_opacities(values, width)) return *nodes;
  throw FileError(fmt::format(
      "'Points' ({} numbers) must be value, opacity, midpoint and sharpness of each node, values in "
      "order, the rest in [0, 1]",
      values.size()));
}

TransferFunction read_paraview(const json& file) {
  const json& preset = file.is_array() ? file[0] : file;
  TransferFunction f;
  if (preset.contains("Name") && preset["Name"].is_string()) f.name = preset["Name"].get<std::string>();
  if (!preset.contains("RGBPoints") && preset.contains("IndexedColors"))
    throw FileError("'IndexedColors' are for categories; a volume needs 'RGBPoints'");
  if (preset.contains("UseLogScale") && (preset["UseLogScale"] == true || preset["UseLogScale"] == 1))
    throw FileError("'UseLogScale' is on; colours over a logarithm are not supported");
  const ColourSpace space = colour_space(preset, f.note);
  const auto remark = [&](const std::string& text) { f.note += (f.note.empty() ? "" : "; ") + text; };
  const ColourNodes colours = paraview_colours(preset);
  OpacityNodes opacities;
  if (preset.contains("Points") && !preset["Points"].empty()) {
    opacities = paraview_opacities(preset);
  } else {
    opacities = {{colours.front().x, 0}, {colours.back().x, 1}};
    remark("no opacities in the file: a ramp from 0 at its first value to 1 at its last");
  }
  if (file.is_array() && file.size() > 1) remark(fmt::format("the first of {} presets", file.size()));
  f.points = joined(colours, opacities, space);
  return f;
}

TransferFunction read_any(const json& file) {
  const auto is_preset = [](const json& p) {
    return p.is_object() &&
           (p.contains("RGBPoints") || p.contains("IndexedColors") || p.contains("ColorSpace"));
  };
  if (is_preset(file) || (file.is_array() && !file.empty() && is_preset(file[0]))) return read_paraview(file);
  if (file.is_object() && file.contains("volumeProperties")) return read_slicer(file);
  if (file.is_object() && file.contains("points")) return read_own(file);
  throw FileError(
      "is no transfer function: it has neither 'points' (VDVR), 'volumeProperties' (3D Slicer) nor "
      "'RGBPoints' "
      "(ParaView)");
}

}  // namespace

TransferFunction read_transfer_function(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream in(path);
  if (!in || !std::filesystem::is_regular_file(path, error))
    throw FileError(
        fmt::format("{}: cannot be opened; `tf` takes a JSON file or the name of a preset", path.string()));
  if (const auto bytes = std::filesystem::file_size(path, error); bytes > kMostBytes)
    throw FileError(
        fmt::format("{}: has {} bytes; no transfer function is above {}", path.string(), bytes, kMostBytes));
  try {
    TransferFunction f = read_any(json::parse(in));
    if (f.name.empty()) f.name = path.stem().string();
    return f;
  } catch (const json::exception& e) {
    throw FileError(fmt::format("{}: not a transfer function in JSON: {}", path.string(), e.what()));
  } catch (FileError& e) {
    e.add_context(path.string());
    throw;
  }
}

}  // namespace vdvr
