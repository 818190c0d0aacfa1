#include "host/scan/prepare/common_heights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double hit = 1e-9;  // of a row

// sum over m of cos(pi m d / n) / n, m = 1 .. n - 1, and 1 / 2n: what a row at distance d contributes.
double kernel(std::int64_t n, double d) {
  const auto rows = static_cast<double>(n);
  const double x = pi * d / rows, half = std::sin(0.5 * x);
  if (std::abs(half) < 1e-12) return (rows - 0.5) / rows;
  // Dirichlet's: 1/2 + sum of m < n is sin((n - 1/2) x) / (2 sin(x / 2)).
  return std::sin((rows - 0.5) * x) / (2 * half) / rows;
}

}  // namespace

std::vector<double> row_weights_at(std::int64_t rows, double place) {
  std::vector<double> weights(at(rows), 0.0);
  const double nearest = std::round(place);
  if (std::abs(place - nearest) <= hit) {
    weights[at(std::clamp<std::int64_t>(static_cast<std::int64_t>(nearest), 0, rows - 1))] = 1;
    return weights;
  }
  for (std::int64_t v = 0; v < rows; ++v)
    weights[at(v)] =
        kernel(rows, place - static_cast<double>(v)) + kernel(rows, place + static_cast<double>(v) + 1);
  return weights;
}

std::int64_t count_of_common_heights(const ParallelGeometry& g) {
  const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
  return static_cast<std::int64_t>(
      std::max(0.0, std::floor(static_cast<double>(g.rows) - (*most - *least) + hit)));
}

void common_heights(ProjectionSet& scan, std::uint64_t max_memory_bytes,
                    const std::filesystem::path& scratch) {
  ParallelGeometry& g = scan.geometry;
  const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
  const double range = *most - *least, middle = 0.5 * (*least + *most);
  const std::int64_t common = count_of_common_heights(g);
  if (common < 1)
    throw InputError(fmt::format(
        "the sample moves by {:.4g} rows along the axis, and views of {} rows share no height; `heights` all "
        "takes those that are seen from every direction",
        range, g.rows));
  const std::int64_t rows = g.rows, columns = g.columns;
  const auto size = static_cast<std::uint64_t>(g.views() * common * columns);
  auto room = scratch_for_scan(g.views(), common, columns, max_memory_bytes, scratch);
  io::require_memory(scan.data.resident_bytes() + (room ? max_memory_bytes / 8 : size * sizeof(float)),
                     max_memory_bytes, fmt::format("{} rows at common heights", common));
  SampleArray out(size, std::move(room), "the projections at common heights");
  parallel_for(g.views(), {}, "", [&](std::int64_t k) {
    const float* view = scan.data.data() + k * rows * columns;
    std::vector<double> sum(at(columns));
    for (std::int64_t j = 0; j < common; ++j) {
      const double place =
          0.5 * static_cast<double>(rows - common) + static_cast<double>(j) + g.row_shift[at(k)] - middle;
      const std::vector<double> weights = row_weights_at(rows, place);
      std::fill(sum.begin(), sum.end(), 0.0);
      for (std::int64_t v = 0; v < rows; ++v) {
        if (weights[at(v)] == 0) continue;
        for (std::int64_t u = 0; u < columns; ++u)
          sum[at(u)] += weights[at(v)] * static_cast<double>(view[v * columns + u]);
      }
      std::transform(sum.begin(), sum.end(), out.data() + (k * common + j) * columns,
                     [](double p) { return static_cast<float>(p); });
    }
  });
  scan.data = std::move(out);
  g.rows = common;
  g.extension.common_heights = true;
  scan.report.preparation.heights = Heights::common;
  scan.report.notes.push_back(fmt::format(
      "common heights: the sample moves by {:.4g} rows along the axis; of {} rows {} are at heights "
      "that every view sees, and z = 0 is their middle",
      range, rows, common));
}

}  // namespace vdvr
