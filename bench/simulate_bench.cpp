// Seconds per simulated scan: the paper's two set-ups and a volume, band-limited; the low-pass alone.
// Run by hand: `simulate_bench` of the `bench` preset.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "host/scan/simulate/simulate_band_limit.hpp"
#include "vdvr/expert/simulate.hpp"

namespace {

using namespace vdvr;

SimulateOptions detector(std::int64_t columns, std::int64_t rows, int angles) {
  SimulateOptions o;
  o.columns = columns;
  o.rows = rows;
  o.angles = angles;
  return o;
}

void run(benchmark::State& state, const Phantom& phantom, const SimulateOptions& options) {
  for (auto _ : state) benchmark::DoNotOptimize(simulate(phantom, options).data.data());
  state.SetItemsProcessed(state.iterations() * options.angles * options.columns * options.rows);
}

void marschner_lobb_paper(benchmark::State& state) {
  run(state, marschner_lobb(32 / std::sqrt(2.0)), detector(65, 65, 74));
}
void shepp_logan_paper(benchmark::State& state) { run(state, shepp_logan(64), detector(129, 129, 202)); }

void volume(benchmark::State& state) {
  const std::int64_t n = state.range(0);
  Volume v;
  v.grid.cells = {n - 1, n - 1, n - 1};
  const double first = -static_cast<double>(n - 1) / 2;
  v.grid.origin = {first, first, first};
  for (std::int64_t i = 0; i < n * n * n; ++i) v.samples.push_back(static_cast<float>(i % 7));
  run(state, volume_phantom(v), detector(n, n, 18));
}

void low_pass(benchmark::State& state) {
  const std::int64_t columns = state.range(0), rows = 64;
  const BandLimiter limiter(columns);
  const std::vector<double> fine(static_cast<std::size_t>(16 * columns * rows), 1.0);
  std::vector<double> out(static_cast<std::size_t>(columns * rows));
  for (auto _ : state) {
    limiter.apply(fine, out);
    benchmark::DoNotOptimize(out.data());
  }
  state.SetItemsProcessed(state.iterations() * rows * 8 * columns * columns);  // multiplications
}

}  // namespace

BENCHMARK(marschner_lobb_paper)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(shepp_logan_paper)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(volume)->Arg(64)->Arg(128)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(low_pass)->Arg(65)->Arg(129)->Arg(1024)->Unit(benchmark::kMillisecond);
