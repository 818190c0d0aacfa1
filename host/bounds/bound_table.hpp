// Bounds that are sums over views of derivative maxima under a cell's shadow: P, the error of interpolating
// the projections, and the remainder of T (docs/error-bounds.md, sections 5 and 6). Called by cell_bounds.cpp
// and plan.cpp.
#pragma once

#include <string>
#include <vector>

#include "host/bounds/projection_bounds.hpp"
#include "host/fbp/back_project.hpp"
#include "vdvr/grid.hpp"

namespace vdvr {

/// What a bound is wanted for: boxes of x, y and z, regular in all three. A base cell widened by one gold
/// step, or a single node.
struct BoundCells {
  std::vector<double> rows;  ///< detector rows on which derivatives are sampled, from below the first cell on
  std::int64_t row_step = 1;   ///< rows from one cell to the next along z
  std::int64_t row_count = 1;  ///< rows that count for a cell
  std::int64_t cells_z = 1;
  double half_x = 0, half_y = 0;  ///< half widths of the box
};
/// Base cells of a slab: their gold nodes at `rate` and a gold step of the coarser rate `coarsest` around.
/// `first_z`: world z of the first gold node.
BoundCells base_cells(const ParallelGeometry& geometry, const Grid& grid, int rate, int coarsest,
                      double first_z, std::int64_t cells_z);
/// The gold nodes of a slab, each a cell of its own.
BoundCells gold_nodes(const ParallelGeometry& geometry, const Grid& grid, int rate, double first_z,
                      std::int64_t nodes_z);

/// float2 values[cell z][view][column]: the sup of the positive and of the negative part of a sum of
/// derivatives over what a cell centred on the column can hit; `factor` times their sums over views is the
/// bound.
struct BoundTable {
  opencl::DeviceArray<cl_float2> values;
  UpsampledColumns columns;
  std::int64_t cells_z = 0;
  double factor = 0;
};

/// P of interpolation in u at rate `upsampling`. `columns` is where the derivative is evaluated, not denser
/// than that. Cost: one derivative of the slab.
BoundTable projection_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                            const UpsampledColumns& columns, int upsampling, Interpolation interpolation,
                            const BoundCells& cells);

/// The part of T that second differences of gold do not show. Cost: three derivatives at a quarter of the
/// pitch and of the base spacing.
BoundTable remainder_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                           const FieldSups& sups, const Grid& grid, int rate, double first_z,
                           std::int64_t cells_z);

/// Cells of blocks whose bounds are wanted, counted x, y, z; the first along z is the table's `first_z`.
struct BlockCells {
  std::int64_t x = 1, y = 1, z = 1, first_z = 0;
};
/// The bound of every cell: float bound[block][z][y][x]. Cells are one step of `blocks` wide and centred
/// `offset` steps from its columns. Enqueues; does not wait.
void project_bound(opencl::State& state, const FilteredScan& scan, const BoundTable& table,
                   const ColumnBlocks& blocks, const BlockCells& cells, double offset,
                   opencl::DeviceArray<float>& bound);

/// P at every gold node of a box of nodes that begins at a base cell's corner: float p[z][y][x], `nodes`
/// counted x, y, z. The sharpest form, at the cost of gold itself: the certificate takes base cells.
std::vector<float> projection_bound_at_nodes(opencl::State& state, Upsampler& upsampler,
                                             const FilteredScan& scan, const Grid& grid, int upsampling,
                                             Interpolation interpolation, int rate, const Index3& first_cell,
                                             const Index3& nodes);

}  // namespace vdvr
