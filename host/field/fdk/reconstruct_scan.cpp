// Reconstruction of scans of either beam, in their users' units.
#include <fmt/format.h>

#include "host/base/opencl/host_memory.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/fdk_weights.hpp"
#include "host/field/fdk/reconstruct_cone.hpp"
#include "host/scan/units.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

// The grid is in the scan's units.
void reconstruct_scan(opencl::State& state, const ScanInUnits& from, const Grid& grid,
                      const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                      StageWatch& watch) {
  if (options.upsampling < 1 || options.upsampling > 64 ||
      (options.upsampling & (options.upsampling - 1)) != 0)
    throw InputError(fmt::format("`upsampling` {} must be a power of two, 1 to 64", options.upsampling));
  if (from.scan.cone) reconstruct_cone(state, from, grid, options, planes, progress, watch);
  else reconstruct_parallel(state, from, grid, options, planes, progress, watch);
}

}  // namespace

Grid make_grid(const ProjectionSet& scan, const GridOptions& options) {
  return scan.cone ? make_cone_grid(scan, options) : make_grid(scan.geometry, options);
}

std::vector<std::string> check_scan(const ProjectionSet& scan) {
  if (!scan.cone) return check_scan(scan.geometry);
  const FdkWeights weights(*scan.cone, scan.geometry.columns, scan.geometry.rows);
  std::vector<std::string> notes = weights.notes();
  notes.emplace_back(
      "FDK: exact in the plane of the orbit, approximate above and below it; a circle does not see enough "
      "for more");
  return notes;
}

Volume reconstruct(Device& device, const ProjectionSet& scan, const Grid& grid,
                   const ReconstructOptions& options, const Progress& progress, StageSeconds* seconds) {
  StageWatch watch(seconds);
  const ScanInUnits from(scan);
  const Grid in_units = from_world(grid, from.units);
  WholeVolume whole(in_units);
  reconstruct_scan(device.state(), from, in_units, options, whole.planes(), progress, watch);
  Volume volume = whole.take();
  volume.grid = grid;
  densities_to_world(volume.samples, from.units);
  return volume;
}

void reconstruct_planes(Device& device, const ProjectionSet& scan, const Grid& grid,
                        const ReconstructOptions& options, const TakePlanes& take, const Progress& progress) {
  StageWatch watch(nullptr);
  const ScanInUnits from(scan);
  const Index3 n = grid.samples();
  HostMemory host(device.state());
  std::vector<float> slab;
  Planes planes;
  planes.bytes = sizeof(float) * static_cast<std::uint64_t>(n[0] * n[1]);
  planes.target = [&](std::int64_t, std::int64_t count) {
    if (slab.empty()) host.count(static_cast<std::uint64_t>(count) * planes.bytes, "planes of the volume");
    slab.assign(static_cast<std::size_t>(count * n[0] * n[1]), 0.0f);
    return slab.data();
  };
  planes.done = [&](std::int64_t first, std::int64_t) {
    densities_to_world(slab, from.units);
    take(first, slab);
  };
  reconstruct_scan(device.state(), from, from_world(grid, from.units), options, planes, progress, watch);
}

}  // namespace vdvr
