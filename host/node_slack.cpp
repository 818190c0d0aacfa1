// Launches kernels/gold_bounds.cl on batches of gold blocks.
#include "host/node_slack.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "host/back_project.hpp"
#include "host/opencl/kernel.hpp"
#include "host/reconstruct_field.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

cl_int to_int(std::int64_t n) { return static_cast<cl_int>(n); }
std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }
std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

// (index in a batch's [block][cell z][y][x], index in the grid's cells) of every base cell inside the grid.
template <class Visit>
void each_cell(const Grid& grid, std::int64_t g, const SlabShape& s,
               const std::vector<std::array<std::int64_t, 3>>& first_brick, Visit&& visit) {
  for (std::size_t b = 0; b < first_brick.size(); ++b) {
    const std::int64_t x0 = first_brick[b][0] * g, y0 = first_brick[b][1] * g;
    for (std::int64_t z = 0; z < s.cells_z; ++z)
      for (std::int64_t y = 0; y < std::min(s.cells_y, grid.cells[1] - y0); ++y)
        for (std::int64_t x = 0; x < std::min(s.cells_x, grid.cells[0] - x0); ++x)
          visit(((b * at(s.cells_z) + at(z)) * at(s.cells_y) + at(y)) * at(s.cells_x) + at(x),
                at(((s.cell_z + z) * grid.cells[1] + y0 + y) * grid.cells[0] + x0 + x));
  }
}

}  // namespace

NodeSlack::NodeSlack(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                     const FieldSups& sups, const GoldSettings& settings, double arithmetic, double rounding)
    : state_(state),
      scan_(scan),
      upsampler_(upsampler),
      sups_(sups),
      settings_(settings),
      arithmetic_(arithmetic),
      rounding_(rounding),
      remainder_(gold_remainder(scan, sups, settings.grid, settings.rate)) {
  const Index3& cells = settings.grid.cells;
  cell_p_.assign(at(cells[0] * cells[1] * cells[2]), -1.0f);
  cell_addend_ = cell_p_;
}

void NodeSlack::begin(const SlabShape& slab, std::int64_t together) {
  slab_ = slab;
  const std::int64_t rate = settings_.rate;
  const std::uint64_t cells = count(together * slab.cells_x * slab.cells_y * slab.cells_z);
  const std::uint64_t columns =
      count(together * (slab.cells_x * rate + 1) * (slab.cells_y * rate + 1) * slab.stride);
  addend_ = opencl::DeviceArray<float>(state_, cells, "slack of cells");
  cell_remainder_ = opencl::DeviceArray<float>(state_, cells, "remainders of cells");
  cells_above_ = opencl::DeviceArray<float>(state_, columns, "cell slack above");
  cells_below_ = opencl::DeviceArray<float>(state_, columns, "cell slack below");
  rows_ = opencl::DeviceArray<float>(state_, count(together * slab.cells_x * slab.cells_y * slab.stride),
                                     "slack by base cell of gold cells");
}

void NodeSlack::end() {
  projection_.reset();
  remainders_.reset();
  addend_ = {};
  cell_remainder_ = {};
  cells_above_ = {};
  cells_below_ = {};
  rows_ = {};
}

double NodeSlack::take_table_seconds() { return std::exchange(table_seconds_, 0.0); }

bool NodeSlack::known(const std::array<std::int64_t, 3>& first) const {
  bool all = true;
  each_cell(settings_.grid, settings_.granularity, slab_, {first},
            [&](std::size_t, std::size_t cell) { all = all && cell_p_[cell] >= 0; });
  return all;
}

