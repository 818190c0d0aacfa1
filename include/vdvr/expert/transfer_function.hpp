// Density to colour and opacity: presets, files of other programs, and what a ray takes.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Control points of density -> colour and opacity per base cell; linear between them.
struct TransferPoint {
  double value = 0;
  std::array<double, 3> rgb{1, 1, 1};
  double opacity = 0;  ///< over a path of one base cell
};
struct TransferFunction {
  std::string name;
  std::vector<TransferPoint> points;
  /// World length that opacities of a file hold over; 0: one base cell. `raycast` takes them as of a base
  /// cell: call per_base_cell first.
  double opacity_length = 0;
  std::string note = {};  ///< what a file left open and the reader filled in; empty: nothing
};
struct TransferPreset {
  std::string name, purpose;
};
VDVR_API const std::vector<TransferPreset>& transfer_presets();
/// A preset by name, stretched over [lo, hi]. Throws InputError. For CT take lo = max(0, minimum): air is 0,
/// and what lies below is undershoot of the filter. The presets "iso" and "marschner-lobb" have their surface
/// in the middle.
VDVR_API TransferFunction transfer_preset(const std::string& name, double lo, double hi);
/// Told apart by content: our {"points": [{"value", "rgb", "opacity"}]}, a 3D Slicer volume property
/// (.vp.json) or a ParaView preset (docs/rendering.md). Values as in the file. Throws FileError.
VDVR_API TransferFunction read_transfer_function(const std::filesystem::path& path);
/// Colour and opacity at a value: linear between points, the nearest point's beyond them; the last of several
/// points at one value.
VDVR_API TransferPoint transfer_at(const std::vector<TransferPoint>& points, double value);
/// The same with values mapped linearly so that the first lies at lo and the last at hi. Throws InputError.
VDVR_API TransferFunction stretched(TransferFunction transfer, double lo, double hi);
/// The same with opacities of one base cell, the smallest spacing of the grid.
VDVR_API TransferFunction per_base_cell(TransferFunction transfer, const Grid& grid);

}  // namespace vdvr
