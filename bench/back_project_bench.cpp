// Back-projection alone: 256^3 samples from 180 views of 256 x 256, items = sample updates.
#include <benchmark/benchmark.h>

#include "host/back_project.hpp"
#include "host/opencl/kernel.hpp"
#include "host/reconstruct_field.hpp"
#include "vdvr/device.hpp"

using namespace vdvr;

static void back_projection(benchmark::State& bench) {
  const std::int64_t n = bench.range(0), k = bench.range(1);
  const int rate = static_cast<int>(bench.range(2));
  const std::string filter = bench.range(3) ? "cubic" : "linear";
  ProjectionSet scan;
  scan.geometry.columns = scan.geometry.rows = n;
  scan.geometry.center = 0.5 * static_cast<double>(n - 1);
  for (std::int64_t i = 0; i < k; ++i)
    scan.geometry.theta_rad.push_back(3.14159265 * static_cast<double>(i) / static_cast<double>(k));
  scan.data.assign(static_cast<std::size_t>(scan.size()), 1.0f);
  for (std::size_t i = 0; i < scan.data.size(); ++i) scan.data[i] = static_cast<float>(i % 7);
  Device device;
  const FilteredScan filtered = filter_projections(device.state(), scan, {});
  Upsampler upsampler(device.state(), filtered);
  const auto columns = upsampled_columns(n, rate, 2);
  const auto rows = detector_rows(scan.geometry, -0.5 * static_cast<double>(n - 1), 1.0, n);
  const UpsampledSlab slab = upsampler(columns, rows);
  const std::int64_t band = 64;
  opencl::DeviceArray<float> out(device.state(), static_cast<std::uint64_t>(band * n * column_stride(n)),
                                 "out");
  // Samples at the upsampled spacing times `rate`: a gold block when rate > 1.
  for (auto _ : bench) {
    for (std::int64_t y = 0; y < n; y += band) {
      const ColumnBlocks blocks{n,
                                std::min(band, n - y),
                                1.0 / rate,
                                1.0 / rate,
                                {{-0.5 * static_cast<double>(n) / rate,
                                  (-0.5 * static_cast<double>(n) + static_cast<double>(y)) / rate}}};
      back_project(device.state(), scan.geometry, slab, blocks, filter, out);
    }
    opencl::finish(device.state(), "bench");
  }
  bench.counters["updates"] =
      benchmark::Counter(static_cast<double>(n * n * n * k) * static_cast<double>(bench.iterations()),
                         benchmark::Counter::kIsRate);
}
BENCHMARK(back_projection)
    ->Args({256, 180, 1, 0})
    ->Args({256, 180, 1, 1})
    ->Args({256, 90, 8, 0})
    ->Args({256, 90, 8, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
