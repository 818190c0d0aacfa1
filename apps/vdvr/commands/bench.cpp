// vdvr bench: timings, one JSON line per case on standard output, on a terminal a table. The result is
// checked before it is timed.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/bench_table.hpp"
#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/source.hpp"
#include "apps/vdvr/view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::cli {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Json spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {{"min", values.front()},
          {"median", 0.5 * (values[(n - 1) / 2] + values[n / 2])},
          {"max", values.back()}};
}

Json bench_line(const std::string& name, const Device& device, std::size_t repetitions) {
  return {{"case", name},
          {"device", device.info().name},
          {"driver", device.info().driver},
          {"repetitions", repetitions}};
}

/// A table for who looks on, a line of JSON for programs, which read through a pipe.
void print_line(const CommonOptions& common, const Json& json) {
  const bool person = !common.json && isatty(STDOUT_FILENO) != 0;
  fmt::print("{}\n", person ? bench_table(json) : json.dump());
  std::fflush(stdout);
}

/// The mean over the ball of half the radius must be the sphere's density: FBP keeps means to far better than
/// the percent asked for here, and a wrong weight, angle or pitch misses it.
void check_sphere(const Volume& volume, double radius) {
  const Index3 n = volume.grid.samples();
  double sum = 0, count = 0;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Vec3 p = volume.grid.position({x, y, z});
        if (std::hypot(p[0], p[1], p[2]) > 0.5 * radius) continue;
        sum += static_cast<double>(volume.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]);
        count += 1;
      }
  const double mean = sum / count;
  if (!(std::abs(mean - 1) <= 0.01))
    throw MismatchError(fmt::format("the reconstructed sphere has density {:.6g}, not 1: not timed", mean));
}

/// Only these cost updates: columns outside the covered region are 0. Of the middle plane, which the sphere's
/// projections fill; above and below it samples are 0 as well, but computed.
std::int64_t computed_samples(const Volume& volume) {
  const Index3 n = volume.grid.samples();
  const auto middle = volume.samples.begin() + n[2] / 2 * n[1] * n[0];
  return n[2] * std::count_if(middle, middle + n[1] * n[0], [](float s) { return s != 0; });
}

/// Only these cost updates, of columns that are computed plane by plane.
std::int64_t nonzero_samples(const Volume& volume) {
  return std::count_if(volume.samples.begin(), volume.samples.end(), [](float s) { return s != 0; });
}

/// FBP, or FDK of a full turn about a cone of that half angle, of a sphere.
int bench_reconstruction(Arguments& args, const std::string& name, std::optional<double> half_cone_deg) {
  args.value("size", "256", "samples per axis, and detector columns and rows (default 256)")
      .value("angles", half_cone_deg ? "360" : "180", "views")
      .value("repetitions", "N", "default 5");
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const std::int64_t size = args.integer_or("size", 256, 8, 4096);
  const auto repetitions = static_cast<std::size_t>(args.integer_or("repetitions", 5, 1, 1000));
  SimulateOptions simulated;
  simulated.angles = static_cast<int>(args.integer_or("angles", half_cone_deg ? 360 : 180, 2, 1 << 16));
  simulated.columns = simulated.rows = size;
  simulated.band_limited = false;
  const double radius = 0.375 * static_cast<double>(size);
  if (half_cone_deg) {
    const double distance =
        0.5 * static_cast<double>(size) / std::tan(*half_cone_deg * std::numbers::pi / 180);
    simulated.arc_deg = 360;
    simulated.cone.emplace();
    simulated.cone->source_to_axis = simulated.cone->source_to_detector = distance;
  }

  Device device = open_device(common);
  ProgressLine progress(args.who(), common.quiet);
  const ProjectionSet scan = simulate(sphere(radius), simulated, progress.callback());
  GridOptions cells;
  cells.size = Index3{size - 1, size - 1, size - 1};
  const Grid grid = make_grid(scan, cells);
  ReconstructOptions options;
  options.upsampling = 1;
  const Volume checked = reconstruct(device, scan, grid, options, progress.callback());
  check_sphere(checked, radius);

  std::vector<double> seconds, gups;
  const std::int64_t computed = half_cone_deg ? nonzero_samples(checked) : computed_samples(checked);
  const double updates = static_cast<double>(computed) * simulated.angles;
  for (std::size_t i = 0; i < repetitions; ++i) {
    const auto start = Clock::now();
    reconstruct(device, scan, grid, options, [](const std::string&, double) { throw_if_stopped(); });
    seconds.push_back(since(start));
  }
  // Again stage by stage: waiting between stages is not part of the end-to-end time.
  StageSeconds stages;
  for (std::size_t i = 0; i < repetitions; ++i) {
    StageSeconds once;
    reconstruct(device, scan, grid, options, {}, &once);
    gups.push_back(updates / once.at("back-project") / 1e9);
    for (const auto& [stage, s] : once) stages[stage] += s / static_cast<double>(repetitions);
  }
  progress.clear();
  Json line = bench_line(name, device, repetitions);
  line["samples"] = grid.samples();
  line["detector"] = {size, size};
  line["computed_samples"] = computed;
  line["angles"] = simulated.angles;
  line["seconds"] = spread(seconds);
  line["gups"] = spread(gups)["median"];  // of the back-projection alone
  line["stages"] = seconds_json(stages);
  line["gups_end_to_end"] = updates / line["seconds"]["median"].get<double>() / 1e9;
  print_line(common, line);
  return 0;
}

