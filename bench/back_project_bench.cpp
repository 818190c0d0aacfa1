// Back-projection alone: 256^3 samples from 180 views of 256 x 256, items = sample updates; the same beside a
// loop written by hand for AVX-512, turn by turn in one run, with the ratio of the two; and the same with
// each candidate for a row of host/base/opencl/column_tuning.cpp, with the ramp filter in both its ways.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "bench/hand_loop.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/filter_rows.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "vdvr/device.hpp"

using namespace vdvr;

namespace {

ProjectionSet scan_of(std::int64_t columns, std::int64_t rows, std::int64_t views) {
  ProjectionSet scan;
  scan.geometry.columns = columns;
  scan.geometry.rows = rows;
  scan.geometry.center = 0.5 * static_cast<double>(columns - 1);
  for (std::int64_t i = 0; i < views; ++i)
    scan.geometry.theta_rad.push_back(std::numbers::pi * static_cast<double>(i) / static_cast<double>(views));
  scan.data.resize(static_cast<std::size_t>(scan.size()));
  for (std::size_t i = 0; i < scan.data.size(); ++i) scan.data[i] = static_cast<float>(i % 7);
  return scan;
}

// n^3 samples of step 1 / rate about the axis, from k views of n x n.
struct Problem {
  Problem(std::int64_t size, std::int64_t views, int upsampling) : n(size), k(views), rate(upsampling) {
    scan = scan_of(n, n, k);
    filtered = filter_projections(device.state(), scan, {});
    Upsampler upsampler(device.state(), filtered);
    // So wide that no corner of the grid falls off the detector: nothing is clamped.
    slab = upsampler(upsampled_columns(n, rate, 0.25 * static_cast<double>(n)),
                     detector_rows(scan.geometry, -0.5 * static_cast<double>(n - 1), 1.0, n));
    out = opencl::DeviceArray<float>(device.state(), static_cast<std::uint64_t>(band * n * column_stride(n)),
                                     "columns");
  }

  [[nodiscard]] double first() const { return -0.5 * static_cast<double>(n - 1) / rate; }
  [[nodiscard]] double updates() const { return static_cast<double>(n * n * n * k); }

  // Enqueues rows y .. y + band - 1.
  void back_project_band(std::int64_t y, Interpolation filter) {
    back_project(device.state(), scan.geometry, slab,
                 {n,
                  std::min(band, n - y),
                  1.0 / rate,
                  1.0 / rate,
                  {{first(), first() + static_cast<double>(y) / rate}}},
                 filter, out, tuning);
  }
  void back_project_all(Interpolation filter) {
    for (std::int64_t y = 0; y < n; y += band) back_project_band(y, filter);
    opencl::finish(device.state(), "bench");
  }

