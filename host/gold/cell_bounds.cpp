// Keeps what bound_table.cpp computes, layer by layer, so that two rates of gold share it.
#include "host/gold/cell_bounds.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "host/fbp/reconstruct.hpp"
#include "host/system/casts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

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

CellBounds::CellBounds(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                       const FieldSups& sups, const GoldSettings& settings)
    : state_(state), scan_(scan), upsampler_(upsampler), sups_(sups), settings_(settings) {
  const Index3& cells = settings.grid.cells;
  p_.assign(at(cells[0] * cells[1] * cells[2]), -1.0f);
  remainder_ = p_;
}

void CellBounds::end() {
  projection_.reset();
  remainders_.reset();
}

double CellBounds::take_table_seconds() { return std::exchange(table_seconds_, 0.0); }

void CellBounds::make_tables(const CellLayers& slab) {
  if (projection_ && slab == slab_) return;
  end();
  slab_ = slab;
  const double z_first =
      settings_.grid.origin[2] + static_cast<double>(slab.first) * settings_.grid.spacing[2];
  state_.queue.finish();
  const auto start = std::chrono::steady_clock::now();
  projection_ = projection_table(
      state_, upsampler_, scan_,
      columns_for(scan_.geometry, settings_.grid, std::min(8, settings_.upsampling)), settings_.upsampling,
      settings_.interpolation,
      base_cells(scan_.geometry, settings_.grid, settings_.rate, settings_.coarsest(), z_first, slab.count));
  remainders_ = remainder_table(state_, upsampler_, scan_, sups_, settings_.grid, settings_.coarsest(),
                                z_first, slab.count);
  state_.queue.finish();
  table_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void CellBounds::compute(const SlabShape& slab, const FirstBricks& first_brick) {
  make_tables(slab.slab);
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  ColumnBlocks columns{slab.cells_x, slab.cells_y, grid.spacing[0], grid.spacing[1], {}, {}};
  for (const auto& f : first_brick)
    columns.first.push_back({grid.origin[0] + static_cast<double>(f[0] * g) * grid.spacing[0],
                             grid.origin[1] + static_cast<double>(f[1] * g) * grid.spacing[1]});
  const BlockCells cells{slab.cells_x, slab.cells_y, slab.cells_z, slab.cell_z - slab.slab.first};
  opencl::DeviceArray<float> bound(
      state_, count(slab.cells_x * slab.cells_y * slab.cells_z) * first_brick.size(), "bounds of cells");
  project_bound(state_, scan_, *projection_, columns, cells, 0.5, bound);
  const std::vector<float> p = bound.to_host();
  project_bound(state_, scan_, *remainders_, columns, cells, 0.5, bound);
  const std::vector<float> r = bound.to_host();
  each_cell(grid, g, slab, first_brick, [&](std::size_t i, std::size_t cell) {
    // Whichever blocks happen to share a batch: a cell's values stay what they were.
    if (p_[cell] >= 0) return;
    p_[cell] = p[i];
    remainder_[cell] = r[i];
    if (!(p[i] >= 0 && r[i] >= 0)) throw InputError("a bound of the scan's derivatives is not a number");
  });
}

void CellBounds::look_up(const SlabShape& slab, const FirstBricks& first_brick, int rate,
                         std::vector<float>& p, std::vector<float>& remainder) {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  computed_ = false;
  each_cell(grid, g, slab, first_brick,
            [&](std::size_t, std::size_t cell) { computed_ = computed_ || p_[cell] < 0; });
  if (computed_) compute(slab, first_brick);
  p.assign(first_brick.size() * at(slab.cells_x * slab.cells_y * slab.cells_z), 0.0f);
  remainder.assign(p.size(), 0.0f);
  // The remainder goes with the fourth power of gold's spacing.
  const auto finer = static_cast<float>(std::pow(static_cast<double>(settings_.coarsest()) / rate, 4));
  each_cell(grid, g, slab, first_brick, [&](std::size_t i, std::size_t cell) {
    p[i] = p_[cell];
    remainder[i] = finer * remainder_[cell];
  });
}

std::vector<float> CellBounds::new_cells(const SlabShape& slab, const FirstBricks& first_brick) const {
  std::vector<float> cells;
  if (!computed_) return cells;
  each_cell(settings_.grid, settings_.granularity, slab, first_brick, [&](std::size_t, std::size_t cell) {
    cells.push_back(p_[cell]);
    cells.push_back(remainder_[cell]);
  });
  return cells;
}

void CellBounds::restore(const SlabShape& slab, const FirstBricks& first_brick,
                         const std::vector<float>& cells) {
  if (cells.empty()) return;
  std::size_t next = 0;
  each_cell(settings_.grid, settings_.granularity, slab, first_brick, [&](std::size_t, std::size_t cell) {
    if (next + 2 > cells.size()) return;
    p_[cell] = cells[next++];
    remainder_[cell] = cells[next++];
  });
}

}  // namespace vdvr