/// Seconds of the plain reconstruction of the same grid, interpolated from the detector's own columns as
/// `bench fbp` does: what a certificate's cost is measured by.
std::vector<double> seconds_of_fbp(Device& device, const ProjectionSet& scan, const Grid& grid,
                                   const FieldOptions& field, std::size_t repetitions) {
  ReconstructOptions options;
  options.field = field;
  options.upsampling = 1;
  std::vector<double> seconds;
  for (std::size_t i = 0; i <= repetitions; ++i) {
    const auto start = Clock::now();
    reconstruct(device, scan, grid, options, [](const std::string&, double) { throw_if_stopped(); });
    if (i > 0) seconds.push_back(since(start));  // the first builds kernels
  }
  return seconds;
}

int bench_build(Arguments& args) {
  args.positional("IN", "projections").value("repetitions", "N", "default 1");
  add_plan_options(args);
  add_build(args);
  add_common(args);
  if (!args.parse()) return 0;
  refuse(args, {"resume"}, "a timing has nothing to resume; give it to build");
  const CommonOptions common = common_options(args);
  Wanted wanted = wanted_of(args);
  wanted.noted_noise = false;
  wanted.options.plan.forecast = false;
  const auto repetitions = static_cast<std::size_t>(args.integer_or("repetitions", 1, 1, 1000));
  ProgressLine progress(args.who(), common.quiet);
  Device device = open_device(common);
  std::vector<double> seconds;
  std::optional<BuildResult> built;  // checked by build itself: it throws unless the certificate holds
  double plan_seconds = 0;
  std::optional<Planned> planned;
  Grid grid;
  FieldOptions field;
  for (std::size_t i = 0; i < repetitions; ++i) {
    built.reset();
    planned.reset();
    const auto start = Clock::now();
    planned.emplace(read_and_plan(device, args, wanted, progress.callback()));
    plan_seconds = since(start);
    grid = planned->made.plan.grid;
    field = planned->made.plan.field;
    built = build_planned(device, *planned, wanted, progress.callback());
    seconds.push_back(since(start));
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const std::uint64_t peak_device_bytes = device.peak_memory();
  const std::vector<double> fbp_seconds =
      seconds_of_fbp(device, planned->scan, grid, field, std::max<std::size_t>(3, repetitions));
  progress.clear();
  Json line = bench_line("build", device, repetitions);
  line["cells"] = built->volume.grid.cells;
  line["epsilon"] = built->certificate.epsilon;
  line["seconds"] = spread(seconds);
  line["stages"] = seconds_json(built->seconds);
  line["stages"]["read_and_plan"] = plan_seconds;
  line["peak_host_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  line["peak_device_bytes"] = peak_device_bytes;
  line["fbp_seconds"] = spread(fbp_seconds);
  line["seconds_over_fbp"] =
      line["seconds"]["median"].get<double>() / line["fbp_seconds"]["median"].get<double>();
  line["storage"] = storage_json(built->volume, 0);
  print_line(common, line);
  return 0;
}

/// That this process took of its processors up to now, of all threads, the system's part left out.
double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

/// A picture with content: not one colour all over.
void check_picture(const Image& image) {
  const std::size_t n = image.rgb.size();
  for (std::size_t i = 3; i < n; ++i)
    if (image.rgb[i] != image.rgb[i - 3]) return;
  throw MismatchError("the first frame is of one colour: not timed");
}

int bench_render(Arguments& args) {
  args.positional("FILE", "a certified volume, or a uniform one; or with --method d2vr projections");
  add_method(args);
  args.value("frames", "60", "over a full turn (default 60)").value("size", "512x512", "pixels");
  constexpr Orbit first{0, 20, 1};
  add_transfer(args);
  add_orbit(args, first, "the volume");
  args.value("sampler", "auto|image3d|buffer", "default auto");
  args.value("step", "S", "in base cells (default 1)");
  args.value("gradient", "auto|central|stored|analytic", "as `render` takes it (default auto)")
      .flag("no-shading", "colours of the transfer function alone, without light");
  add_scan(args);
  add_volume_input(args);
  add_projection_options(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const std::string method = method_option(args);
  const std::int64_t frames = args.integer_or("frames", 60, 1, 100000);
  const SamplerKind sampler = sampler_option(args);
  ProgressLine progress(args.who(), common.quiet);
  Source source(args, common, method, false, progress.callback());
  const Scene& scene = source.scene();
  const Brightness bright = brightness_of(scene.volume);
  RenderOptions o;
  if (const auto size = args.sizes("size", 2)) {
    o.width = (*size)[0];
    o.height = (*size)[1];
  }
  o.step = args.positive_or("step", o.step);
  o.shading = !args.has("no-shading");
  if (!o.shading) refuse(args, {"gradient"}, "excludes --no-shading");
  o.gradient = gradient_option(args);
  o.transfer = transfer_for(args, bright, scene.volume.grid);
  // A speed promises nothing: one asked for by name is timed whatever it may err by.
  const SafeSampler safe = source.take_sampler(sampler, true);
  o.sampler = safe.sampler;

  o.skip_empty = !args.has("no-skip");
  const Orbit orbit = orbit_options(args, first);
  o.camera = orbit_camera(scene.volume.grid, orbit.azimuth, orbit.elevation, orbit.zoom);
  RenderResult last = source.draw(o);  // also builds the kernels and lets `auto` choose, before timing
  check_picture(last.image);
  std::vector<double> fps, rays, samples;
  const double processor_before = processor_seconds();
  for (std::int64_t f = 0; f < frames; ++f) {
    report(progress.callback(), "render", static_cast<double>(f) / static_cast<double>(frames));
    const double turned = 360.0 * static_cast<double>(f) / static_cast<double>(frames);
    o.camera = orbit_camera(scene.volume.grid, orbit.azimuth + turned, orbit.elevation, orbit.zoom);
    const auto start = Clock::now();
    last = source.draw(o);
    const double seconds = since(start);
    fps.push_back(1 / seconds);
    rays.push_back(static_cast<double>(o.width * o.height) / seconds);
    samples.push_back(static_cast<double>(last.samples) / seconds);
  }
  const double processor = processor_seconds() - processor_before;
  progress.clear();
  Json line = bench_line("render", source.device(), fps.size());
  line["method"] = method;
  line["size"] = {o.width, o.height};
  line["cells"] = scene.volume.grid.cells;
  line["transfer"] = o.transfer.name;
  line["step"] = o.step;
  line["gradient"] = o.shading ? gradient_name(last.gradient) : "none";
  line["orbit"] = {orbit.azimuth, orbit.elevation, orbit.zoom};
  line["sampler"] = sampler_name(last.sampler);
  line["resident_bytes"] = source.bytes();
  std::vector<double> seconds(fps.size());
  std::transform(fps.begin(), fps.end(), seconds.begin(), [](double x) { return 1 / x; });
  line["seconds"] = spread(seconds);
  line["fps"] = spread(fps);
  line["rays_per_second"] = spread(rays)["median"];
  line["samples_per_second"] = spread(samples)["median"];
  // On a CPU that others use, too, this says more than the time on the clock.
  line["processor_seconds"] = processor / static_cast<double>(frames);
  print_line(common, line);
  return 0;
}

}  // namespace

int bench_command(Arguments& args) {
  const std::string name = args.take_word();
  if (name == "fbp") return bench_reconstruction(args, name, std::nullopt);
  if (name == "fdk") return bench_reconstruction(args, name, 10.0);
  if (name == "build") return bench_build(args);
  if (name == "render") return bench_render(args);
  if (name == "paper") throw InputError("the paper's figures and tables are made by the program vdvr-paper");
  if (!name.empty())
    throw InputError(
        fmt::format("'{}' is not a case of this version; there are fbp, fdk, build, render", name));
  args.group(
          "Cases: fbp [--size N --angles K] | fdk [--size N --angles K] | build IN --epsilon E | "
          "render FILE [--frames N]; each has its own --help")
      .flag("help,h", "this text")
      .flag("help-all", "the same");
  if (!args.parse()) return 0;
  throw InputError("name a case: fbp, fdk, build or render");
}

}  // namespace vdvr::cli
