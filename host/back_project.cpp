// Launcher of kernels/back_project.cl.
#include "host/back_project.hpp"

#include <cmath>

#include "host/opencl/kernel.hpp"

namespace vdvr {
namespace {

struct ViewStep {
  double along_x, along_y;
};

// How far s moves per column of a block.
ViewStep view_step(const ParallelGeometry& g, const UpsampledColumns& c, const ColumnBlocks& b, std::size_t k) {
  const double scale = c.rate / g.pitch_u;
  return {std::cos(g.theta_rad[k]) * b.step_x * scale, std::sin(g.theta_rad[k]) * b.step_y * scale};
}

}  // namespace

double position_error(const ParallelGeometry& geometry, const UpsampledColumns& columns, const ColumnBlocks& blocks) {
  // Both steps are rounded (u each), both products and sums round once; the fraction of the start is below 1.
  const double scale = columns.rate / geometry.pitch_u;
  const double reach = scale * (static_cast<double>(blocks.nx) * blocks.step_x + static_cast<double>(blocks.ny) * blocks.step_y);
  return 0x1p-24 * (3 * reach + 2);
}

void back_project(opencl::State& state, const ParallelGeometry& geometry, const UpsampledSlab& slab, const ColumnBlocks& blocks,
                  const std::string& filter, opencl::DeviceArray<float>& out) {
  const ColumnTuning tuning = column_tuning(state.info);
  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  const std::size_t views = static_cast<std::size_t>(slab.views), n = blocks.first.size();

  std::vector<cl_float4> steps(n * views);
  for (std::size_t b = 0; b < n; ++b)
    for (std::size_t k = 0; k < views; ++k) {
      const std::size_t view = k + static_cast<std::size_t>(slab.first_view);
      const ViewStep step = view_step(geometry, slab.columns, blocks, view);
      const double t = blocks.first[b][0] * std::cos(geometry.theta_rad[view]) + blocks.first[b][1] * std::sin(geometry.theta_rad[view]);
      const double s = slab.columns.column_of(t / geometry.pitch_u + geometry.center), whole = std::floor(s);
      steps[b * views + k] = {{static_cast<float>(step.along_x), static_cast<float>(step.along_y), static_cast<float>(s - whole),
                               static_cast<float>(whole)}};
    }
  const opencl::DeviceArray<cl_float4> device_steps(state, std::span<const cl_float4>(steps), "view positions");

  const int columns_per_item = state.info.is_gpu ? 1 : 2;
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> kernel(
      state, "back_project", "back_project",
      {{"VDVR_CUBIC", filter == "cubic" ? "1" : "0"},
       {"VDVR_LANES", std::to_string(tuning.lanes)},
       {"VDVR_COLUMNS", std::to_string(columns_per_item)}});
  const auto ints = [](auto v) { return static_cast<cl_int>(v); };
  kernel({{count(slab.rows_padded / tuning.lanes), count((blocks.nx + columns_per_item - 1) / columns_per_item), count(blocks.ny) * n}, tuning.local},
         out.buffer(), slab.values.buffer(), device_steps.buffer(), ints(slab.views), ints(slab.columns.count), ints(slab.rows_padded),
         ints(blocks.nx), ints(blocks.ny), ints(n));
}

}  // namespace vdvr
