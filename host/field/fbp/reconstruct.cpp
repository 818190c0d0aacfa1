// Uniform FBP in slabs of rows and blocks of columns.
#include "vdvr/expert/reconstruct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/scan/units.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

std::vector<double> detector_rows(const ParallelGeometry& g, double first_z, double step,
                                  std::int64_t count) {
  std::vector<double> rows(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = (first_z + static_cast<double>(i) * step) / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1);
  return rows;
}

double kept_margin(const Grid& grid, int rate) {
  const double cell = std::hypot(grid.spacing[0], grid.spacing[1]);
  return cell * (1 + 1.0 / rate) * (1 + 1e-6);
}

UpsampledColumns columns_for(const ParallelGeometry& g, const Grid& grid, int upsampling) {
  // Everything that may be kept, and the stencil around it.
  return upsampled_columns(g.columns, upsampling, (kept_margin(grid, 1) + grid.spacing[0]) / g.pitch_u);
}

// Columns of z become rows of x. The planes of a volume lie a power of two apart and would share a few cache
// sets: 16 of them are gathered aside and written row by row.
void transpose_row(std::span<const float> columns, std::int64_t stride, std::int64_t nz,
                   std::array<std::int32_t, 2> kept, float* target, std::int64_t plane) {
  const std::int64_t width = kept[1] - kept[0] + 1, aside = width + 16;
  if (width <= 0) return;
  std::vector<float> rows(static_cast<std::size_t>(16 * aside));
  for (std::int64_t first = 0; first < nz; first += 16) {
    const float* from = columns.data() + kept[0] * stride + first;
    for (std::int64_t x = 0; x < width; ++x, from += stride)
      for (std::int64_t z = 0; z < 16; ++z) rows[static_cast<std::size_t>(z * aside + x)] = from[z];
    for (std::int64_t z = 0; z < std::min<std::int64_t>(16, nz - first); ++z)
      std::copy_n(rows.data() + z * aside, width, target + (first + z) * plane + kept[0]);
  }
}

namespace {

using SlabMaker = std::function<UpsampledSlab(const UpsampledColumns&, std::span<const double>)>;

// Rows of a slab whose projections, and planes, take half of what is left.
std::int64_t slab_rows(const opencl::State& state, const ParallelGeometry& g, const UpsampledColumns& columns,
                       std::int64_t all, std::uint64_t plane_bytes) {
  const std::uint64_t budget = state.memory.left() / 2;
  const auto bytes = [&](std::int64_t rows) {
    return slab_bytes(state.info, g, columns, rows) + static_cast<std::uint64_t>(rows) * plane_bytes;
  };
  std::int64_t rows = std::min<std::int64_t>(all, 256);
  while (rows > 16 && bytes(rows) > budget) rows = (rows + 1) / 2;
  if (bytes(rows) > std::min(budget, state.info.max_allocation)) {
    throw ResourceError(fmt::format(
        "{} views of {} upsampled columns need {:.1f} MiB per slab of {} rows; raise `max_memory` "
        "or lower `upsampling`",
        g.views(), columns.count, static_cast<double>(bytes(rows)) / (1 << 20), rows));
  }
  return rows;
}

// By row y, the first and last column that is kept: the region is convex, so that all between them are.
std::vector<std::array<std::int32_t, 2>> kept_columns(const ParallelGeometry& g, const Grid& grid) {
  const Coverage coverage(g);
  const Index3 n = grid.samples();
  std::vector<std::array<std::int32_t, 2>> kept(static_cast<std::size_t>(n[1]));
  parallel_for(n[1], {}, "", [&](std::int64_t y) {
    const auto keep = [&](std::int64_t x) {
      const Vec3 p = grid.position({x, y, 0});
      return coverage.margin(p[0], p[1]) >= -kept_margin(grid, 1);
    };
    std::int64_t first = 0, last = n[0] - 1;
    while (first <= last && !keep(first)) ++first;
    while (last > first && !keep(last)) --last;
    // An empty row wants nothing, wherever its neighbour's interval lies.
    if (first > last) kept[static_cast<std::size_t>(y)] = {static_cast<std::int32_t>(n[0]), -1};
    else
      kept[static_cast<std::size_t>(y)] = {static_cast<std::int32_t>(first), static_cast<std::int32_t>(last)};
  });
  return kept;
}

void reconstruct_slabs(opencl::State& state, const ParallelGeometry& g, const SlabMaker& make_slab,
                       const Grid& grid, int upsampling, Interpolation interpolation, const Planes& planes,
                       const Progress& progress, StageWatch& watch) {
  const Index3 n = grid.samples();
  const UpsampledColumns columns = columns_for(g, grid, upsampling);
  const std::int64_t rows = slab_rows(state, g, columns, n[2], planes.bytes);
  // A slab's columns take at most a quarter of what it leaves.
  const std::int64_t wanted =
      static_cast<std::int64_t>(state.memory.left() / 8) / (n[0] * column_stride(rows) * 4);
  const std::int64_t band = std::clamp<std::int64_t>(wanted, 1, std::min<std::int64_t>(n[1], 64));

  const auto kept = kept_columns(g, grid);
  if (std::none_of(kept.begin(), kept.end(), [](const auto& k) { return k[0] <= k[1]; }))
    throw InputError("no sample of the grid is covered by the scan; change `origin`, `size` or `center`");
  for (std::int64_t z0 = 0; z0 < n[2]; z0 += rows) {
    const std::int64_t nz = std::min(rows, n[2] - z0), stride = column_stride(nz);
    float* target = nullptr;
    const UpsampledSlab slab = make_slab(
        columns,
        detector_rows(g, grid.origin[2] + static_cast<double>(z0) * grid.spacing[2], grid.spacing[2], nz));
    opencl::DeviceArray<float> out(state, static_cast<std::uint64_t>(band * n[0] * stride),
                                   "reconstructed columns");
    for (std::int64_t y0 = 0; y0 < n[1]; y0 += band) {
      report(progress, "reconstruct",
             (static_cast<double>(z0) + static_cast<double>(nz * y0) / static_cast<double>(n[1])) /
                 static_cast<double>(n[2]));
      const std::int64_t ny = std::min(band, n[1] - y0);
      const ColumnBlocks blocks{
          n[0],
          ny,
          grid.spacing[0],
          grid.spacing[1],
          {{grid.origin[0], grid.origin[1] + static_cast<double>(y0) * grid.spacing[1]}},
          {kept.begin() + y0, kept.begin() + y0 + ny}};
      back_project(state, g, slab, blocks, interpolation, out);
      watch.lap(state, "back-project");
      if (target == nullptr) target = planes.target(z0, nz);
      out.read_mapped([&](std::span<const float> columns_host) {
        parallel_for(ny, {}, "", [&](std::int64_t y) {
          transpose_row(columns_host.subspan(static_cast<std::size_t>(y * n[0] * stride)), stride, nz,
                        kept[static_cast<std::size_t>(y0 + y)], target + (y0 + y) * n[0], n[0] * n[1]);
        });
      });
      watch.lap(state, "read back");
    }
    planes.done(z0, nz);
  }
}

}  // namespace

