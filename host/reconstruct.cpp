// Uniform FBP in slabs of rows and blocks of columns. Called by the command line and by plan.cpp (the 1x base
// volume).
#include "vdvr/reconstruct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host/back_project.hpp"
#include "host/coverage.hpp"
#include "host/huge_pages.hpp"
#include "host/opencl/kernel.hpp"
#include "host/parallel.hpp"
#include "host/reconstruct_field.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

namespace {

// Laps of device work; without a receiver nothing waits.
class StageWatch {
 public:
  explicit StageWatch(StageSeconds* seconds) : seconds_(seconds) {}
  void lap(opencl::State& state, const std::string& stage) {
    if (!seconds_) return;
    opencl::finish(state, stage);
    const auto now = std::chrono::steady_clock::now();
    (*seconds_)[stage] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  StageSeconds* seconds_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

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

Volume reconstruct_field(opencl::State& state, const FilteredScan& filtered, Upsampler& upsampler,
                         const Grid& grid, int upsampling, const std::string& u_filter,
                         const Progress& progress, StageSeconds* seconds) {
  StageWatch watch(seconds);
  const ParallelGeometry& g = filtered.geometry;
  const Coverage coverage(g);
  const Index3 n = grid.samples();
  const UpsampledColumns columns = columns_for(g, grid, upsampling);

  // A slab's projections take half of what is left, its columns at most a quarter.
  const std::uint64_t budget = state.memory.left() / 2;
  std::int64_t rows = std::min<std::int64_t>(n[2], 256);
  while (rows > 16 && upsampler.slab_bytes(columns, rows) > budget) rows = (rows + 1) / 2;
  if (upsampler.slab_bytes(columns, rows) > std::min(budget, state.info.max_allocation)) {
    throw ResourceError(fmt::format(
        "{} views of {} upsampled columns need {:.1f} MiB per slab of {} rows; raise --max-memory or "
        "lower --upsampling",
        g.views(), columns.count, static_cast<double>(upsampler.slab_bytes(columns, rows)) / (1 << 20),
        rows));
  }
  const std::int64_t wanted =
      static_cast<std::int64_t>(state.memory.left() / 8) / (n[0] * column_stride(rows) * 4);
  const std::int64_t band = std::clamp<std::int64_t>(wanted, 1, std::min<std::int64_t>(n[1], 64));

  Volume volume{grid, large_zeros(static_cast<std::size_t>(grid.sample_count()))};
  std::vector<std::uint8_t> kept(static_cast<std::size_t>(n[0] * n[1]));
  parallel_for(n[1], {}, "", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const Vec3 p = grid.position({x, y, 0});
      kept[static_cast<std::size_t>(y * n[0] + x)] = coverage.margin(p[0], p[1]) >= -kept_margin(grid, 1);
    }
  });
  for (std::int64_t z0 = 0; z0 < n[2]; z0 += rows) {
    const std::int64_t nz = std::min(rows, n[2] - z0);
    const auto positions =
        detector_rows(g, grid.origin[2] + static_cast<double>(z0) * grid.spacing[2], grid.spacing[2], nz);
    const UpsampledSlab slab = upsampler(columns, positions);
    watch.lap(state, "upsample");
    opencl::DeviceArray<float> out(state, static_cast<std::uint64_t>(band * n[0] * column_stride(nz)),
                                   "reconstructed columns");
    for (std::int64_t y0 = 0; y0 < n[1]; y0 += band) {
      report(progress, "reconstruct",
             (static_cast<double>(z0) + static_cast<double>(nz * y0) / static_cast<double>(n[1])) /
                 static_cast<double>(n[2]));
      ColumnBlocks blocks{n[0],
                          std::min(band, n[1] - y0),
                          grid.spacing[0],
                          grid.spacing[1],
                          {{grid.origin[0], grid.origin[1] + static_cast<double>(y0) * grid.spacing[1]}},
                          {}};
      back_project(state, g, slab, blocks, u_filter, out);
      watch.lap(state, "back-project");
      // Columns of z become planes of z, a band of 16 at a time so that both sides stay in cache.
      const std::int64_t stride = column_stride(nz);
      out.read_mapped([&](std::span<const float> columns_host) {
        parallel_for(blocks.ny, {}, "", [&](std::int64_t y) {
          const std::uint8_t* keep = kept.data() + (y0 + y) * n[0];
          const float* row = columns_host.data() + y * n[0] * stride;
          for (std::int64_t first = 0; first < nz; first += 16)
            for (std::int64_t x = 0; x < n[0]; ++x)
              for (std::int64_t z = first; keep[x] && z < std::min(first + 16, nz); ++z)
                volume.samples[static_cast<std::size_t>(((z0 + z) * n[1] + y0 + y) * n[0] + x)] =
                    row[x * stride + z];
        });
      });
      watch.lap(state, "read back");
    }
  }
  return volume;
}

Volume reconstruct(Device& device, const ProjectionSet& scan, const Grid& grid,
                   const ReconstructOptions& options, const Progress& progress, StageSeconds* seconds) {
  StageWatch watch(seconds);
  if (options.upsampling < 1 || options.upsampling > 64 ||
      (options.upsampling & (options.upsampling - 1)) != 0)
    throw InputError(fmt::format("--upsampling {} must be a power of two, 1 to 64", options.upsampling));
  if (options.u_filter != "linear" && options.u_filter != "cubic")
    throw InputError(fmt::format("--u-filter '{}' must be linear or cubic", options.u_filter));
  const FilteredScan filtered = filter_projections(device.state(), scan, options.field, progress);
  watch.lap(device.state(), "filter");
  Upsampler upsampler(device.state(), filtered);
  return reconstruct_field(device.state(), filtered, upsampler, grid, options.upsampling, options.u_filter,
                           progress, seconds);
}

}  // namespace vdvr
