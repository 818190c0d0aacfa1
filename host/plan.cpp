// Bounds side by side, and rates by trial on sample blocks of the gold stream (docs/error-bounds.md). Called
// by the command line.
#include "vdvr/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <numbers>

#include "host/choose_coarsening.hpp"
#include "host/covered_range.hpp"
#include "host/foresee.hpp"
#include "host/gold_stream.hpp"
#include "host/host_memory.hpp"
#include "host/paper_bounds.hpp"
#include "host/reconstruct_field.hpp"
#include "host/sampler_terms.hpp"
#include "host/result_units.hpp"
#include "host/volume_problem.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr double pi = std::numbers::pi;
const std::vector<int> bound_rates{1, 2, 4, 8, 16, 32};

struct Rates {
  int upsampling;
  std::string u_filter;
  int gold;
};

// Of the tolerance, what T, P and rounding may take: a smaller share costs time, a larger one storage.
constexpr double share = 0.5, patient_share = 0.65;
// The same for P alone: a finer cubic interpolation costs memory only.
constexpr double linear_share = 0.1, cubic_share = 0.03;

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

// Cheapest first: gold costs eight times per doubling, cubic in u twice the linear, upsampling memory only.
std::vector<Rates> candidates(const RateOptions& wanted) {
  std::vector<Rates> all;
  for (const int gold : {8, 16, 32})
    for (const auto& [upsampling, filter] : {std::pair<int, const char*>{8, "linear"},
                                             {16, "linear"},
                                             {8, "cubic"},
                                             {16, "cubic"},
                                             {32, "cubic"}})
      all.push_back({upsampling, filter, gold});
  for (Rates& r : all) {
    if (wanted.upsampling) r.upsampling = *wanted.upsampling;
    if (wanted.gold) r.gold = *wanted.gold;
  }
  std::vector<Rates> out;
  for (const Rates& r : all) {
    const bool same = std::any_of(out.begin(), out.end(), [&](const Rates& o) {
      return o.upsampling == r.upsampling && o.u_filter == r.u_filter && o.gold == r.gold;
    });
    if (!same && (wanted.u_filter == "auto" || wanted.u_filter == r.u_filter)) out.push_back(r);
  }
  return out;
}

void check_rates(const RateOptions& rates) {
  const auto power = [](int n, int low) {
    return n >= low && n <= 64 && std::has_single_bit(static_cast<unsigned>(n));
  };
  if (rates.upsampling && !power(*rates.upsampling, 2))
    throw InputError(fmt::format("--upsampling {} must be a power of two, 2 to 64 (rate 1 has no bound)",
                                 *rates.upsampling));
  if (rates.gold && !power(*rates.gold, 2))
    throw InputError(fmt::format("--gold {} must be a power of two, 2 to 64", *rates.gold));
  if (rates.u_filter != "auto" && rates.u_filter != "linear" && rates.u_filter != "cubic")
    throw InputError(fmt::format("--u-filter '{}' must be auto, linear or cubic", rates.u_filter));
}

// Global bounds at every rate, the paper's beside ours.
std::vector<Bound> global_bounds(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                                 const Volume& base, bool with_paper) {
  const Grid& grid = base.grid;
  std::vector<Bound> out;
  const ParallelGeometry& g = scan.geometry;
  // Each view costs rows * columns * (rows + columns) multiply-adds: beyond this the table would take
  // minutes.
  const double amplitude_cost =
      static_cast<double>(g.views() * g.rows * g.columns) * static_cast<double>(g.rows + g.columns);
  if (amplitude_cost < 4e10) {
    const AmplitudeBounds a = amplitude_bounds(scan, grid, bound_rates);
    for (const auto& [rate, value] : a.projection)
      out.push_back({"projection", "amplitude, linear in u", rate, value, true});
    for (const auto& [rate, value] : a.gold) out.push_back({"gold", "amplitude", rate, value, true});
  }
  const auto append = [&](const std::vector<Bound>& more) {
    out.insert(out.end(), more.begin(), more.end());
  };
  if (with_paper && 10 * static_cast<double>(g.views() * g.rows * g.columns) *
                            static_cast<double>(std::max(g.rows, g.columns)) <
                        4e10)
    append(paper_projection_bounds(state, scan, bound_rates));
  if (with_paper && 18 * static_cast<double>(grid.sample_count()) *
                            static_cast<double>(*std::max_element(grid.cells.begin(), grid.cells.end())) <
                        2e10)
    append(paper_gold_bounds(state, base, bound_rates));
  for (const int rate : bound_rates) {
    const double du = g.pitch_u / rate, h = std::max(grid.spacing[0], grid.spacing[1]) / rate,
                 hz = grid.spacing[2] / rate;
    const double wu = pi / g.pitch_u;
    out.push_back({"projection", "curvature, linear in u", rate, du * du / 8 * sups.second_u, true});
    out.push_back({"projection", "curvature, cubic in u", rate,
                   3.0 / 128 * std::pow(du, 4) * wu * wu * sups.second_u, true});
    out.push_back(
        {"gold", "curvature, global", rate, (h * h * sups.second_u + hz * hz * sups.second_v) / 8, true});
  }
  return out;
}

