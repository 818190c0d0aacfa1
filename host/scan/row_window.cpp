#include "host/scan/row_window.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {
namespace {

// Fewer rows say little of what lies between them.
constexpr std::int64_t fewest_rows = 24;

ProjectionSet rows_of(const ProjectionSet& scan, std::int64_t first, std::int64_t rows) {
  const ParallelGeometry& g = scan.geometry;
  ProjectionSet out;
  out.geometry = g;
  out.geometry.rows = rows;
  out.geometry.series.first += first;
  out.report = scan.report;
  const std::int64_t run = rows * g.columns;
  // Beside the scan: kept gold goes where the scan lies, and the window is to cost what the whole does.
  out.data =
      SampleArray(static_cast<std::size_t>(g.views() * run), scan.data.scratch(), "a window of the rows");
  for (std::int64_t k = 0; k < g.views(); ++k)
    std::copy_n(scan.data.data() + (k * g.rows + first) * g.columns, run, out.data.data() + k * run);
  return out;
}

}  // namespace

std::optional<RowWindow> row_window(const ProjectionSet& scan, const Grid& grid, std::int64_t most_samples) {
  const ParallelGeometry& g = scan.geometry;
  RowWindow out;
  out.rows = std::max(fewest_rows, most_samples / (g.views() * g.columns));
  if (out.rows >= g.rows) return std::nullopt;
  // Around the grid's middle.
  const double middle = grid.origin[2] + 0.5 * static_cast<double>(grid.cells[2]) * grid.spacing[2];
  const double middle_row = middle / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1);
  out.first = std::clamp<std::int64_t>(std::llround(middle_row - 0.5 * static_cast<double>(out.rows - 1)), 0,
                                       g.rows - out.rows);
  // Heights of the outermost of these rows, and the nodes of the grid between them.
  const auto height = [&](std::int64_t row) {
    return (static_cast<double>(row) - 0.5 * static_cast<double>(g.rows - 1)) * g.pitch_v;
  };
  const double low = height(out.first), high = height(out.first + out.rows - 1), h = grid.spacing[2];
  const auto first =
      std::max<std::int64_t>(0, static_cast<std::int64_t>(std::ceil((low - grid.origin[2]) / h - 1e-9)));
  const auto last = std::min<std::int64_t>(
      grid.cells[2], static_cast<std::int64_t>(std::floor((high - grid.origin[2]) / h + 1e-9)));
  if (last <= first) return std::nullopt;
  out.grid = grid;
  out.grid.cells[2] = last - first;
  out.grid.origin[2] += static_cast<double>(first) * h - 0.5 * (low + high);
  out.scan = rows_of(scan, out.first, out.rows);
  return out;
}

}  // namespace vdvr
