// Launcher of kernels/field/fbp/back_project.cl.
#include "host/field/fbp/back_project.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "host/base/opencl/kernel.hpp"
#include "shared/back_project.h"

namespace vdvr {

static_assert(sizeof(VdvrColumnBlocks) == 36);

namespace {

int taps_of(Interpolation interpolation) {
  return interpolation == Interpolation::six_taps ? 6 : interpolation == Interpolation::cubic ? 4 : 2;
}

// Where rows are few, no more lanes than hold them; a second vector only where there is one.
ColumnTuning fitting(ColumnTuning tuning, std::int64_t rows) {
  const auto least =
      static_cast<int>(std::bit_ceil(static_cast<std::uint64_t>(std::clamp<std::int64_t>(rows, 4, 16))));
  tuning.lanes = std::min(tuning.lanes, least);
  if (rows <= tuning.lanes) tuning.vectors = 1;
  return tuning;
}

struct ViewStep {
  double along_x, along_y;
};

// How far s moves per column of a block.
ViewStep view_step(const ParallelGeometry& g, const UpsampledColumns& c, const ColumnBlocks& b,
                   std::size_t k) {
  const double scale = c.rate / g.pitch_u;
  return {std::cos(g.theta_rad[k]) * b.step_x * scale, std::sin(g.theta_rad[k]) * b.step_y * scale};
}

}  // namespace

std::int64_t column_stride(std::int64_t rows) {
  const std::int64_t chunks = (rows + 15) / 16;
  return 16 * (chunks % 2 == 0 ? chunks + 1 : chunks);
}

double position_error(const ParallelGeometry& geometry, const UpsampledColumns& columns,
                      const ColumnBlocks& blocks) {
  // Steps and what is left of the middle are rounded (u each), both fused products round once, and no
  // intermediate passes the reach from the middle + 1/2; the fraction of a small negative s rounds once more.
  const double scale = columns.rate / geometry.pitch_u;
  // |cos| a + |sin| b <= sqrt(a^2 + b^2).
  const double reach = 0.5 * scale *
                       std::hypot(static_cast<double>(blocks.nx) * blocks.step_x,
                                  static_cast<double>(blocks.ny) * blocks.step_y);
  return 0x1p-24 * (3 * reach + 3);
}

void back_project(opencl::State& state, const ParallelGeometry& geometry, const UpsampledSlab& slab,
                  const ColumnBlocks& blocks, Interpolation interpolation, opencl::DeviceArray<float>& out) {
  back_project(state, geometry, slab, blocks, interpolation, out, column_tuning(state.info));
}

void back_project(opencl::State& state, const ParallelGeometry& geometry, const UpsampledSlab& slab,
                  const ColumnBlocks& blocks, Interpolation interpolation, opencl::DeviceArray<float>& out,
                  const ColumnTuning& wanted) {
  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  const std::size_t views = static_cast<std::size_t>(slab.views), n = blocks.first.size();
  const std::int64_t rows_wanted = blocks.rows < 0 ? slab.rows : blocks.rows;
  const auto padded = static_cast<std::int64_t>(opencl::round_up(count(rows_wanted), 16));
  const ColumnTuning tuning = fitting(wanted, rows_wanted);
  if (blocks.first_row % 16 != 0 || blocks.first_row + padded > slab.rows_padded)
    throw std::logic_error("back_project: rows outside the slab");

  std::vector<cl_float4> steps(n * views);
  for (std::size_t b = 0; b < n; ++b)
    for (std::size_t k = 0; k < views; ++k) {
      const std::size_t view = k + static_cast<std::size_t>(slab.first_view);
      const ViewStep step = view_step(geometry, slab.columns, blocks, view);
      const double t = blocks.first[b][0] * std::cos(geometry.theta_rad[view]) +
                       blocks.first[b][1] * std::sin(geometry.theta_rad[view]);
      const double s = slab.columns.column_of(t / geometry.pitch_u + geometry.center_of_view(view)) +
                       0.5 * (step.along_x * static_cast<double>(blocks.nx - 1) +
                              step.along_y * static_cast<double>(blocks.ny - 1));
      const double whole = std::round(s);
      steps[b * views + k] = {{static_cast<float>(step.along_x), static_cast<float>(step.along_y),
                               static_cast<float>(s - whole), static_cast<float>(whole)}};
    }
  const opencl::DeviceArray<cl_float4> device_steps(state, std::span<const cl_float4>(steps),
                                                    "view positions");

  // A tile's rows share the widest interval of any of them.
  std::vector<cl_int2> rows(n * static_cast<std::size_t>(blocks.ny),
                            cl_int2{{0, static_cast<cl_int>(blocks.nx) - 1}});
  if (!blocks.wanted.empty()) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto& w = blocks.wanted[i];
      const bool last_row = (i + 1) % static_cast<std::size_t>(blocks.ny) == 0;
      const auto& next = last_row ? w : blocks.wanted[i + 1];
      rows[i] = {{std::min(w[0], next[0]), std::max(w[1], next[1])}};
    }
  }
  const opencl::DeviceArray<cl_int2> device_rows(state, std::span<const cl_int2>(rows), "wanted columns");

  const int tile_x = tuning.tile == 8 ? 4 : 1, tile_y = tuning.tile == 8 ? 2 : 1, tiles_x = tuning.tiles,
            tiles_y = tuning.tiles * tile_x / tile_y;
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrColumnBlocks> kernel(
      state, "field/fbp/back_project", "back_project",
      {{"VDVR_TAPS", std::to_string(taps_of(interpolation))},
       {"VDVR_RUN", std::to_string(view_run(interpolation))},
       {"VDVR_LANES", std::to_string(tuning.lanes)},
       {"VDVR_TILE", std::to_string(tuning.tile)},
       {"VDVR_VECTORS", std::to_string(tuning.vectors)},
       {"VDVR_TILES_X", std::to_string(tiles_x)},
       {"VDVR_TILES_Y", std::to_string(tiles_y)}});
  const auto ints = [](auto v) { return static_cast<cl_int>(v); };
  const std::int64_t carried = tuning.lanes * tuning.vectors,
                     computed =
                         rows_wanted <= 16 ? std::max<std::int64_t>(tuning.lanes, rows_wanted) : padded;
  const VdvrColumnBlocks shape{
      .views = ints(slab.views),
      .columns = ints(slab.columns.count),
      .z_padded = ints(padded),
      .out_stride = ints(blocks.out_stride > 0 ? blocks.out_stride : column_stride(rows_wanted)),
      .nx = ints(blocks.nx),
      .ny = ints(blocks.ny),
      .blocks = ints(n),
      .first_chunk = ints(blocks.first_row / 16),
      .out_row = ints(blocks.out_row)};
  kernel({{count((computed + carried - 1) / carried),
           count((blocks.nx + tile_x * tiles_x - 1) / (tile_x * tiles_x)),
           count((blocks.ny + tile_y * tiles_y - 1) / (tile_y * tiles_y)) * n},
          tuning.local},
         out.buffer(), slab.values.buffer(), device_steps.buffer(), device_rows.buffer(), shape);
}

}  // namespace vdvr
