// vdvr plan: bounds, rates, shares, storage, memory and time foreseen; builds nothing.
#include "vdvr/expert/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <nlohmann/json.hpp>

#include "apps/common/progress.hpp"
#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/noise_words.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/picture_forecast.hpp"

namespace vdvr::cli {
namespace {

// Files on the disk while planning, which build will need again.
std::uint64_t scratch_bytes(const ProjectionSet& scan) {
  return scan.data.scratch() ? scan.data.scratch()->peak_bytes() : 0;
}

// What a build takes that is spread over ranks of vdvr-mpi (docs/scaling.md, How it scales), from what one
// device takes alone.
struct Spread {
  std::int64_t ranks = 1, machines = 1;
  double seconds = 0;
  std::uint64_t first_machine = 0, other_machine = 0;  // bytes of memory, of all ranks there
  std::uint64_t messages = 0;                          // bytes
};

Spread spread_over(const Planned& p, std::int64_t ranks, std::int64_t machines) {
  const Plan& plan = p.made.plan;
  Spread s{ranks, machines};
  // The scan and what is filtered of it are the leader's, and kept gold is a machine's: of that, no more is
  // taken to be spread than among ranks that are all on machines of their own.
  s.seconds = plan.seconds_of_rows + (plan.seconds - plan.seconds_of_rows) / static_cast<double>(ranks);
  const std::uint64_t scan = p.scan.data.resident_bytes(),
                      of_all = std::min(plan.memory_bytes, 2 * scan + plan.memory_of_rows),
                      of_rank = plan.memory_bytes - of_all;
  const auto here = static_cast<std::uint64_t>((ranks + machines - 1) / machines),
             others = static_cast<std::uint64_t>(ranks - 1);
  s.first_machine = plan.memory_bytes + (here - 1) * of_rank;
  s.other_machine = machines > 1 ? scan + plan.memory_of_rows + here * of_rank : 0;
  const std::uint64_t base = 4 * static_cast<std::uint64_t>(plan.grid.sample_count()),
                      field = base + plan.tile_bytes;
  s.messages =
      others > 0 ? others * (base + field) + plan.tile_bytes + static_cast<std::uint64_t>(machines - 1) * scan
                 : 0;
  return s;
}

std::optional<Spread> spread_of(const Arguments& args, const Planned& p) {
  constexpr std::int64_t most = 100000;
  if (!args.has("ranks")) return std::nullopt;
  const std::int64_t ranks = args.integer_or("ranks", 1, 1, most);
  return spread_over(p, ranks, args.integer_or("machines", 1, 1, ranks));
}

Json spread_json(const Spread& s) {
  return {{"ranks", s.ranks},
          {"machines", s.machines},
          {"seconds", s.seconds},
          {"memory_bytes", {{"first_machine", s.first_machine}, {"other_machine", s.other_machine}}},
          {"message_bytes", s.messages}};
}

void print_spread(const Spread& s) {
  fmt::print("  {} ranks on {}: at most {:.1f} s, {} of memory on the first machine{}, {} of messages\n",
             s.ranks, s.machines == 1 ? "one machine" : fmt::format("{} machines", s.machines), s.seconds,
             bytes_text(s.first_machine),
             s.machines == 1 ? "" : fmt::format(" and {} on each other", bytes_text(s.other_machine)),
             bytes_text(s.messages));
}

// Of pictures, their own foreseen in place of what one tolerance for all bricks takes.
Json plan_forecast_json(const Planned& p, const std::optional<PictureForecast>& forecast) {
  const Plan& plan = p.made.plan;
  Json json = {{"gold_samples", plan.gold_samples},
               {"memory_bytes", forecast ? forecast->memory_bytes : plan.memory_bytes},
               {"scratch_bytes", scratch_bytes(p.scan)},
               {"seconds", forecast ? forecast->seconds : plan.seconds},
               {"samples_ratio", forecast ? forecast->samples_ratio : plan.samples_ratio}};
  if (forecast) json["pictures"] = forecast_json(*forecast, plan);
  return json;
}

Json rates_json(const Rates& rates) {
  Json json{
      {"upsampling_u", rates.upsampling}, {"u_filter", text_of(rates.interpolation)}, {"gold", rates.gold}};
  if (rates.interpolation == Interpolation::eight_taps) json["differences"] = rates.differences;
  return json;
}

Json plan_json(const Planned& p, const std::optional<PictureForecast>& forecast) {
  const Plan& plan = p.made.plan;
  return {{"epsilon", plan.epsilon},
          {"epsilon_abs", plan.epsilon_abs},
          {"reference_range", plan.reference_range},
          {"rates", rates_json(plan.rates)},
          {"base", cells_per_base_sample(plan.layout.coarsening)},
          {"bounds", bounds_json(plan.bounds)},
          {"budget", budget_json(plan.budget)},
          {"foreseen", plan_forecast_json(p, forecast)},
          {"not_covered", {{"count", plan.not_covered_count}, {"fraction", plan.not_covered_fraction}}},
          {"grid", grid_json(plan.grid)},
          {"geometry", geometry_json(p.scan.geometry)},
          {"report", report_json(p.scan.report)},
          {"estimated", plan.estimated},
          {"notes", plan.notes}};
}

void print_plan(const Planned& p, const std::optional<PictureForecast>& forecast) {
  const Plan& plan = p.made.plan;
  print_scan(p.scan);
  print_grid(plan.grid);
  print_bounds(plan.bounds, plan.epsilon_abs);
  fmt::print("plan           epsilon {:.4g} ({:.4g} % of the range {:.4g})\n", plan.epsilon_abs,
             100 * plan.epsilon, plan.reference_range);
  fmt::print("  rates        u {}x {}, gold {}x\n", plan.rates.upsampling, text_of(plan.rates.interpolation),
             plan.rates.gold);
  print_budget(plan.budget, plan.epsilon_abs);
  const auto base = cells_per_base_sample(plan.layout.coarsening);
  fmt::print("  base         a sample every {} x {} x {} cells\n", base[0], base[1], base[2]);
  fmt::print("  not covered  {} samples ({:.2f} %)\n", plan.not_covered_count,
             100 * plan.not_covered_fraction);
  if (forecast) print_forecast(*forecast, plan);
  else
    fmt::print(
        "foreseen       {:.3f} samples stored per base sample before repair, {} of memory, {:.1f} s, {} gold "
        "samples per pass\n",
        plan.samples_ratio, bytes_text(plan.memory_bytes), plan.seconds, plan.gold_samples);
  if (const std::uint64_t bytes = scratch_bytes(p.scan); bytes > 0)
    fmt::print("  scratch      {} of files while it runs, since the scan takes an eighth of --max-memory\n",
               bytes_text(bytes));
  print_notes(plan.notes);
}

}  // namespace

int plan_command(Arguments& args) {
  args.positional("IN", "projections")
      .value("ranks", "N", "also what N ranks of vdvr-mpi would take, each with a device as this one")
      .value("machines", "M", "on which these ranks are, alike on each (default 1)");
  add_plan_options(args);
  add_build(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  refuse(args, {"window"}, "a plan is for the whole grid; give it to build");
  if (args.has("size"))
    refuse(args, {"roi"}, "with --size a plan is for that grid, the whole of it; leave out one of the two");
  if (args.has("picture-tolerance"))
    refuse(args, {"ranks"}, "foresees one tolerance for all bricks; leave out --picture-tolerance");
  refuse(args, {"resume"}, "a plan has nothing to resume; give it to build");
  if (!args.has("ranks")) refuse(args, {"machines"}, "give --ranks with it");
  Wanted wanted = wanted_of(args);
  wanted.options.plan.estimate = true;
  Device device = open_device(common);
  ProgressLine progress(args.who(), common.quiet);
  const Planned planned = read_and_plan(device, args, wanted, progress.callback());
  const std::optional<PictureForecast> forecast =
      picture_forecast(device, planned, wanted, progress.callback());
  const NoiseFound& found = planned.noise;
  const std::optional<FieldNoise> noise = noise_of_plan(device, planned, progress.callback());
  Json json = plan_json(planned, forecast);
  json["noise"] = noise_json(found);
  if (noise) json["noise"]["field"] = field_noise_json(*noise, planned.made.plan);
  const std::optional<Spread> spread = spread_of(args, planned);
  if (spread) json["foreseen"]["spread"] = spread_json(*spread);
  progress.clear();
  print_result(common, json, [&] {
    print_plan(planned, forecast);
    print_noise(found);
    if (noise) print_field_noise(*noise, planned.made.plan);
    if (spread) print_spread(*spread);
  });
  return 0;
}

}  // namespace vdvr::cli