Volume reconstruct_field(opencl::State& state, const FilteredScan& filtered, Upsampler& upsampler,
                         const Grid& grid, int upsampling, Interpolation interpolation,
                         const Progress& progress, StageSeconds* seconds) {
  StageWatch watch(seconds);
  const auto make_slab = [&](const UpsampledColumns& columns, std::span<const double> rows) {
    UpsampledSlab slab = upsampler(columns, rows);
    watch.lap(state, "upsample");
    return slab;
  };
  WholeVolume volume(grid);
  reconstruct_slabs(state, filtered.geometry, make_slab, grid, upsampling, interpolation, volume.planes(),
                    progress, watch);
  return volume.take();
}

void reconstruct_parallel(opencl::State& state, const ScanInUnits& from, const Grid& grid,
                          const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                          StageWatch& watch) {
  const ProjectionSet& scan = from.scan;
  const Units& units = from.units;
  // Without upsampling the filtered scan need not pass through the host. It does as soon as one slab needs
  // it.
  std::optional<DirectFilter> direct;
  if (options.upsampling == 1) direct.emplace(state, scan, options.field, units);
  // Without upsampling nothing is certified.
  const Precision precision = options.upsampling == 1 ? Precision::fp32 : Precision::fp64;
  // Of a scan that does not fit memory, only the rows of a slab, where they are the detector's.
  std::optional<WindowFilter> window;
  if (scan.data.scratch()) window.emplace(state, scan, options.field, precision, units);
  std::optional<FilteredScan> filtered;
  std::optional<Upsampler> upsampler;
  const auto make_slab = [&](const UpsampledColumns& columns, std::span<const double> rows) {
    if (direct && !filtered) {
      std::optional<UpsampledSlab> slab = (*direct)(columns, rows, progress);
      watch.lap(state, "filter");
      if (slab) return std::move(*slab);
    }
    if (window && !filtered) {
      std::optional<UpsampledSlab> slab = (*window)(columns, rows, progress);
      watch.lap(state, "filter");
      if (slab) return std::move(*slab);
    }
    if (!filtered) {
      filtered =
          filter_projections(state, scan, options.field, progress, FilterMethod::automatic, precision, units);
      watch.lap(state, "filter");
      upsampler.emplace(state, *filtered);
    }
    UpsampledSlab slab = (*upsampler)(columns, rows);
    watch.lap(state, "upsample");
    return slab;
  };
  ParallelGeometry geometry = from_world(scan.geometry, units);
  geometry.center = center_of(options.field, geometry);
  reconstruct_slabs(state, geometry, make_slab, grid, options.upsampling, options.interpolation, planes,
                    progress, watch);
}

}  // namespace vdvr
