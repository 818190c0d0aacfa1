// Uniform FDK in slabs of planes, bands of columns and chunks of views (docs/geometry.md, "Cone beam").
#include "host/field/fdk/reconstruct_cone.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/cone_back_project.hpp"
#include "host/field/fdk/cone_coverage.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "shared/cone_back_project.h"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Samples that may share a cell with the covered region are kept.
double kept_distance(const Grid& grid) {
  return std::hypot(grid.spacing[0], grid.spacing[1], grid.spacing[2]) * (1 + 1e-6);
}

// The planes of a slab that are kept of each column.
std::vector<std::array<std::int32_t, 2>> kept_planes(const ConeCoverage& coverage, const Grid& grid,
                                                     std::int64_t first_z, std::int64_t nz) {
  const Index3 n = grid.samples();
  std::vector<std::array<std::int32_t, 2>> kept(at(n[0] * n[1]), {0, -1});
  parallel_for(n[1], {}, "", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const Vec3 p = grid.position({x, y, 0});
      const auto [low, high] = coverage.heights(p[0], p[1], -kept_distance(grid));
      if (!(low <= high)) continue;
      const auto plane = [&](double z) {
        return (z - grid.origin[2]) / grid.spacing[2] - static_cast<double>(first_z);
      };
      const double last = static_cast<double>(nz - 1), from = std::max(0.0, std::ceil(plane(low))),
                   to = std::min(last, std::floor(plane(high)));
      if (from <= to)
        kept[at(y * n[0] + x)] = {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
    }
  });
  return kept;
}

// Detector rows that the kept samples of a view see, least and largest: these lie within the hull of the ends
// of rows of columns, in the first plane and the last, whose images hold those of all. Nothing where that is
// not known.
std::optional<std::array<double, 2>> rows_seen(const ViewMatrix& view, const Grid& grid,
                                               std::span<const std::array<std::int64_t, 2>> ends) {
  std::array<double, 2> rows{HUGE_VAL, -HUGE_VAL};
  for (std::int64_t y = 0; y < std::ssize(ends); ++y) {
    if (ends[at(y)][0] > ends[at(y)][1]) continue;
    for (const std::int64_t x : ends[at(y)])
      for (const std::int64_t z : {std::int64_t{0}, grid.samples()[2] - 1}) {
        const Vec3 seen = projected(view, grid.position({x, y, z}));
        if (!(seen[2] > 0)) return std::nullopt;
        rows = {std::min(rows[0], seen[1]), std::max(rows[1], seen[1])};
      }
  }
  return rows;
}

// By row of columns, the first and last that have a kept sample.
std::vector<std::array<std::int64_t, 2>> ends_of_rows(const ConeCoverage& coverage, const Grid& grid) {
  const Index3 n = grid.samples();
  std::vector<std::array<std::int64_t, 2>> ends(at(n[1]), {n[0], -1});
  const auto kept = kept_planes(coverage, grid, 0, n[2]);
  for (std::int64_t i = 0; i < std::ssize(kept); ++i) {
    if (kept[at(i)][0] > kept[at(i)][1]) continue;
    auto& [first, last] = ends[at(i / n[0])];
    first = std::min(first, i % n[0]);
    last = std::max(last, i % n[0]);
  }
  return ends;
}