void NodeSlack::look_up(std::int64_t blocks, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                        opencl::DeviceArray<float>& p_of_cells) {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  std::vector<float> p(at(blocks * slab_.cells_x * slab_.cells_y * slab_.cells_z), 0.0f), r(p.size(), 0.0f);
  computed_ = !std::all_of(first_brick.begin(), first_brick.end(), [&](const auto& f) { return known(f); });
  if (computed_) {
    if (!projection_) {
      state_.queue.finish();
      const auto start = std::chrono::steady_clock::now();
      projection_ = projection_table(
          state_, upsampler_, scan_, columns_for(scan_.geometry, grid, std::min(8, settings_.upsampling)),
          settings_.upsampling, settings_.u_filter,
          base_cells(scan_.geometry, grid, settings_.rate, slab_.z_first, slab_.cells_z));
      remainders_ = remainder_table(state_, upsampler_, scan_, sups_, grid, settings_.rate, slab_.z_first,
                                    slab_.cells_z);
      state_.queue.finish();
      table_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    ColumnBlocks nodes{slab_.cells_x * rate + 1,
                       slab_.cells_y * rate + 1,
                       grid.spacing[0] / static_cast<double>(rate),
                       grid.spacing[1] / static_cast<double>(rate),
                       {},
                       {}};
    for (const auto& f : first_brick)
      nodes.first.push_back({grid.origin[0] + static_cast<double>(f[0] * g) * grid.spacing[0],
                             grid.origin[1] + static_cast<double>(f[1] * g) * grid.spacing[1]});
    const double centre = 0.5 * static_cast<double>(rate);
    project_bound(state_, scan_, *projection_, nodes, slab_.cells_x, slab_.cells_y, settings_.rate, centre,
                  p_of_cells);
    project_bound(state_, scan_, *remainders_, nodes, slab_.cells_x, slab_.cells_y, settings_.rate, centre,
                  cell_remainder_);
    p_of_cells.read(std::span<float>(p));
    cell_remainder_.read(std::span<float>(r));
    each_cell(grid, g, slab_, first_brick, [&](std::size_t i, std::size_t cell) {
      // Whichever blocks happen to share a batch: a cell's values stay what they were.
      if (cell_p_[cell] >= 0) return;
      cell_p_[cell] = p[i];
      cell_addend_[cell] = (2.5f * p[i] + std::min(r[i], static_cast<float>(remainder_))) * (1 + 0x1p-22f);
    });
  }
  each_cell(grid, g, slab_, first_brick, [&](std::size_t i, std::size_t cell) {
    p[i] = cell_p_[cell];
    r[i] = cell_addend_[cell];
  });
  p_of_cells.write(p);
  addend_.write(r);
}

std::vector<float> NodeSlack::new_cells(const SlabShape& slab,
                                        const std::vector<std::array<std::int64_t, 3>>& first_brick) const {
  std::vector<float> cells;
  if (!computed_) return cells;
  each_cell(settings_.grid, settings_.granularity, slab, first_brick, [&](std::size_t, std::size_t cell) {
    cells.push_back(cell_p_[cell]);
    cells.push_back(cell_addend_[cell]);
  });
  return cells;
}

void NodeSlack::restore(const SlabShape& slab, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                        const std::vector<float>& cells) {
  if (cells.empty()) return;
  std::size_t next = 0;
  each_cell(settings_.grid, settings_.granularity, slab, first_brick, [&](std::size_t, std::size_t cell) {
    if (next + 2 > cells.size()) return;
    cell_p_[cell] = cells[next++];
    cell_addend_[cell] = cells[next++];
  });
}

void NodeSlack::launch(const GoldBlocks& b, const std::vector<std::array<std::int64_t, 3>>& first_brick,
                       const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                       opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below) {
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> expand(
      state_, "gold_bounds", "expand_bound");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_float, cl_float, cl_int, cl_float, cl_float>
      cell_slack(state_, "gold_bounds", "cell_slack");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_float, cl_int, cl_int>
      node_slack(state_, "gold_bounds", "node_slack");
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
             settings_.grid_only ? 0.0f : 1.0f, static_cast<cl_float>(1.5 * rounding_),
             settings_.window ? 1 : 0, static_cast<cl_float>(window.first),
             static_cast<cl_float>(window.second));
  node_slack({{count((b.nz + 15) / 16), count(b.nx), count(b.ny * b.count)}, local}, above.buffer(),
             below.buffer(), cells_above_.buffer(), cells_below_.buffer(), margin.buffer(), last.buffer(), nx,
             ny, nz, to_int(b.halo), stride, blocks, b.lowest, to_int(b.z_first), to_int(b.z_last));
}

void NodeSlack::operator()(const GoldBlocks& blocks,
                           const std::vector<std::array<std::int64_t, 3>>& first_brick,
                           const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                           opencl::DeviceArray<float>& above, opencl::DeviceArray<float>& below,
                           opencl::DeviceArray<float>& p) {
  look_up(blocks.count, first_brick, p);
  launch(blocks, first_brick, gold, margin, above, below);
}

}  // namespace vdvr
