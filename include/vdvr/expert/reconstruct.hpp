// Uniform filtered back-projection, and the grid it runs on.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr {

struct GridOptions {
  std::optional<Index3>
      size;  ///< cells x, y, z; default: the smallest box of cells around the covered cylinder
  std::optional<double> spacing;    ///< default: the detector pitch (pitch_u in x and y, pitch_v in z)
  std::optional<double> spacing_z;  ///< along z, where it differs from `spacing`
  std::optional<Vec3> origin;       ///< first sample; default centred on the axis and on the middle row
};

/// Throws InputError for an empty, non-finite or overflowing grid, or a scan with no covered region.
VDVR_API Grid make_grid(const ParallelGeometry& geometry, const GridOptions& options);
/// The same for rays of either kind. Of cone beam the default box is that around the circle that all views
/// see and the heights that they see of the axis.
VDVR_API Grid make_grid(const ProjectionSet& scan, const GridOptions& options);

/// How far inside (positive) or outside (negative) the covered region a point lies, in world units; a lower
/// bound of the distance to the region's boundary outside it. Covered: margin >= 0.
VDVR_API double coverage_margin(const ParallelGeometry& geometry, double center, const Vec3& point);
inline bool is_covered(const ParallelGeometry& geometry, double center, const Vec3& point) {
  return coverage_margin(geometry, center, point) >= 0;
}

using StageSeconds = std::map<std::string, double>;

struct ReconstructOptions {
  FieldOptions field;
  int upsampling = 8;  ///< in u; a power of two
  Interpolation interpolation = Interpolation::linear;
};

/// F on the samples of `grid` by FBP on the device; samples farther than a cell's diagonal outside the
/// covered region are 0. Cost: views * samples updates. Memory: views * (columns * upsampling) * rows of one
/// slab, sized by --max-memory. With `seconds` the stages (filter, upsample, back-project, read back) wait
/// for each other and are timed.
VDVR_API Volume reconstruct(Device& device, const ProjectionSet& scan, const Grid& grid,
                            const ReconstructOptions& options, const Progress& progress = {},
                            StageSeconds* seconds = nullptr);

/// Planes first_z .. of a volume, float[z][y][x]; valid during the call. May throw to stop.
using TakePlanes = std::function<void(std::int64_t first_z, std::span<const float> planes)>;

/// The same, handed over from the first plane to the last in slabs that --max-memory leaves room for: of
/// grids of any size. Of a scan in scratch whose rows the grid's planes coincide with, only these are
/// filtered.
VDVR_API void reconstruct_planes(Device& device, const ProjectionSet& scan, const Grid& grid,
                                 const ReconstructOptions& options, const TakePlanes& take,
                                 const Progress& progress = {});

/// Checks a scan for what reconstruction assumes; throws InputError (half acquisition, too few views, ...).
/// Returns notes for the user: limited angle, grouped views.
VDVR_API std::vector<std::string> check_scan(const ParallelGeometry& geometry);
VDVR_API std::vector<std::string> check_scan(const ProjectionSet& scan);

}  // namespace vdvr
