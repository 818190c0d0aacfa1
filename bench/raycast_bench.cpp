// Frames per second of the ray-caster at 512 x 512, step 1, shading on: a shell with a dense core, by volume
// size and mode.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>

#include "tests/support/fields.hpp"
#include "vdvr/raycast.hpp"

using namespace vdvr;

namespace {

Device& device() {
  static Device d;
  return d;
}

// A head-like object: air outside, a soft body, a dense shell in it, unit size.
double body(double x, double y, double z) {
  const double r = std::sqrt(x * x + 1.3 * y * y + z * z);
  const auto edge = [](double distance) { return std::min(1.0, std::max(0.0, 0.5 + 40 * distance)); };
  return 0.4 * edge(0.42 - r) + 0.5 * (edge(0.36 - r) - edge(0.32 - r)) +
         0.2 * edge(0.1 - std::hypot(x - 0.1, y, z));
}

const ResidentVolume& volume(std::int64_t n) {
  static std::map<std::int64_t, ResidentVolume> known;
  const auto found = known.find(n);
  if (found != known.end()) return found->second;
  const double d = 1.0 / static_cast<double>(n);
  const MixedVolume mixed = as_mixed(fields::uniform(fields::centred_grid({n, n, n}, {d, d, d}), body));
  return known.emplace(n, ResidentVolume(device(), mixed)).first->second;
}

void frames(benchmark::State& state, RenderMode mode, const char* preset, bool skip,
            Classification classification = Classification::post, StepMode step_mode = StepMode::fixed) {
  const ResidentVolume& v = volume(state.range(0));
  Renderer renderer(device(), v);
  RenderOptions o;
  o.mode = mode;
  o.surfaces = {{0.6}};
  o.classification = classification;
  o.step_mode = step_mode;
  o.transfer = transfer_preset(preset, 0, 1);
  o.skip_empty = skip;
  double azimuth = 0, samples = 0;
  for (auto _ : state) {
    o.camera = orbit_camera(v.grid(), azimuth += 6, 20, 1.3);
    samples += static_cast<double>(renderer.render(o).samples);
  }
  state.counters["fps"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["samples/s"] = benchmark::Counter(samples, benchmark::Counter::kIsRate);
}

}  // namespace

BENCHMARK_CAPTURE(frames, dvr, RenderMode::dvr, "default", true)
    ->Arg(64)
    ->Arg(128)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, dvr_bone, RenderMode::dvr, "bone", true)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, dvr_without_skipping, RenderMode::dvr, "default", false)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, dvr_preintegrated, RenderMode::dvr, "default", true, Classification::preintegrated)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, dvr_level_steps, RenderMode::dvr, "default", true, Classification::post,
                  StepMode::level)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, iso, RenderMode::iso, "default", true)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, mip, RenderMode::mip, "mip", true)
    ->Arg(64)
    ->Arg(256)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