// What a trial of some blocks at given rates shows.
struct Trial {
  double slack = 0, projection = 0, gold = 0, arithmetic = 0;
  std::int64_t brick = -1;  // where P is largest
};

// A few large blocks at different radii, on at most two slabs: what a brick of each holds for the rest.
std::vector<std::uint8_t> trial_bricks(const Grid& grid, int granularity, int gold) {
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.cells[a] + granularity - 1) / granularity;
  std::vector<std::uint8_t> selected(at(n[0] * n[1] * n[2]), 0);
  const std::int64_t side = std::max<std::int64_t>(
      1, std::min<std::int64_t>(128, 1024 / gold) / (std::int64_t{granularity} * gold));
  for (const auto& [fx, fy, fz] :
       {std::array{0.5, 0.5, 0.5}, std::array{0.25, 0.5, 0.5}, std::array{0.5, 0.2, 0.5},
        std::array{0.72, 0.7, 0.5}, std::array{0.35, 0.35, 0.5}}) {
    const std::array<double, 3> f{fx, fy, fz};
    Index3 first{};
    for (std::size_t a = 0; a < 3; ++a)
      first[a] =
          std::clamp<std::int64_t>(static_cast<std::int64_t>(f[a] * static_cast<double>(n[a])) - side / 2, 0,
                                   std::max<std::int64_t>(0, n[a] - side));
    for (std::int64_t z = first[2]; z < std::min(n[2], first[2] + side); ++z)
      for (std::int64_t y = first[1]; y < std::min(n[1], first[1] + side); ++y)
        for (std::int64_t x = first[0]; x < std::min(n[0], first[0] + side); ++x)
          selected[at((z * n[1] + y) * n[0] + x)] = 1;
  }
  return selected;
}

// Whether the grid keeps enough of the tolerance. Cubic interpolation in u costs twice the time and hardly
// any of the tolerance: linear must not cost much more, or the volume pays for it.
bool fits(const Rates& r, const Trial& t, double epsilon) {
  if (2.5 * t.projection > (r.u_filter == "linear" ? linear_share : cubic_share) * epsilon) return false;
  return 1.1 * t.slack + 4 * t.arithmetic <= share * epsilon;
}

// What build will need at least: its node test leaves out rounding, and of the rest what gold computed in
// other blocks may differ by. That T + P is larger elsewhere than in the trial, and what samplers take, build
// finds out.
double least_needed(const Trial& t, const Volume& base) {
  double largest = 0;
  for (const float v : base.samples) largest = std::max(largest, std::abs(static_cast<double>(v)));
  return t.slack + t.arithmetic + std::min(2 * t.arithmetic, 0x1p-15 * largest);
}

Trial try_rates(opencl::State& state, GoldStream& stream, double arithmetic, const Volume& base,
                double epsilon) {
  const GoldSettings& settings = stream.settings();
  Trial t;
  t.arithmetic = arithmetic;
  const DeviceField field(state, as_mixed(base, settings.granularity));
  const auto selected = trial_bricks(settings.grid, settings.granularity, settings.rate);
  const opencl::DeviceArray<std::uint8_t> device_selected(state, std::span<const std::uint8_t>(selected),
                                                          "trial bricks");
  stream.run(
      selected,
      [&](GoldStream::Batch& batch) {
        const auto measures = batch.measure(field, static_cast<float>(epsilon), device_selected);
        const auto p = batch.largest_p();
        for (std::size_t i = 0; i < measures.size(); ++i) {
          const BrickMeasure& m = measures[i];
          if (m.total < 0) continue;
          t.slack = std::max(t.slack, static_cast<double>(m.slack));
          if (t.brick < 0 || static_cast<double>(p[i].first) > t.projection) {
            t.projection = static_cast<double>(p[i].first);
            t.brick = m.brick;
          }
          t.gold = std::max(t.gold, static_cast<double>(m.slack) - static_cast<double>(p[i].second));
        }
      },
      {}, "trial");
  return t;
}

