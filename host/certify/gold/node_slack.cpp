// Launches kernels/certify/gold/node_slack.cl on batches of gold blocks.
#include "host/certify/gold/node_slack.hpp"

#include <algorithm>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/outward.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {

std::vector<float> brick_addends(const BrickRemainder& remainder, const GoldLattice& lattice,
                                 const GoldErrors& errors, const GoldSettings& settings, const Index3& block,
                                 const std::vector<std::array<std::int64_t, 3>>& first_brick) {
  // Between columns and between kept nodes gold is interpolated, at a node and in second differences; these
  // are rounded.
  const double constant = errors.interpolation + errors.curved_interpolation + errors.curved_rounding;
  const Bricks bricks(settings.grid, settings.granularity);
  std::vector<float> out;
  for (const auto& first : first_brick)
    for (std::int64_t z = 0; z < block[2]; ++z)
      for (std::int64_t y = 0; y < block[1]; ++y)
        for (std::int64_t x = 0; x < block[0]; ++x) {
          const Index3 p{first[0] + x, first[1] + y, first[2] + z};
          const bool inside =
              p[0] < bricks.along()[0] && p[1] < bricks.along()[1] && p[2] < bricks.along()[2];
          out.push_back(
              inside ? round_up(constant + static_cast<double>(remainder.of(bricks.number(p), lattice)))
                     : 0.0f);
        }
  return out;
}

std::pair<double, double> widened_window(const GoldErrors& errors, const GoldSettings& settings) {
  const auto window = settings.window.value_or(std::pair{0.0, 0.0});
  const double wider = errors.rounding + errors.ramp;
  return {window.first - wider, window.second + wider};
}

void node_slack(opencl::State& state, const GoldSettings& settings, const SlackShape& shape,
                const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                const opencl::DeviceArray<float>& addend, opencl::DeviceArray<float>& above,
                opencl::DeviceArray<float>& below) {
  const Grid& grid = settings.grid;
  const std::int64_t g = settings.granularity, rate = settings.rate;
  const SlabShape& slab = shape.slab;
  std::vector<cl_int2> ends;
  for (const auto& f : first_brick)
    ends.push_back({{to_int(std::min(slab.cells_x, grid.cells[0] - f[0] * g) * rate),
                     to_int(std::min(slab.cells_y, grid.cells[1] - f[1] * g) * rate)}});
  const auto last = opencl::copied<cl_int2>(state, ends, "block ends");
  const std::uint64_t columns = count(b.count * b.nx * b.ny * slab.stride);
  opencl::DeviceArray<float> cells_above(state, columns, "cell slack above"),
      cells_below(state, columns, "cell slack below"),
      rows(state, count(b.count * shape.bricks[0] * shape.bricks[1] * slab.stride),
           "slack by brick of gold cells");
  const cl_int nx = to_int(b.nx), ny = to_int(b.ny), nz = to_int(b.nz), blocks = to_int(b.count),
               stride = to_int(slab.stride), bricks_x = to_int(shape.bricks[0]),
               bricks_y = to_int(shape.bricks[1]), side = to_int(g * rate);

  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> expand(
      state, "certify/gold/node_slack", "expand_addend", opencl::height_defines(state.info, 16));
  expand({{count(slab.stride), count(shape.bricks[0]), count(shape.bricks[1] * b.count)}, {16, 1, 1}},
         rows.buffer(), addend.buffer(), bricks_x, bricks_y, to_int(shape.bricks[2]), side, stride, blocks);
  const auto window = widened_window(shape.errors, settings);
  const opencl::Defines defines = opencl::height_defines(state.info, 16);
  const std::int64_t lanes = opencl::lanes_of(state.info, 16);
  const std::uint64_t heights = count((b.nz + lanes - 1) / lanes);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_float, cl_float, cl_float>
      cell_slack(state, "certify/gold/node_slack", "cell_slack", defines);
  cell_slack(opencl::in_groups(state.info, {heights, count(b.nx - 1), count((b.ny - 1) * b.count)}),
             cells_above.buffer(), cells_below.buffer(), gold.buffer(), rows.buffer(), nx, ny, nz,
             to_int(b.halo), to_int(b.gold_stride), stride, side, bricks_x, bricks_y, blocks,
             settings.grid_only ? 0 : 1, settings.window ? 1 : 0, static_cast<cl_float>(window.first),
             static_cast<cl_float>(window.second), shape.curvature);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_float, cl_int, cl_int>
      nodes(state, "certify/gold/node_slack", "node_slack", defines);
  nodes(opencl::in_groups(state.info, {heights, count(b.nx), count(b.ny * b.count)}), above.buffer(),
        below.buffer(), cells_above.buffer(), cells_below.buffer(), margin.buffer(), last.buffer(), nx, ny,
        nz, to_int(b.halo), stride, blocks, b.lowest, to_int(b.z_first), to_int(b.z_last));
}

}  // namespace vdvr
