// Launches kernels/gold/node_slack.cl on batches of gold blocks.
#include "host/gold/node_slack.hpp"

#include <algorithm>

#include "host/fbp/back_project.hpp"
#include "host/opencl/kernel.hpp"
#include "host/system/casts.hpp"
#include "host/system/round_up.hpp"

namespace vdvr {
namespace {}  // namespace

NodeSlack::NodeSlack(opencl::State& state, CellBounds& cells, const FilteredScan& scan, const FieldSups& sups,
                     const GoldSettings& settings, double arithmetic, double rounding)
    : state_(state),
      cells_(cells),
      settings_(settings),
      arithmetic_(arithmetic),
      rounding_(rounding),
      remainder_(gold_remainder(scan, sups, settings.grid, settings.rate)) {}

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
  window.first -= arithmetic_;
  window.second += arithmetic_;
  const std::array<std::uint64_t, 3> local = column_tuning(state_.info).local;
  cell_slack({{count((b.nz + 15) / 16), count(b.nx - 1), count((b.ny - 1) * b.count)}, local},
             cells_above_.buffer(), cells_below_.buffer(), gold.buffer(), rows_.buffer(), nx, ny, nz,
             to_int(b.halo), to_int(b.gold_stride), stride, settings_.rate, cells_x, cells_y, blocks,
             settings_.grid_only ? 0 : 1, round_up(1.5 * rounding_), settings_.window ? 1 : 0,
             static_cast<cl_float>(window.first), static_cast<cl_float>(window.second));
  node_slack({{count((b.nz + 15) / 16), count(b.nx), count(b.ny * b.count)}, local}, above.buffer(),
             below.buffer(), cells_above_.buffer(), cells_below_.buffer(), margin.buffer(), last.buffer(), nx,
             ny, nz, to_int(b.halo), stride, blocks, b.lowest, to_int(b.z_first), to_int(b.z_last));
}

void NodeSlack::operator()(const GoldBlocks& blocks,
                           const std::vector<std::array<std::int64_t, 3>>& first_brick,
                           const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                           opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below,
                           opencl::DeviceArray<float>& p) {
  std::vector<float> of_cells, addend;
  cells_.look_up(slab_, first_brick, settings_.rate, of_cells, addend);
  // Second differences of computed gold miss by up to 1.5 P more than P itself (section 5).
  for (std::size_t i = 0; i < addend.size(); ++i)
    addend[i] = (2.5f * of_cells[i] + std::min(addend[i], round_up(remainder_))) * (1 + 0x1p-22f);
  p.write(of_cells);
  addend_.write(addend);
  launch(blocks, first_brick, gold, margin, above, below);
}

}  // namespace vdvr
