// Launches kernels/gold/node_slack.cl on batches of gold blocks.
#include "host/gold/node_slack.hpp"

#include <algorithm>

#include "host/fbp/back_project.hpp"
#include "host/opencl/kernel.hpp"
#include "host/system/casts.hpp"
#include "host/system/round_up.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {

NodeSlack::NodeSlack(opencl::State& state, const BrickRemainder& remainder, const GoldLattice& lattice,
                     const GoldErrors& errors, const GoldSettings& settings)
    : state_(state), remainder_(remainder), lattice_(lattice), errors_(errors), settings_(settings) {}

void NodeSlack::begin(const SlabShape& slab, std::int64_t together) {
  slab_ = slab;
  const std::int64_t rate = settings_.rate;
  const std::uint64_t cells = count(together * slab.cells_x * slab.cells_y * slab.cells_z);
  const std::uint64_t columns =
      count(together * (slab.cells_x * rate + 1) * (slab.cells_y * rate + 1) * slab.stride);
  addend_ = opencl::DeviceArray<float>(state_, cells, "slack of cells");
  cells_above_ = opencl::DeviceArray<float>(state_, columns, "cell slack above");
  cells_below_ = opencl::DeviceArray<float>(state_, columns, "cell slack below");
  rows_ = opencl::DeviceArray<float>(state_, count(together * slab.cells_x * slab.cells_y * slab.stride),
                                     "slack by base cell of gold cells");
}

void NodeSlack::end() {
  addend_ = {};
  cells_above_ = {};
  cells_below_ = {};
  rows_ = {};
}

void NodeSlack::launch(const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                       const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                       opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below) {
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> expand(
      state_, "gold/node_slack", "expand_bound");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_float, cl_int, cl_float, cl_float>
      cell_slack(state_, "gold/node_slack", "cell_slack");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_float, cl_int, cl_int>
      node_slack(state_, "gold/node_slack", "node_slack");
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  std::vector<cl_int2> ends;
  for (const auto& f : first_brick)
    ends.push_back({{to_int(std::min(slab_.cells_x, grid.cells[0] - f[0] * g) * rate),
                     to_int(std::min(slab_.cells_y, grid.cells[1] - f[1] * g) * rate)}});
  const opencl::DeviceArray<cl_int2> last(state_, std::span<const cl_int2>(ends), "block ends");
  const cl_int nx = to_int(b.nx), ny = to_int(b.ny), nz = to_int(b.nz), blocks = to_int(b.count),
               stride = to_int(slab_.stride), cells_x = to_int(slab_.cells_x),
               cells_y = to_int(slab_.cells_y);

  expand({{count(slab_.stride), count(slab_.cells_x), count(slab_.cells_y * b.count)}, {16, 1, 1}},
         rows_.buffer(), addend_.buffer(), cells_x, cells_y, to_int(slab_.cells_z), settings_.rate, stride,
         blocks);
  auto window = settings_.window.value_or(std::pair{0.0, 0.0});
  window.first -= errors_.rounding + errors_.ramp;
  window.second += errors_.rounding + errors_.ramp;
  const std::array<std::uint64_t, 3> local = column_tuning(state_.info).local;
  cell_slack({{count((b.nz + 15) / 16), count(b.nx - 1), count((b.ny - 1) * b.count)}, local},
             cells_above_.buffer(), cells_below_.buffer(), gold.buffer(), rows_.buffer(), nx, ny, nz,
             to_int(b.halo), to_int(b.gold_stride), stride, settings_.rate, cells_x, cells_y, blocks,
             settings_.grid_only ? 0 : 1, round_up(errors_.curved_rounding), settings_.window ? 1 : 0,
             static_cast<cl_float>(window.first), static_cast<cl_float>(window.second));
  node_slack({{count((b.nz + 15) / 16), count(b.nx), count(b.ny * b.count)}, local}, above.buffer(),
             below.buffer(), cells_above_.buffer(), cells_below_.buffer(), margin.buffer(), last.buffer(), nx,
             ny, nz, to_int(b.halo), stride, blocks, b.lowest, to_int(b.z_first), to_int(b.z_last));
}

void NodeSlack::operator()(const GoldBlocks& blocks,
                           const std::vector<std::array<std::int64_t, 3>>& first_brick,
                           const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                           opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below) {
  // Between columns and between kept nodes gold is interpolated: at a node, and in second differences.
  const double constant = errors_.interpolation + errors_.curved_interpolation;
  const Bricks bricks(settings_.grid, settings_.granularity);
  const std::int64_t g = settings_.granularity;
  std::vector<float> addend(count(slab_.cells_x * slab_.cells_y * slab_.cells_z) * first_brick.size(), 0.0f);
  auto next = addend.begin();
  for (const auto& first : first_brick)
    for (std::int64_t z = 0; z < slab_.cells_z; ++z)
      for (std::int64_t y = 0; y < slab_.cells_y; ++y)
        for (std::int64_t x = 0; x < slab_.cells_x; ++x, ++next) {
          const Index3 p{first[0] + x / g, first[1] + y / g, first[2] + z / g};
          if (p[0] >= bricks.along()[0] || p[1] >= bricks.along()[1]) continue;
          // A row's cells of one brick have one remainder.
          *next = x % g == 0 ? round_up(constant + static_cast<double>(remainder_.of(bricks.number(p), lattice_)))
                             : *std::prev(next);
        }
  addend_.write(addend);
  launch(blocks, first_brick, gold, margin, above, below);
}

}  // namespace vdvr
