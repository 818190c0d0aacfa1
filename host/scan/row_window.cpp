#include "host/scan/row_window.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"

namespace vdvr {
namespace {

// Fewer rows say little of what lies between them.
constexpr std::int64_t fewest_rows = 24;
// Views that tell how much goes on in a row, and how near to the mean of all rows a window's is to come.
constexpr std::int64_t looked_at = 12;
constexpr double alike = 0.02;
// Of what nineteen rows in twenty stay below: more would be a row at which the object ends, and let it stand
// for many.
constexpr double most_of_row = 3;

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

// How much goes on in a row: second differences both ways, to the power with which tiles grow with the error.
double activity(const ProjectionSet& scan, std::int64_t row) {
  const ParallelGeometry& g = scan.geometry;
  const std::int64_t step = std::max<std::int64_t>(1, g.views() / looked_at);
  double sum = 0;
  for (std::int64_t k = 0; k < g.views(); k += step) {
    const float* at_row = scan.data.data() + (k * g.rows + row) * g.columns;
    const auto add = [&](const float* p, std::int64_t apart) {
      sum += std::pow(std::abs(static_cast<double>(p[-apart]) - 2 * static_cast<double>(p[0]) +
                               static_cast<double>(p[apart])),
                      1.5);
    };
    for (std::int64_t u = 1; u + 1 < g.columns; ++u) add(at_row + u, 1);
    if (row == 0 || row + 1 == g.rows) continue;
    for (std::int64_t u = 0; u < g.columns; ++u) add(at_row + u, g.columns);
  }
  return std::isfinite(sum) ? sum : 0;
}

// Of `rows` neighbours among these, the first: those nearest to the middle that are like all of them, or else
// the most alike.
std::int64_t most_typical(std::span<const double> of_row, std::int64_t rows) {
  std::vector<double> sorted(of_row.begin(), of_row.end());
  const auto high = sorted.begin() + std::ssize(sorted) * 19 / 20;
  std::ranges::nth_element(sorted, high);
  std::vector<double> up_to{0};
  for (const double a : of_row) up_to.push_back(up_to.back() + std::min(a, most_of_row * *high));
  const double mean = up_to.back() / static_cast<double>(of_row.size()) * static_cast<double>(rows);
  const std::int64_t last = std::ssize(of_row) - rows, middle = (last + 1) / 2;
  const auto unlike = [&](std::int64_t first) {
    return std::max(alike * mean, std::abs(up_to[at(first + rows)] - up_to[at(first)] - mean));
  };
  std::int64_t best = middle;
  for (std::int64_t away = 1; away <= last; ++away)
    for (const std::int64_t first : {middle - away, middle + away})
      if (first >= 0 && first <= last && unlike(first) < unlike(best)) best = first;
  return best;
}

}  // namespace

std::optional<RowWindow> row_window(const ProjectionSet& scan, const Grid& grid, std::int64_t most_samples) {
  const ParallelGeometry& g = scan.geometry;
  RowWindow out;
  out.rows = std::max(fewest_rows, most_samples / (g.views() * g.columns));
  if (out.rows >= g.rows) return std::nullopt;
  // Among those that the grid covers, or else around its middle.
  const auto row_at = [&](double z) { return z / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1); };
  const double height_of_grid = static_cast<double>(grid.cells[2]) * grid.spacing[2];
  const auto low_row = std::max<std::int64_t>(0, std::llround(std::ceil(row_at(grid.origin[2]) - 1e-9))),
             end_row = std::min<std::int64_t>(
                 g.rows, std::llround(std::floor(row_at(grid.origin[2] + height_of_grid) + 1e-9)) + 1);
  if (end_row - low_row > out.rows) {
    std::vector<double> of_row(at(end_row - low_row));
    parallel_for(end_row - low_row, {}, "",
                 [&](std::int64_t i) { of_row[at(i)] = activity(scan, low_row + i); });
    out.first = low_row + most_typical(of_row, out.rows);
  } else {
    const double middle_row = row_at(grid.origin[2] + 0.5 * height_of_grid);
    out.first = std::clamp<std::int64_t>(std::llround(middle_row - 0.5 * static_cast<double>(out.rows - 1)),
                                         0, g.rows - out.rows);
  }
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