  static constexpr std::int64_t band = 64;
  std::int64_t n, k;
  int rate;
  Device device;
  ColumnTuning tuning = column_tuning(device.info());
  ProjectionSet scan;
  FilteredScan filtered;
  UpsampledSlab slab;
  opencl::DeviceArray<float> out;
};

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void back_projection(benchmark::State& bench) {
  Problem problem(bench.range(0), bench.range(1), static_cast<int>(bench.range(2)));
  const Interpolation filter = bench.range(3) ? Interpolation::cubic : Interpolation::linear;
  for (auto _ : bench) problem.back_project_all(filter);
  bench.counters["updates"] = benchmark::Counter(problem.updates() * static_cast<double>(bench.iterations()),
                                                 benchmark::Counter::kIsRate);
}

// The largest difference between the engine's samples and the loop's, relative to the largest sample.
double difference(Problem& problem, std::span<const float> loop) {
  const std::int64_t n = problem.n, stride = column_stride(n), rows = (n + 15) / 16 * 16;
  double worst = 0, largest = 0;
  for (std::int64_t y0 = 0; y0 < n; y0 += Problem::band) {
    problem.back_project_band(y0, Interpolation::linear);
    const auto ours = problem.out.to_host();
    for (std::int64_t c = 0; c < std::min(Problem::band, n - y0) * n; ++c)
      for (std::int64_t z = 0; z < n; ++z) {
        const double a = static_cast<double>(ours[static_cast<std::size_t>(c * stride + z)]),
                     b = static_cast<double>(loop[static_cast<std::size_t>((y0 * n + c) * rows + z)]);
        if (!(std::abs(a - b) <= worst)) worst = std::abs(a - b);
        largest = std::max(largest, std::abs(b));
      }
  }
  return worst / largest;
}

// `ratio`: the engine's rate over the loop's, of the medians; one turn of each per iteration.
void beside_hand_loop(benchmark::State& bench) {
  if (const std::string missing = bench::hand_loop_missing(); !missing.empty()) {
    bench.SkipWithError(missing.c_str());
    return;
  }
  Problem problem(256, 180, 1);
  if (!problem.device.info().is_cpu) {
    bench.SkipWithError("the device is not this processor");
    return;
  }
  const std::int64_t n = problem.n, chunks = n / 16;
  std::vector<double> ours, theirs;
  double differs = 0;
  problem.slab.values.read_mapped([&](std::span<const float> filtered) {
    const bench::HandLoop loop{filtered,
                               problem.k,
                               problem.slab.columns.count,
                               chunks,
                               n,
                               n,
                               problem.first(),
                               1,
                               1,
                               problem.slab.columns.column_of(problem.scan.geometry.center),
                               problem.scan.geometry.theta_rad};
    std::vector<float> out(static_cast<std::size_t>(n * n * n));
    run_hand_loop(loop, out);
    differs = difference(problem, out);
    // Both compute relative positions in fp32, of up to n columns: n 2^-22 of a step of at most twice the
    // largest value.
    if (!(differs <= static_cast<double>(4 * n) * 0x1p-22)) {
      bench.SkipWithError("engine and loop disagree: not timed");
      return;
    }
    for (auto _ : bench) {
      ours.push_back(seconds_of([&] { problem.back_project_all(Interpolation::linear); }));
      theirs.push_back(seconds_of([&] { run_hand_loop(loop, out); }));
      bench.SetIterationTime(ours.back());
    }
  });
  if (ours.empty()) return;
  bench.counters["gups"] = problem.updates() / median(ours) / 1e9;
  bench.counters["loop_gups"] = problem.updates() / median(theirs) / 1e9;
  bench.counters["ratio"] = median(theirs) / median(ours);
  bench.counters["difference"] = differs;
}

// Lanes, tile, vectors, tiles and work-group of a candidate; tests/device/back_project_test.cpp holds the
// samples of such candidates to the reference.
void tuning(benchmark::State& bench) {
  Problem problem(256, 180, 1);
  ColumnTuning& t = problem.tuning;
  t.lanes = static_cast<int>(bench.range(0));
  t.tile = static_cast<int>(bench.range(1));
  t.vectors = static_cast<int>(bench.range(2));
  t.tiles = static_cast<int>(bench.range(3));
  for (std::size_t a = 0; a < 3; ++a) t.local[a] = static_cast<std::uint64_t>(bench.range(4 + a));
  if (t.local[0] * t.local[1] * t.local[2] > problem.device.info().max_work_group) {
    bench.SkipWithError("the device has no such work-group");
    return;
  }
  problem.back_project_all(Interpolation::linear);  // also builds the kernel
  for (auto _ : bench) problem.back_project_all(Interpolation::linear);
  bench.counters["updates"] = benchmark::Counter(problem.updates() * static_cast<double>(bench.iterations()),
                                                 benchmark::Counter::kIsRate);
}

using WorkGroup = std::array<std::int64_t, 3>;

void add_candidates(benchmark::internal::Benchmark* bench, std::int64_t lanes, std::int64_t tiles,
                    std::initializer_list<WorkGroup> groups) {
  for (const int tile : {1, 8})
    for (const int vectors : {1, 2})
      for (const WorkGroup& g : groups) bench->Args({lanes, tile, vectors, tiles, g[0], g[1], g[2]});
}

void candidates_of_gpus(benchmark::internal::Benchmark* bench) {
  for (const int lanes : {1, 4})
    add_candidates(bench, lanes, 1, {{32, 4, 2}, {16, 4, 4}, {64, 2, 1}, {32, 8, 1}});
}

void candidates_of_cpus(benchmark::internal::Benchmark* bench) {
  for (const int lanes : {8, 16}) {
    add_candidates(bench, lanes, 1, {{1, 8, 16}, {1, 4, 8}, {1, 16, 16}});
    // Many tiles are a work-group's worth of work by themselves.
    for (const int tiles : {2, 4, 8}) add_candidates(bench, lanes, tiles, {{1, 1, 1}});
  }
}

// The same number of pixels in rows of so many columns, filtered by FFT (0) or by product (1): up to where
// the product is faster a row's product_columns go.
void ramp_filter(benchmark::State& bench) {
  const std::int64_t columns = bench.range(0), rows = 64, views = (1 << 22) / (rows * columns);
  Device device;
  if (!has_transform(device.info(), columns, fft::Precision::fp64)) {
    bench.SkipWithError("the device has no transform of so many columns");
    return;
  }
  const ProjectionSet scan = scan_of(columns, rows, views);
  const FilterMethod method = bench.range(1) ? FilterMethod::product : FilterMethod::fourier;
  filter_projections(device.state(), scan, {}, {}, method);  // also builds the kernels
  for (auto _ : bench) filter_projections(device.state(), scan, {}, {}, method);
}

BENCHMARK(back_projection)
    ->Args({256, 180, 1, 0})
    ->Args({256, 180, 1, 1})
    ->Args({256, 90, 8, 0})
    ->Args({256, 90, 8, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(beside_hand_loop)->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(9);
BENCHMARK(tuning)
    ->Name("tuning_gpu")
    ->Apply(candidates_of_gpus)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(tuning)
    ->Name("tuning_cpu")
    ->Apply(candidates_of_cpus)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(ramp_filter)
    ->ArgsProduct({{256, 512, 1024, 2048, 4096}, {0, 1}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
