// Transfer functions: presets, stretching, opacity per cell. Files: transfer_file.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vdvr/error.hpp"
#include "vdvr/expert/transfer_function.hpp"

namespace vdvr {
namespace {

using Points = std::vector<TransferPoint>;

struct Preset {
  std::string name, purpose;
  Points points;
};

// Control points on [0, 1]; opacities are those of one base cell, so a few cells of dense material are opaque
// while soft material takes dozens.
const std::vector<Preset>& presets() {
  static const std::vector<Preset> table{
      // Air, and the noise and streaks around it, are clear.
      {"default",
       "warm veil of soft material, bright dense material",
       {{0.00, {0.00, 0.00, 0.00}, 0.0},
        {0.28, {0.35, 0.12, 0.06}, 0.0},
        {0.36, {0.62, 0.25, 0.12}, 0.015},
        {0.48, {0.85, 0.48, 0.25}, 0.06},
        {0.62, {0.95, 0.76, 0.52}, 0.20},
        {0.78, {0.99, 0.93, 0.82}, 0.50},
        {1.00, {1.00, 1.00, 0.98}, 0.85}}},
      {"grey",
       "grey ramp, opacity grows with density",
       {{0.0, {0, 0, 0}, 0.0}, {0.12, {0.12, 0.12, 0.12}, 0.0}, {1.0, {1, 1, 1}, 0.35}}},
      {"bone",
       "the densest third only, ivory",
       {{0.00, {0.30, 0.26, 0.22}, 0.0},
        {0.50, {0.70, 0.60, 0.48}, 0.0},
        {0.60, {0.88, 0.80, 0.68}, 0.25},
        {0.75, {0.96, 0.92, 0.84}, 0.60},
        {1.00, {1.00, 0.99, 0.96}, 0.90}}},
      {"soft",
       "soft material as a translucent body, dense material faint in it",
       {{0.00, {0.25, 0.05, 0.05}, 0.0},
        {0.12, {0.45, 0.12, 0.10}, 0.0},
        {0.30, {0.80, 0.38, 0.30}, 0.05},
        {0.50, {0.95, 0.66, 0.52}, 0.09},
        {0.70, {0.98, 0.85, 0.74}, 0.07},
        {1.00, {1.00, 0.97, 0.92}, 0.20}}},
      {"skin",
       "the outer surface of soft material, opaque",
       {{0.00, {0.50, 0.30, 0.22}, 0.0},
        {0.15, {0.60, 0.38, 0.28}, 0.0},
        {0.25, {0.88, 0.65, 0.52}, 0.35},
        {0.40, {0.93, 0.74, 0.62}, 0.80},
        {1.00, {0.98, 0.90, 0.82}, 0.90}}},
      // A tent of a few percent: a shell of a cell or so where the volume crosses the middle.
      {"iso",
       "a shell at the middle: between background and object",
       {{0.00, {0.93, 0.86, 0.74}, 0.0},
        {0.46, {0.93, 0.86, 0.74}, 0.0},
        {0.50, {0.93, 0.86, 0.74}, 0.90},
        {0.54, {0.93, 0.86, 0.74}, 0.0},
        {1.00, {0.93, 0.86, 0.74}, 0.0}}},
      // The signal's ripples cross 1/2 as many shells; above it opaque, so that the front one hides the rest.
      {"marschner-lobb",
       "the test signal's surface at 1/2, opaque",
       {{0.00, {0.20, 0.35, 0.60}, 0.0},
        {0.48, {0.30, 0.55, 0.85}, 0.0},
        {0.52, {0.85, 0.88, 0.90}, 0.95},
        {1.00, {0.98, 0.80, 0.45}, 0.95}}},
      {"mip",
       "grey ramp, opaque: for maximum-intensity projection",
       {{0.0, {0, 0, 0}, 1.0}, {1.0, {1, 1, 1}, 1.0}}},
  };
  return table;
}

}  // namespace

const std::vector<TransferPreset>& transfer_presets() {
  static const std::vector<TransferPreset> list = [] {
    std::vector<TransferPreset> names;
    for (const auto& p : presets()) names.push_back({p.name, p.purpose});
    return names;
  }();
  return list;
}

TransferFunction transfer_preset(const std::string& name, double lo, double hi) {
  std::string known;
  for (const auto& preset : presets()) {
    if (preset.name == name) return stretched({name, preset.points}, lo, hi);
    known += (known.empty() ? "" : ", ") + preset.name;
  }
  throw InputError(
      fmt::format("there is no transfer function '{}'; take one of {}, or a JSON file", name, known));
}

TransferPoint transfer_at(const std::vector<TransferPoint>& points, double value) {
  if (!(value > points.front().value)) return points.front();
  for (std::size_t i = 1; i < points.size(); ++i) {
    const auto &a = points[i - 1], &b = points[i];
    if (value > b.value || !(b.value > a.value)) continue;
    const double f = (value - a.value) / (b.value - a.value);
    TransferPoint p{value, {}, (1 - f) * a.opacity + f * b.opacity};
    for (std::size_t c = 0; c < 3; ++c) p.rgb[c] = (1 - f) * a.rgb[c] + f * b.rgb[c];
    return p;
  }
  return points.back();
}

TransferFunction stretched(TransferFunction f, double lo, double hi) {
  if (!std::isfinite(lo) || !std::isfinite(hi) || hi < lo)
    throw InputError(fmt::format("transfer function '{}' cannot be stretched over [{}, {}]", f.name, lo, hi));
  if (f.points.empty()) throw InputError(fmt::format("transfer function '{}' has no points", f.name));
  const double first = f.points.front().value, span = f.points.back().value - first;
  for (auto& p : f.points) p.value = span > 0 ? lo + (p.value - first) / span * (hi - lo) : lo;
  return f;
}

TransferFunction per_base_cell(TransferFunction f, const Grid& grid) {
  if (f.opacity_length == 0) return f;
  const double cell = *std::min_element(grid.spacing.begin(), grid.spacing.end());
  // What passes n lengths passes as much as their product.
  for (auto& p : f.points) p.opacity = 1 - std::pow(1 - p.opacity, cell / f.opacity_length);
  f.opacity_length = 0;
  return f;
}

}  // namespace vdvr
