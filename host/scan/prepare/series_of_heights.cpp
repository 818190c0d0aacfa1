#include "host/scan/prepare/series_of_heights.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <thread>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/prepare/common_heights.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr {
namespace {

using Run = WeightsByHeight::Run;

std::string text_of(const Run& run) { return fmt::format("{} to {}", run.first, run.first + run.count - 1); }

// What is covered, as one run of heights.
Run the_run(const WeightsByHeight& weights, const ParallelGeometry& g) {
  const auto& covered = weights.covered();
  const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
  const std::string moves = fmt::format(
      "heights: the sample moves by {:.4g} rows along the axis, of views of {}", *most - *least, g.rows);
  if (covered.empty())
    throw InputError(
        fmt::format("{}, and none of {} heights is seen from every direction: it moves by more than the "
                    "detector's height in "
                    "half a turn, or views are missing; `views` takes a part",
                    moves, weights.seen().count));
  if (covered.size() == 1) return covered.front();
  std::vector<std::string> runs;
  for (const Run& run : covered) runs.push_back(text_of(run));
  throw InputError(
      fmt::format("{}; counted in rows of the first view, heights {} are seen from every direction, and what "
                  "lies between is "
                  "not; `views` takes a part",
                  moves, fmt::join(runs, ", and ")));
}

// One measured view's share of rows of the series, added to double sum[height][column].
void add_view(const float* view, std::int64_t k, const ParallelGeometry& g, const WeightsByHeight& weights,
              const Run& run, std::vector<double>& sum) {
  const std::int64_t V = g.rows, U = g.columns;
  for (std::int64_t j = 0; j < run.count; ++j) {
    const double share = weights.share(k, run.first + j);
    if (share == 0) continue;
    const std::vector<double> of_row = row_weights_at(V, weights.place(k, run.first + j));
    double* out = sum.data() + j * U;
    for (std::int64_t v = 0; v < V; ++v) {
      const double weight = share * of_row[at(v)];
      if (weight == 0) continue;
      for (std::int64_t u = 0; u < U; ++u) out[u] += weight * static_cast<double>(view[v * U + u]);
    }
  }
}

std::string words_of(const WeightsByHeight& weights, const Run& run, const ParallelGeometry& measured) {
  const auto views = std::ssize(weights.theta_rad());
  return fmt::format(
      "series of heights: {} views of {} rows saw {} heights; {} of them, {} in rows of the first view, are "
      "seen from every direction{}, and z = 0 is their middle",
      measured.views(), measured.rows, weights.seen().count, run.count, text_of(run),
      views < measured.views()
          ? fmt::format(" by {} views, into which those of one direction were joined", views)
          : std::string());
}

}  // namespace

HeightSeries series_of(const ParallelGeometry& g, bool full_turn) {
  return {g.rows, 0, full_turn, g.theta_rad, g.row_shift, g.column_shift};
}

void series_of_heights(ProjectionSet& scan, const HeightSeries& series, const WeightsByHeight& weights,
                       std::uint64_t max_memory_bytes, const std::filesystem::path& scratch) {
  ParallelGeometry& g = scan.geometry;
  const Run run = the_run(weights, g);
  const auto views = std::ssize(weights.theta_rad());
  const std::uint64_t plane = count(run.count * g.columns), size = count(views) * plane,
                      threads = std::max(1u, std::thread::hardware_concurrency());
  auto room = scratch_for_scan(views, run.count, g.columns, max_memory_bytes, scratch);
  io::require_memory(scan.data.resident_bytes() + (room ? max_memory_bytes / 8 : size * sizeof(float)) +
                         (threads * plane + count(g.views() * g.rows)) * sizeof(double),
                     max_memory_bytes, fmt::format("{} rows of a series of heights", run.count));
  SampleArray out(size, std::move(room), "the projections of a series of heights");
  parallel_for(views, {}, "", [&](std::int64_t view) {
    std::vector<double> sum(plane);
    for (const std::int64_t k : weights.measured(view))
      add_view(scan.data.data() + k * g.rows * g.columns, k, g, weights, run, sum);
    std::transform(sum.begin(), sum.end(), out.data() + count(view) * plane,
                   [](double p) { return static_cast<float>(p); });
  });
  scan.report.notes.push_back(words_of(weights, run, g));
  scan.report.preparation.heights = Heights::all;
  scan.data = std::move(out);
  g.series = series;
  g.series.first = run.first;
  g.rows = run.count;
  g.theta_rad = weights.theta_rad();
  g.row_shift.clear();
  if (g.column_shift.empty()) return;
  g.column_shift.clear();
  for (std::int64_t view = 0; view < views; ++view)
    g.column_shift.push_back(series.column_shift[at(weights.measured(view).front())]);
}

}  // namespace vdvr
