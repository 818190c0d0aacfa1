// Launches kernels/bounds/bound_table.cl (docs/error-bounds.md, sections 5 and 6).
#include "host/bounds/bound_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/fbp/reconstruct.hpp"
#include "host/opencl/kernel.hpp"
#include "host/system/casts.hpp"
#include "host/system/round_up.hpp"

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;

// One derivative of the filtered projections in a sum of bounds.
struct Term {
  int order_u, order_v;
  double weight;                  // relative to the table's factor
  int below, above;               // stencil of a column cell
  double remainder;               // rise between columns, relative to the row's largest sample
  std::vector<double> view_rise;  // what else a derivative may exceed its computed samples by
};

// Between two samples a derivative rises by at most step^2 / 8 of its second derivative, (pi / pitch)^2 of
// its sup.
double rise_between(double step, double pitch) { return std::pow(pi * step / pitch, 2) / 8; }

BoundTable make_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                      const UpsampledColumns& columns, const BoundCells& cells,
                      const std::vector<Term>& terms) {
  const ParallelGeometry& g = scan.geometry;
  BoundTable table;
  table.columns = columns;
  table.cells_z = cells.cells_z;
  const std::int64_t entries = cells.cells_z * g.views() * columns.count;
  opencl::DeviceArray<cl_float2> maxima(state, count(entries), "projection maxima");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> row_sup(state, "bounds/bound_table",
                                                                         "row_sup");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_float, cl_float, cl_int>
      fill(state, "bounds/bound_table", "bound_table");
  const std::int64_t chunk = view_chunk(scan, columns.count, static_cast<std::int64_t>(cells.rows.size()));
  for (const Term& term : terms) {
    std::vector<float> rise;
    for (const double r : term.view_rise) rise.push_back(round_up(r));
    require_finite(rise, term.order_u + term.order_v);
    const opencl::DeviceArray<float> device_rise(state, std::span<const float>(rise), "rise of derivatives");
    for (std::int64_t first = 0; first < g.views(); first += chunk) {
      const std::int64_t n = std::min(chunk, g.views() - first);
      const UpsampledSlab d = upsampler(columns, cells.rows, term.order_u, term.order_v, 0, first, n);
      opencl::DeviceArray<float> sup(state, count(n * d.rows_padded), "row maxima");
      row_sup({{count(d.rows_padded), count(n), 1}, {16, 1, 1}}, sup.buffer(), d.values.buffer(), to_int(n),
              to_int(columns.count), to_int(d.rows_padded));
      require_finite(sup.to_host(), term.order_u + term.order_v);
      fill({{count(columns.count), count(n), count(cells.cells_z)}, {64, 1, 1}}, maxima.buffer(),
           d.values.buffer(), sup.buffer(), device_rise.buffer(), to_int(first), to_int(n), to_int(g.views()),
           to_int(columns.count), to_int(d.rows_padded), to_int(d.rows), to_int(cells.row_step),
           to_int(cells.row_count), to_int(cells.cells_z), term.below, term.above,
           term.remainder > 0 ? round_up(term.remainder * (1 + 0x1p-20)) : 0.0f,
           round_up(term.weight * (1 + 0x1p-20)), &term == terms.data() ? 1 : 0);
    }
  }

  std::vector<cl_int> reach;
  for (const double theta : g.theta_rad) {
    // Half the cell's shadow, one column for the floor of its centre and one for fp32.
    const double half = cells.half_x * std::abs(std::cos(theta)) + cells.half_y * std::abs(std::sin(theta));
    reach.push_back(static_cast<cl_int>(std::ceil(half * columns.rate / g.pitch_u)) + 1);
  }
  const opencl::DeviceArray<cl_int> device_reach(state, std::span<const cl_int>(reach), "cell shadows");
  table.values = opencl::DeviceArray<cl_float2>(state, count(entries), "projection bounds");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> dilate(
      state, "bounds/bound_table", "dilate_table");
  dilate({{count(columns.count), count(cells.cells_z * g.views()), 1}, {64, 1, 1}}, table.values.buffer(),
         maxima.buffer(), device_reach.buffer(), to_int(g.views()), to_int(columns.count),
         to_int(cells.cells_z * g.views()));
  // The maxima are summed in fp32: up to K + 8 roundings.
  table.factor = 1 + (static_cast<double>(g.views()) + 8) * 0x1p-23;
  return table;
}

}  // namespace