// P node by node in the brick where its dilated form is largest.
double worst_node_bound(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                        const GoldSettings& s, std::int64_t brick) {
  if (brick < 0) return 0;
  Index3 n{}, first{}, nodes{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (s.grid.cells[a] + s.granularity - 1) / s.granularity;
  const Index3 at_brick{brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = at_brick[a] * s.granularity;
    nodes[a] = std::min<std::int64_t>(s.granularity, s.grid.cells[a] - first[a]) * s.rate + 1;
  }
  const auto p = projection_bound_at_nodes(state, upsampler, scan, s.grid, s.upsampling, s.u_filter, s.rate,
                                           first, nodes);
  return static_cast<double>(*std::max_element(p.begin(), p.end()));
}

void add_trial_bounds(std::vector<Bound>& bounds, const Rates& r, const Trial& t, double node_by_node) {
  bounds.push_back({"projection", "signed curvature, node by node, " + r.u_filter + " in u (trial)",
                    r.upsampling, node_by_node, true});
  bounds.push_back({"projection", "signed curvature, by base cell, " + r.u_filter + " in u (trial)",
                    r.upsampling, t.projection, true});
  bounds.push_back(
      {"gold", fmt::format("second differences, node by node, u {}x {} (trial)", r.upsampling, r.u_filter),
       r.gold, t.gold, true});
}

void check_tolerance(const Tolerance& tolerance) {
  if (tolerance.relative.has_value() == tolerance.absolute.has_value())
    throw InputError("give one of --epsilon and --epsilon-abs");
  const double given = tolerance.relative ? *tolerance.relative : *tolerance.absolute;
  if (!(given > 0) || !std::isfinite(given))
    throw InputError(fmt::format("a tolerance of {} must be positive and finite", given));
}

void set_epsilon(Plan& plan, const Tolerance& tolerance, double largest) {
  const double given = tolerance.relative ? *tolerance.relative : *tolerance.absolute;
  plan.epsilon = given;
  plan.epsilon_abs = given * plan.reference_range;
  if (tolerance.absolute || plan.settings.comparison.epsilon_of_max) {
    plan.epsilon_abs = tolerance.absolute ? given : given * largest;
    plan.epsilon = plan.reference_range > 0 ? plan.epsilon_abs / plan.reference_range : 0;
  }
  if (!(plan.epsilon_abs > 0))
    throw InputError(
        "the field is constant over the covered samples, so a relative tolerance means nothing; give "
        "--epsilon-abs");
}

// How much coarser than the grid the base will be.
LevelTriple coarsening_of(const Plan& plan, const Coverage& coverage, const GoldSettings& s, const Trial& t) {
  if (const auto& wanted = plan.settings.coarsening) {
    if (is_possible(*wanted, plan.grid, s.granularity, s.rate)) return *wanted;
    throw InputError(fmt::format(
        "--base {}x{}x{} must divide the granularity {} and the grid's {} x {} x {} cells, and "
        "with --gold {} be at most {}",
        1 << (*wanted)[2], 1 << (*wanted)[1], 1 << (*wanted)[0], s.granularity, plan.grid.cells[0],
        plan.grid.cells[1], plan.grid.cells[2], s.rate, (1 << largest_level) / s.rate));
  }
  if (!s.anisotropic) return {};
  const double tolerance = s.grid_only ? plan.epsilon_abs : plan.epsilon_abs - 2 * t.arithmetic;
  return choose_coarsening(plan.base, covered_in_plane(plan.grid, coverage),
                           {s.granularity, s.rate, tolerance, s.grid_only ? 0.0 : t.projection, s.midrange});
}

// The largest |F| that gold shows, between base samples too: what the paper takes its thresholds of. Cost: a
// pass of gold.
double largest_of_gold(opencl::State& state, const FilteredScan& filtered, Upsampler& upsampler,
                       const FieldSups& sups, const Grid& grid, const Rates& r) {
  GoldSettings settings{grid, fitting_granularity(4, grid), r.gold, r.upsampling, r.u_filter};
  settings.base_only = true;
  GoldStream stream(state, filtered, upsampler, sups, settings);
  float largest = 0;
  stream.run(
      stream.bricks_near_coverage(),
      [&](GoldStream::Batch& batch) { largest = std::max(largest, batch.largest_value()); }, {}, "maximum");
  return static_cast<double>(largest);
}

// All but the scan, and what is thrown, in `units`.
Plan plan_in_units(Device& device, const ProjectionSet& scan, const Units& units, const Grid& grid,
                   const FieldOptions& field, const RateOptions& rates, const Tolerance& tolerance,
                   const PlanSettings& settings, const Progress& progress) {
  ParallelGeometry used = scan.geometry;
  if (field.center) used.center = *field.center;
  opencl::State& state = device.state();
  HostMemory host(state);
  host.count(8 * static_cast<std::uint64_t>(scan.size()), "the projections, as read and filtered,");
  host.count(8 * static_cast<std::uint64_t>(grid.sample_count()), "the base samples");
  Plan plan;
  plan.notes = check_scan(used);
  plan.grid = grid;
  plan.field = field;
  plan.settings = settings;
  report(progress, "plan", 0.0);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto since = [&](auto start) { return std::chrono::duration<double>(now() - start).count(); };
  auto start = now();
  const FilteredScan filtered =
      filter_projections(state, scan, field, {}, FilterMethod::automatic, Precision::fp64, units);
  double preparation = since(start);  // that build will repeat
  Upsampler upsampler(state, filtered);
  const Coverage coverage(filtered.geometry);

  // The reference range at rates whose own error cannot matter.
  plan.base = reconstruct_field(state, filtered, upsampler, grid, 8, "cubic", {});
  check_densities(to_world(largest_magnitude(plan.base.samples), units));
  const CoveredRange range = covered_range(plan.base, coverage);
  plan.not_covered_count = range.not_covered;
  plan.not_covered_fraction =
      static_cast<double>(range.not_covered) / static_cast<double>(grid.sample_count());
  // One plane of covered samples suffices; none does not.
  if (range.not_covered == grid.sample_count() && grid.cells[2] > 1)
    throw InputError("no sample of the grid is covered by the scan; change --origin, --size or --center");
  plan.reference_range = range.high - range.low;
  const FieldSups sups = field_sups(state, upsampler, filtered);
  const auto all = candidates(rates);
  set_epsilon(plan, tolerance,
              settings.comparison.epsilon_of_max
                  ? largest_of_gold(state, filtered, upsampler, sups, grid, all.front())
                  : 0);
  report(progress, "plan", 0.3);

  plan.bounds = global_bounds(state, filtered, sups, plan.base, settings.foresee);
  report(progress, "plan", 0.6);

  // The cheapest rates whose slack leaves most of the tolerance to the grid; failing that, whatever fits at
  // all.
  const bool grid_only = settings.comparison.terms == Terms::grid;
  const auto settings_at = [&](const Rates& r) {
    GoldSettings s{grid, fitting_granularity(settings.granularity, grid), r.gold, r.upsampling, r.u_filter};
    s.midrange = settings.comparison.coefficients == Coefficients::midrange;
    s.grid_only = grid_only;
    s.anisotropic = settings.levels == "anisotropic";
    s.coarsening = plan.coarsening;
    return s;
  };
  const auto stream_at = [&](const Rates& r) {
    return GoldStream(state, filtered, upsampler, sups, settings_at(r));
  };
  std::optional<std::pair<Rates, Trial>> chosen, finest;
  for (const Rates& r : all) {
    // Node by node, P is seldom below a quarter of its global bound: skip rates that this alone rules out.
    const double step = filtered.geometry.pitch_u / r.upsampling;
    if (!grid_only && r.u_filter == "linear" && &r != &all.back() &&
        2.5 * 0.25 * step * step / 8 * sups.second_u > linear_share * plan.epsilon_abs)
      continue;
    GoldStream stream = stream_at(r);
    const double arithmetic = GoldRates::arithmetic(state, filtered, upsampler, sups, stream);
    const Trial t = try_rates(state, stream, arithmetic, plan.base, plan.epsilon_abs);
    add_trial_bounds(plan.bounds, r, t,
                     worst_node_bound(state, upsampler, filtered, stream.settings(), t.brick));
    if (!finest || t.slack < finest->second.slack) finest = {r, t};
    if (grid_only || fits(r, t, plan.epsilon_abs)) {
      chosen = {r, t};
      break;
    }
    // A finer gold costs eight times as much: put up with a larger share before that.
    const bool last_of_gold = &r == &all.back() || (&r + 1)->gold > r.gold;
    if (last_of_gold &&
        1.1 * finest->second.slack + 4 * finest->second.arithmetic <= patient_share * plan.epsilon_abs) {
      chosen = finest;
      break;
    }
    report(progress, "plan", 0.7);
  }
  const double needed = least_needed(finest->second, plan.base);
  if (!chosen && needed < plan.epsilon_abs) chosen = finest;
  if (!chosen) {
    const Trial& t = finest->second;
    throw ToleranceError(fmt::format(
        "epsilon {:.4g} is out of reach: at upsampling {} {}, gold {}, {} may err by {:.4g} and rounding by "
        "{:.4g}; the smallest that would do is about {:.4g} ({:.3g} % of the range)",
        to_world(plan.epsilon_abs, units), finest->first.upsampling, finest->first.u_filter,
        finest->first.gold, t.projection > t.gold ? "interpolating the projections" : "interpolating gold",
        to_world(t.slack, units), to_world(t.arithmetic, units), to_world(1.1 * needed, units),
        100 * 1.1 * needed / plan.reference_range));
  }
  const auto& [r, t] = *chosen;
  plan.upsampling_u = r.upsampling;
  plan.u_filter = r.u_filter;
  plan.gold_rate = r.gold;
  plan.budget.projection = {t.projection, "curvature, node-wise, on trial blocks"};
  plan.budget.gold = {t.gold, "second differences of gold on trial blocks"};
  plan.budget.arithmetic = {t.arithmetic, "rounding in fp32"};
  plan.budget.grid = {grid_only ? plan.epsilon_abs : plan.epsilon_abs - t.slack - t.arithmetic,
                      grid_only ? "all: no other term counts" : "what is left"};
  plan.gold_samples = 1;
  for (const std::int64_t cells : grid.cells)
    plan.gold_samples *= static_cast<std::uint64_t>(cells * r.gold + 1);
  if (r.upsampling != 8 || r.u_filter != "cubic")
    plan.base = reconstruct_field(state, filtered, upsampler, grid, r.upsampling, r.u_filter, {});
  report(progress, "plan", 0.8);

  plan.coarsening = coarsening_of(plan, coverage, settings_at(r), t);
  if (settings.comparison.coefficients == Coefficients::midrange) {
    start = now();
    plan.fitted = take_base(plan.base, plan.coarsening);
    fit_base_samples(state, filtered, upsampler, sups, settings_at(r), plan.fitted, {});
    preparation += since(start);
  }
  if (settings.foresee) {
    GoldRates gold(state, filtered, upsampler, sups, settings_at(r));
    const Foreseen foreseen = foresee_build(
        state, gold, plan.base, plan.fitted.empty() ? take_base(plan.base, plan.coarsening) : plan.fitted,
        plan.epsilon_abs - t.arithmetic);
    plan.samples_ratio = foreseen.samples_ratio;
    start = now();
    probe_sampler(device);  // as build will
    plan.seconds = preparation + foreseen.seconds + since(start);
    // What the trial took, the scan and the base samples twice included; the base samples once more, the
    // stored field on the device, and the tiles before and after closing.
    plan.memory_bytes = state.memory.peak() + 3 * foreseen.tile_bytes + 4 * plan.base.samples.size();
  }
  report(progress, "plan", 1.0);
  return plan;
}

}  // namespace

Plan make_plan(Device& device, const ProjectionSet& scan, const Grid& grid, const FieldOptions& field,
               const RateOptions& rates, const Tolerance& tolerance, const PlanSettings& settings,
               const Progress& progress) {
  check_rates(rates);
  check_tolerance(tolerance);
  check_line_integrals(scan);
  if (tolerance.relative && largest_magnitude(scan.data) == 0)
    throw InputError(
        "every line integral is 0 in float32, so a relative tolerance means nothing; scale them, or give "
        "--epsilon-abs");
  const Units units = units_of(scan);
  Tolerance wanted = tolerance;
  if (wanted.absolute) wanted.absolute = from_world(*wanted.absolute, units);
  Plan plan = to_world(
      plan_in_units(device, scan, units, from_world(grid, units), field, rates, wanted, settings, progress),
      units);
  plan.grid = plan.base.grid = grid;
  return plan;
}

}  // namespace vdvr
