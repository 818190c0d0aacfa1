// Uniform FDK on the device. Called by reconstruct.cpp.
#pragma once

#include <cstdint>
#include <functional>

#include "host/opencl/state.hpp"
#include "host/scan/units.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {

/// Where a slab's planes go, zeros so far, and what is done once they are there.
struct Planes {
  std::function<float*(std::int64_t first, std::int64_t count)> target;
  std::function<void(std::int64_t first, std::int64_t count)> done = [](std::int64_t, std::int64_t) {};
  std::uint64_t bytes = 0;  ///< that a plane takes beside the slab; 0: counted elsewhere
};

/// Columns of z become rows of x, of one y: `columns` has nz samples of each x, `stride` apart; those of
/// kept[0] .. kept[1] go to target[z][x], planes `plane` apart.
void transpose_row(std::span<const float> columns, std::int64_t stride, std::int64_t nz,
                   std::array<std::int32_t, 2> kept, float* target, std::int64_t plane);

/// Called with the name of a stage that the device has ended.
using Lap = std::function<void(const std::string& stage)>;

/// The grid is in `units`. Cost: views * samples updates. Memory: a band of the volume and as many views as
/// the rest of --max-memory holds.
void reconstruct_cone(opencl::State& state, const ProjectionSet& scan, const Units& units, const Grid& grid,
                      const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                      const Lap& lap);

/// The smallest box of cells around the covered region's cylinder, or what the options say.
Grid make_cone_grid(const ProjectionSet& scan, const GridOptions& options);

}  // namespace vdvr