BoundCells base_cells(const ParallelGeometry& geometry, const Grid& grid, int rate, int coarsest,
                      double first_z, std::int64_t cells_z) {
  BoundCells cells;
  const double hz = grid.spacing[2] / rate;
  const int beyond = rate / coarsest;  // second differences at the cell's nodes reach one gold row beyond it
  cells.rows = detector_rows(geometry, first_z - beyond * hz, hz, cells_z * rate + 1 + 2 * beyond);
  cells.row_step = rate;
  cells.row_count = rate + 1 + 2 * beyond;
  cells.cells_z = cells_z;
  cells.half_x = (0.5 + 1.0 / coarsest) * grid.spacing[0];
  cells.half_y = (0.5 + 1.0 / coarsest) * grid.spacing[1];
  return cells;
}

BoundCells gold_nodes(const ParallelGeometry& geometry, const Grid& grid, int rate, double first_z,
                      std::int64_t nodes_z) {
  BoundCells cells;
  cells.rows = detector_rows(geometry, first_z, grid.spacing[2] / rate, nodes_z);
  cells.cells_z = nodes_z;
  return cells;
}

BoundTable projection_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                            const UpsampledColumns& columns, int upsampling, Interpolation interpolation,
                            const BoundCells& cells) {
  const bool cubic = interpolation == Interpolation::cubic;
  const double step = scan.geometry.pitch_u / upsampling;
  // A row's sup is at most its largest sample times 1 / cos(pi / (2 rate)) (Ehlich, Zeller).
  Term term{cubic ? 4 : 2,
            0,
            1.0,
            cubic ? 1 : 0,
            cubic ? 2 : 1,
            rise_between(1.0, columns.rate) / std::cos(pi / (2.0 * columns.rate)),
            {}};
  for (const double m : scan.view_max)
    term.view_rise.push_back(derivative_rounding(upsampler, scan, columns, term.order_u, m) * (1 + 0x1p-20));
  BoundTable table = make_table(state, upsampler, scan, columns, cells, {term});
  table.factor *= cubic ? 3.0 / 128 * std::pow(step, 4) : step * step / 8;
  return table;
}

BoundTable remainder_table(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                           const FieldSups& sups, const Grid& grid, int rate, double first_z,
                           std::int64_t cells_z) {
  const ParallelGeometry& g = scan.geometry;
  // Four columns a pixel and four rows a base cell show where the fourth derivatives are large; what they can
  // rise between, relative to their sup over the view, is added.
  const int rows_per_cell = std::min(4, rate);
  const double row_spacing = grid.spacing[2] / rows_per_cell;
  BoundCells cells;
  cells.rows = detector_rows(g, first_z - row_spacing, row_spacing, cells_z * rows_per_cell + 3);
  cells.row_step = rows_per_cell;
  cells.row_count = rows_per_cell + 3;
  cells.cells_z = cells_z;
  cells.half_x = (0.5 + 1.0 / rate) * grid.spacing[0];
  cells.half_y = (0.5 + 1.0 / rate) * grid.spacing[1];
  const UpsampledColumns columns = columns_for(g, grid, 4);

  const double h = std::max(grid.spacing[0], grid.spacing[1]) / rate, hz = grid.spacing[2] / rate;
  const double wu = std::pow(pi / g.pitch_u, 2), wv = g.rows > 1 ? std::pow(pi / g.pitch_v, 2) : 0.0;
  const double rise = rise_between(g.pitch_u / columns.rate, g.pitch_u) +
                      (g.rows > 1 ? rise_between(row_spacing, g.pitch_v) : 0.0);
  // (1/8) times the weights of section 5, step 3; `sup` bounds the derivative of view k over the whole
  // detector.
  std::vector<Term> terms;
  const auto add = [&](int order_u, int order_v, double weight, auto&& sup) {
    Term term{order_u, order_v, weight / 8, 0, 1, 0.0, {}};
    for (std::size_t k = 0; k < scan.view_max.size(); ++k)
      term.view_rise.push_back(
          (rise * sup(k) + derivative_rounding(upsampler, scan, columns, order_u, scan.view_max[k]) *
                               std::pow(g.rows > 1 ? wv : 1.0, order_v / 2)) *
          (1 + 0x1p-20));
    terms.push_back(std::move(term));
  };
  add(4, 0, 5.0 / 24 * std::pow(h, 4), [&](std::size_t k) { return wu * sups.view_second_u[k]; });
  if (g.rows > 1) {
    add(2, 2, 2.0 / 8 * h * h * hz * hz,
        [&](std::size_t k) { return std::min(wv * sups.view_second_u[k], wu * sups.view_second_v[k]); });
    add(0, 4, 5.0 / 24 * std::pow(hz, 4), [&](std::size_t k) { return wv * sups.view_second_v[k]; });
  }
  // fp32 holds the weights relative to the first.
  const double unit = terms.front().weight;
  for (Term& t : terms) t.weight /= unit;
  BoundTable table = make_table(state, upsampler, scan, columns, cells, terms);
  table.factor *= unit;
  return table;
}