// Pixels that kept samples fall on. Beyond the detector: the margin where it looks largest, closest to a
// source.
ConeReach reach_of(const FilteredScan& scan, const ConeCoverage& coverage, const Grid& grid) {
  double columns = 0, rows = 0;
  for (const ViewMatrix& matrix : scan.views) {
    const ConeView view = cone_view(matrix);
    // Covered points lie at least as far from the source's plane as the nearer edge of what it sees of the
    // axis' cylinder; a margin that is small beside that is seen at no more than twice the pitch at the axis.
    columns = std::max(columns, 2 * kept_distance(grid) / view.pitch_u);
    rows = std::max(rows, 2 * kept_distance(grid) / view.pitch_v);
  }
  const double least = -std::ceil(rows) - 1, most = static_cast<double>(scan.geometry.rows - 1) - least;
  const auto ends = ends_of_rows(coverage, grid);
  std::vector<std::array<double, 2>> seen(scan.views.size());
  parallel_for(std::ssize(seen), {}, "", [&](std::int64_t k) {
    seen[at(k)] = rows_seen(scan.views[at(k)], grid, ends).value_or(std::array{least, most});
  });
  double low = most, high = least;
  for (const auto& [first, last] : seen) {
    low = std::min(low, std::max(first, least));
    high = std::max(high, std::min(last, most));
  }
  return {static_cast<std::int64_t>(std::ceil(columns)) + 1,
          static_cast<std::int64_t>(std::floor(std::min(low, high))),
          static_cast<std::int64_t>(std::ceil(high)), planes_suit_vectors(scan, grid)};
}

// What lies outside is 0: vectors compute more than is wanted.
void clear_unwanted(std::span<float> columns, std::int64_t stride, std::int64_t nz,
                    std::span<const std::array<std::int32_t, 2>> wanted) {
  for (std::size_t x = 0; x < wanted.size(); ++x) {
    float* column = columns.data() + static_cast<std::int64_t>(x) * stride;
    const std::int64_t from = wanted[x][0] > wanted[x][1] ? nz : wanted[x][0], to = wanted[x][1] + 1;
    std::fill(column, column + from, 0.0f);
    if (to < nz && from < nz) std::fill(column + to, column + nz, 0.0f);
  }
}

struct Sizes {
  std::int64_t planes, band, views;  // of a slab, rows of a band, views of a chunk
};

constexpr std::uint64_t enough_bytes = std::uint64_t{128} << 20;

// A slab's planes and a band's columns take a quarter of what is left each, views another.
Sizes sizes_for(const opencl::State& state, const FilteredScan& scan, int rate, const ConeTables& tables,
                const Index3& n, std::uint64_t plane_bytes) {
  const std::uint64_t share = std::min(state.memory.left() / 4, state.info.max_allocation);
  Sizes s{};
  const auto most = [&](std::uint64_t each, std::int64_t all) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(share / std::max<std::uint64_t>(each, 1)), 0,
                                    all);
  };
  s.planes = plane_bytes == 0 ? n[2] : most(plane_bytes, n[2]);
  s.planes = std::min(s.planes, std::int64_t{1024});
  s.band = most(sizeof(float) * count(n[0] * column_stride(std::max<std::int64_t>(s.planes, 1))), n[1]);
  if (s.band > VDVR_CONE_BLOCK && s.band < n[1]) s.band = s.band / VDVR_CONE_BLOCK * VDVR_CONE_BLOCK;
  const std::uint64_t per_view = tables.bytes(1);
  s.views = most(per_view, scan.geometry.views());
  // Where no table is made twice, small ones do: they are no faster for being large.
  if (s.planes == n[2] && s.band == n[1])
    s.views =
        std::min(s.views, std::max<std::int64_t>(1, static_cast<std::int64_t>(enough_bytes / per_view)));
  if (s.planes < 1 || s.band < 1 || s.views < 1)
    throw ResourceError(
        fmt::format("a view of {} x {} pixels at `upsampling` {} needs {:.1f} MiB, a plane of the volume "
                    "{:.1f} MiB; raise `max_memory`",
                    scan.geometry.columns, scan.geometry.rows, rate, static_cast<double>(per_view) / 0x1p20,
                    static_cast<double>(n[0] * n[1] * 4) / 0x1p20));
  return s;
}

}  // namespace

