#include "apps/paper/cases.hpp"

#include <algorithm>
#include <chrono>

#include "vdvr/expert/safe_sampler.hpp"

namespace vdvr::paper {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

ProjectionError projection_error(Device& device, int angles, const Index3& samples,
                                 const Progress& progress) {
  const TestScan test = marschner_lobb_scan(angles, progress);
  const Grid at = lattice(test.grid, samples);
  const std::vector<float> truth = function_on(test.object, at);
  ProjectionError e;
  e.angles = angles;
  e.upsampled = measure_error(paper_field_on(device, test.scan, at, progress), truth);
  const D2vrField d2vr(device, test.scan, {}, progress);
  e.d2vr = measure_error(d2vr_on(d2vr, at, progress), truth);
  return e;
}

const char* text_of(Settings settings) {
  switch (settings) {
    case Settings::paper_cells:
      return "paper, cell by cell";
    case Settings::paper_open:
      return "paper, closing none";
    case Settings::paper:
      return "paper";
    case Settings::ours:
      break;
  }
  return "ours";
}

Case build_case(Device& device, const ProjectionSet& scan, const Grid& grid, const CaseOptions& options,
                const Progress& progress) {
  const bool ours = options.settings == Settings::ours;
  Case c;
  c.settings = options.settings;
  c.epsilon = options.epsilon;
  RateOptions rates;
  PlanSettings plan_settings;
  BuildOptions build_options;
  plan_settings.forecast = false;
  build_options.window = options.window;
  if (options.absolute) {
    c.tolerance.absolute = options.epsilon;
  } else {
    c.tolerance.relative = options.epsilon;
    c.epsilon_of_max = !ours;
  }
  if (!ours) {
    // What --paper stands for (apps/vdvr/options.cpp).
    rates = {8, Interpolation::linear, 8};
    plan_settings.comparison = {Coefficients::sampled, Terms::grid,
                                options.settings == Settings::paper ? Closing::paper : Closing::none,
                                c.epsilon_of_max};
    plan_settings.levels = Levels::isotropic;
    build_options.storage = StorageChoice::f32;
    if (options.settings == Settings::paper_cells) plan_settings.granularity = 1;
  }
  const auto start = Clock::now();
  const Plan plan = make_plan(device, scan, grid, {}, rates, c.tolerance, plan_settings, progress);
  BuildResult built = build(device, scan, plan, build_options, progress);
  c.seconds = since(start);
  c.volume = std::move(built.volume);
  c.certificate = std::move(built.certificate);
  c.sampler = safe_sampler(device, c.volume, c.certificate).sampler;
  return c;
}

Camera turned_camera(const Grid& grid, double azimuth_deg) {
  constexpr double elevation = 20, zoom = 1;  // those of bench render
  return orbit_camera(grid, azimuth_deg, elevation, zoom);
}

RenderOptions timing_view(const Grid& grid) {
  RenderOptions o;
  o.sampler = SamplerKind::automatic;
  o.gradient = GradientKind::automatic;
  o.camera = turned_camera(grid, 0);
  return o;
}

Speed measure_speed(const std::function<RenderResult(const RenderOptions&)>& draw, RenderOptions options,
                    const Grid& grid, int frames, const Progress& progress) {
  if (frames < 1) return {};
  draw(options);  // builds kernels and lets the sampler be chosen
  std::vector<double> seconds, samples;
  for (int f = 0; f < frames; ++f) {
    report(progress, "time frames", static_cast<double>(f) / frames);
    options.camera = turned_camera(grid, 360.0 * f / frames);
    const auto start = Clock::now();
    const RenderResult result = draw(options);
    seconds.push_back(since(start));
    samples.push_back(static_cast<double>(result.samples) / seconds.back());
  }
  std::sort(seconds.begin(), seconds.end());
  std::sort(samples.begin(), samples.end());
  Speed s;
  s.frames = frames;
  s.seconds_min = seconds.front();
  s.seconds_median = seconds[seconds.size() / 2];
  s.seconds_max = seconds.back();
  s.fps = 1 / s.seconds_median;
  s.samples_per_second = samples[samples.size() / 2];
  return s;
}

}  // namespace vdvr::paper