void project_bound(opencl::State& state, const FilteredScan& scan, const BoundTable& table,
                   const ColumnBlocks& blocks, const BlockCells& cells, double offset,
                   opencl::DeviceArray<float>& bound) {
  const ParallelGeometry& g = scan.geometry;
  const std::size_t views = static_cast<std::size_t>(g.views());
  const double scale = table.columns.rate / g.pitch_u;
  std::vector<cl_float4> steps(blocks.first.size() * views);
  for (std::size_t b = 0; b < blocks.first.size(); ++b)
    for (std::size_t k = 0; k < views; ++k) {
      const double c = std::cos(g.theta_rad[k]), s = std::sin(g.theta_rad[k]);
      const double t = (blocks.first[b][0] + offset * blocks.step_x) * c +
                       (blocks.first[b][1] + offset * blocks.step_y) * s;
      steps[b * views + k] = {{static_cast<float>(blocks.step_x * c * scale),
                               static_cast<float>(blocks.step_y * s * scale),
                               static_cast<float>(table.columns.column_of(t / g.pitch_u + g.center)), 0.0f}};
    }
  const opencl::DeviceArray<cl_float4> device_steps(state, std::span<const cl_float4>(steps),
                                                    "cell positions");
  // A table's entry is a sum of up to three products.
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_float, cl_float>
      kernel(state, "bounds/bound_table", "project_bound");
  kernel({{count(cells.x), count(cells.y), count(cells.z) * blocks.first.size()}, {8, 8, 1}}, bound.buffer(),
         table.values.buffer(), device_steps.buffer(), to_int(g.views()), to_int(table.columns.count),
         to_int(cells.x), to_int(cells.y), to_int(cells.z),
         to_int(static_cast<std::int64_t>(blocks.first.size())), to_int(cells.first_z),
         round_up(table.factor), static_cast<cl_float>(g.views()) * std::numeric_limits<cl_float>::min() * 3);
}

std::vector<float> projection_bound_at_nodes(opencl::State& state, Upsampler& upsampler,
                                             const FilteredScan& scan, const Grid& grid, int upsampling,
                                             Interpolation interpolation, int rate, const Index3& first_cell,
                                             const Index3& nodes) {
  Vec3 first{};
  for (std::size_t a = 0; a < 3; ++a)
    first[a] = grid.origin[a] + static_cast<double>(first_cell[a]) * grid.spacing[a];
  const BoundTable table =
      projection_table(state, upsampler, scan, columns_for(scan.geometry, grid, std::min(8, upsampling)),
                       upsampling, interpolation, gold_nodes(scan.geometry, grid, rate, first[2], nodes[2]));
  const ColumnBlocks blocks{
      nodes[0], nodes[1], grid.spacing[0] / rate, grid.spacing[1] / rate, {{first[0], first[1]}}, {}};
  opencl::DeviceArray<float> bound(state, count(nodes[0] * nodes[1] * nodes[2]), "node bounds");
  project_bound(state, scan, table, blocks, {nodes[0], nodes[1], nodes[2]}, 0.0, bound);
  return bound.to_host();
}

}  // namespace vdvr