void reconstruct_cone(opencl::State& state, const ScanInUnits& from, const Grid& grid,
                      const ReconstructOptions& options, const Planes& planes, const Progress& progress,
                      StageWatch& watch) {
  if (options.interpolation != Interpolation::linear)
    throw InputError("cone beam: `u_filter` can only be linear; raise `upsampling` instead");
  const int rate = options.upsampling;
  const FilteredScan filtered = filter_cone(state, from.scan, options.field, progress,
                                            rate == 1 ? Precision::fp32 : Precision::fp64, from.units);
  watch.lap(state, "filter");
  back_project_views(state, filtered, grid, rate, 2, planes, progress, watch);
}

void back_project_views(opencl::State& state, const FilteredScan& filtered, const Grid& grid, int rate,
                        int depth_power, const Planes& planes, const Progress& progress, StageWatch& watch) {
  const ParallelGeometry& g = filtered.geometry;
  const ConeCoverage coverage(filtered.views, g.columns, g.rows);
  const ConeReach reach = reach_of(filtered, coverage, grid);
  const Index3 n = grid.samples();
  ConeTables tables(state, filtered, rate, reach);
  const Sizes sizes = sizes_for(state, filtered, rate, tables, n, planes.bytes);
  HostMemory host(state);
  host.count(filtered.samples.resident_bytes(), "the filtered projections");
  bool any = false;
  std::optional<ConeTable> table;  // the last one: of all views it serves all bands
  for (std::int64_t z0 = 0; z0 < n[2]; z0 += sizes.planes) {
    const std::int64_t nz = std::min(sizes.planes, n[2] - z0), stride = column_stride(nz);
    const auto kept = kept_planes(coverage, grid, z0, nz);
    float* target = planes.target(z0, nz);
    for (std::int64_t y0 = 0; y0 < n[1]; y0 += sizes.band) {
      const std::int64_t ny = std::min(sizes.band, n[1] - y0);
      ConeBand band{&grid, y0, ny, z0, nz, {kept.begin() + y0 * n[0], kept.begin() + (y0 + ny) * n[0]}};
      band.depth_power = depth_power;
      if (std::none_of(band.wanted.begin(), band.wanted.end(), [](const auto& w) { return w[0] <= w[1]; }))
        continue;
      any = true;
      opencl::DeviceArray<float> out(state, count(ny * n[0] * stride), "reconstructed columns");
      for (std::int64_t first = 0; first < g.views(); first += sizes.views) {
        report(progress, "reconstruct",
               (static_cast<double>(z0) + static_cast<double>(nz * y0) / static_cast<double>(n[1])) /
                   static_cast<double>(n[2]));
        const std::int64_t views = std::min(sizes.views, g.views() - first);
        if (!table || table->first_view != first || table->views != views) {
          table.reset();
          table = tables(first, views);
          watch.lap(state, "upsample");
        }
        band.adds = first > 0;
        cone_back_project(state, filtered, *table, band, out);
        watch.lap(state, "back-project");
      }
      out.read_mapped([&](std::span<const float> columns) {
        parallel_for(ny, {}, "", [&](std::int64_t y) {
          std::vector<float> row(columns.begin() + y * n[0] * stride,
                                 columns.begin() + (y + 1) * n[0] * stride);
          clear_unwanted(row, stride, nz, std::span(band.wanted).subspan(at(y * n[0]), at(n[0])));
          transpose_row(row, stride, nz, {0, static_cast<std::int32_t>(n[0] - 1)}, target + (y0 + y) * n[0],
                        n[0] * n[1]);
        });
      });
      watch.lap(state, "read back");
    }
    planes.done(z0, nz);
  }
  if (!any)
    throw InputError("no sample of the grid is covered by the scan; change `origin`, `size` or `center`");
}

Grid make_cone_grid(const ProjectionSet& scan, const GridOptions& options) {
  const ConeCoverage coverage = cone_coverage(scan, {});
  return grid_around(scan.geometry, coverage.inner_radius(), coverage.heights(0, 0, 0), options);
}

}  // namespace vdvr
