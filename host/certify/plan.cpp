// Bounds side by side; rates, tolerance, base and what a build will take (docs/error-bounds.md).
#include "vdvr/expert/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/bounds/amplitude_bounds.hpp"
#include "host/certify/bounds/paper_bounds.hpp"
#include "host/certify/choose_coarsening.hpp"
#include "host/certify/choose_rates.hpp"
#include "host/certify/forecaster.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/prepared_scan.hpp"
#include "host/certify/kept/base_of_gold.hpp"
#include "host/certify/plan_parts.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/reconstruct_cone.hpp"
#include "host/scan/row_window.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/covered_range.hpp"
#include "host/volume/sampler/sampler_terms.hpp"
#include "host/volume/validate_volume.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
const std::vector<int> bound_rates{1, 2, 4, 8, 16, 32};

void check_granularity(int granularity) {
  if (granularity < 1 || granularity > 8 || !std::has_single_bit(static_cast<unsigned>(granularity)))
    throw InputError(fmt::format("granularity {} must be 1, 2, 4 or 8", granularity));
}

// Global bounds at every rate, the paper's beside ours.
std::vector<Bound> global_bounds(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                                 const Volume& base, bool with_paper, bool estimate) {
  const Grid& grid = base.grid;
  std::vector<Bound> out;
  const ParallelGeometry& g = scan.geometry;
  // Each view costs rows * columns * (rows + columns) multiply-adds: beyond this the table would take half a
  // minute.
  const double amplitude_cost =
      static_cast<double>(g.views() * g.rows * g.columns) * static_cast<double>(g.rows + g.columns);
  const std::int64_t step =
      estimate ? std::max<std::int64_t>(1, g.views() / PreparedScan::estimate_views) : 1;
  if (amplitude_cost < 4e9 * static_cast<double>(step)) {
    const AmplitudeBounds a = amplitude_bounds(scan, grid, bound_rates, step);
    for (const auto& [rate, value] : a.projection)
      out.push_back({"projection", "amplitude, linear in u", rate, value, true});
    for (const auto& [rate, value] : a.gold) out.push_back({"gold", "amplitude", rate, value, true});
  }
  const auto append = [&](const std::vector<Bound>& more) {
    out.insert(out.end(), more.begin(), more.end());
  };
  if (with_paper && 10 * static_cast<double>(g.views() * g.rows * g.columns) *
                            static_cast<double>(std::max(g.rows, g.columns)) <
                        4e10 * static_cast<double>(step))
    append(paper_projection_bounds(state, scan, bound_rates, step));
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

void check_tolerance(const Tolerance& tolerance) {
  if (tolerance.relative.has_value() == tolerance.absolute.has_value())
    throw InputError("give one of `epsilon` and `epsilon_abs`");
  const double given = tolerance.relative ? *tolerance.relative : *tolerance.absolute;
  if (!(given > 0) || !std::isfinite(given))
    throw InputError(fmt::format("a tolerance of {} must be positive and finite", given));
}

void set_epsilon(Plan& plan, const Tolerance& tolerance, double largest) {
  const bool of_max = plan.settings.comparison.epsilon_of_max;
  plan.epsilon_abs = tolerance.as_density(of_max ? largest : plan.reference_range);
  if (tolerance.relative && !of_max) plan.epsilon = *tolerance.relative;
  else plan.epsilon = plan.reference_range > 0 ? plan.epsilon_abs / plan.reference_range : 0;
  if (!(plan.epsilon_abs > 0))
    throw InputError(
        "the field is constant over the covered samples, so a relative tolerance means nothing; give "
        "`epsilon_abs`");
}

// How much coarser than the grid the base will be.
LevelTriple coarsening_of(const Plan& plan, const Coverage& coverage, const GoldSettings& s, const Trial& t) {
  if (const auto& wanted = plan.settings.coarsening) {
    if (is_possible(*wanted, plan.grid, s.granularity, s.rate)) return *wanted;
    throw InputError(fmt::format(
        "`base` {}x{}x{} must divide the granularity {} and the grid's {} x {} x {} cells, and "
        "with `gold` {} be at most {}",
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
double largest_of_gold(opencl::State& state, const FilteredScan& filtered, const FieldSups& sups,
                       const Grid& grid, const Rates& r) {
  GoldSettings settings = gold_settings(grid, fitting_granularity(4, grid), r);
  settings.base_only = true;
  GoldStream stream(state, filtered, sups, settings);
  float largest = 0;
  stream.run(
      stream.bricks_near_coverage(),
      [&](GoldStream::Batch& batch) { largest = std::max(largest, batch.largest_value()); }, {}, "maximum");
  return static_cast<double>(largest);
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// One plan, step by step. All but the scan, and what is thrown, in its units.
class Planner {
 public:
  Planner(Device& device, const ScanInUnits& from, const Grid& grid, const FieldOptions& field,
          const PlanSettings& settings, const Progress& progress)
      : device_(device), state_(device.state()), units_(from.units), progress_(progress), host_(state_) {
    const ProjectionSet& scan = from.scan;
    scan_bytes_ = scan.data.resident_bytes();
    host_.count(scan_bytes_, "the projections, as read,");
    host_.count(8 * static_cast<std::uint64_t>(grid.sample_count()), "the base samples");
    ProjectionSet used;
    used.geometry = scan.geometry;
    used.cone = scan.cone;
    if (!scan.cone) used.geometry.center = center_of(field, scan.geometry);
    plan_.notes = check_scan(used);
    plan_.grid = grid;
    plan_.field = field;
    plan_.settings = settings;
    plan_.layout = {fitting_granularity(settings.granularity, grid), {}, settings.levels};
    report(progress_, "plan", 0.0);
    preparation_ = seconds_of([&] {
      prepared_ = std::make_shared<PreparedScan>(state_, from, field, sups_wanted(scan), Progress{});
    });
    coverage_.emplace(prepared_->filtered.geometry, prepared_->filtered.views);
  }

  Plan make(const RateOptions& wanted, const Tolerance& tolerance) {
    std::vector<Rates> all = candidates(wanted, is_cone());
    if (!is_cone()) reconstruct_reference();
    else if (estimates_base()) estimate_reference();
    else take_reference(all.front());
    look_at_reference();
    set_epsilon(plan_, tolerance,
                plan_.settings.comparison.epsilon_of_max
                    ? largest_of_gold(state_, prepared_->filtered, prepared_->sups, plan_.grid, all.front())
                    : 0);
    take_tolerances();
    sample_columns();
    if (is_cone()) take_differences(all);
    report(progress_, "plan", 0.3);
    // They are made of derivatives along the axes of parallel beam.
    if (!is_cone())
      plan_.bounds = global_bounds(state_, prepared_->filtered, prepared_->sups, plan_.base,
                                   plan_.settings.forecast, estimates_views_);
    report(progress_, "plan", 0.6);
    const Chosen chosen = choose(all);
    take(chosen);
    report(progress_, "plan", 0.8);
    lay_out_base(chosen.trial);
    if (plan_.settings.forecast) forecast(chosen.trial);
    report(progress_, "plan", 1.0);
    plan_.prepared = prepared_;
    if (estimates_views_) {
      plan_.estimated = true;
      plan_.notes.push_back(fmt::format("bounds estimated from {} of {} views", PreparedScan::estimate_views,
                                        prepared_->filtered.geometry.views()));
    }
    return std::move(plan_);
  }

 private:
  // Derivatives bound what other interpolations in u would do: worth their cost in small scans, and of some
  // views.
  [[nodiscard]] PreparedScan::Sups sups_wanted(const ProjectionSet& scan) {
    const bool large = cost_of_sups(scan.geometry) > 2e10;
    estimates_views_ = large && plan_.settings.estimate;
    if (estimates_views_) return PreparedScan::Sups::estimated;
    const bool small_or_paper = !large || plan_.settings.comparison.terms == Terms::grid;
    return small_or_paper ? PreparedScan::Sups::of_derivatives : PreparedScan::Sups::of_values;
  }

  // What trials and forecasts look at: kept from the first trial on, all at once.
  const std::vector<std::uint8_t>& look(GoldRates& gold) {
    if (looked_at_.empty()) {
      looked_at_ = gold.fine().bricks_near_coverage();
      if (plan_.settings.forecast) {
        GoldStream& first = gold.coarse() ? *gold.coarse() : gold.fine();
        looked_at_ = sampled_ ? sampled_->of(std::move(looked_at_))
                              : bricks_to_look_at(first, prepared_->filtered.geometry);
        gold.fine().prepare(looked_at_, GoldStream::For::samples, {});
      }
    }
    return looked_at_;
  }

  // The reference range and the coverage, at rates whose own error cannot matter.
  void reconstruct_reference() {
    // Estimates do with four taps on columns at 4x, which are off by a hundredth of what is at the detector's
    // finest: half of the columns are half of the cache lines.
    plan_.base = estimates_views_ ? reconstruct_field(state_, prepared_->filtered, prepared_->upsampler,
                                                      plan_.grid, 4, Interpolation::cubic, {})
                                  : reconstruct_field(state_, prepared_->filtered, prepared_->upsampler,
                                                      plan_.grid, 8, Interpolation::six_taps, {});
  }

  // Of cone beam from gold, which is kept whole.
  void take_reference(const Rates& r) {
    plan_.base = base_of_gold(state_, source_at(r)->kept, *coverage_, plan_.grid, kept_margin(plan_.grid, 1),
                              progress_);
  }

  // Of estimates from linear interpolation at 4x: gold is then kept for what is looked at, not for all.
  void estimate_reference() {
    WholeVolume whole(plan_.grid);
    StageWatch watch(nullptr);
    back_project_views(state_, prepared_->filtered, plan_.grid, 4, 2, whole.planes(), progress_, watch);
    plan_.base = whole.take();
    plan_.estimated = true;
    plan_.notes.emplace_back(
        "estimated: the range from samples of linear interpolation at 4x, the bounds and what is foreseen "
        "from columns of the grid");
  }

  void sample_columns() {
    if (!estimates_base()) return;
    const int g = plan_.layout.granularity;
    sampled_.emplace(plan_.base, bricks_near(*coverage_, plan_.grid, g), g, plan_.epsilon_abs);
    if (!sampled_->is_worth_it()) sampled_.reset();
  }

  // Fourth differences at half the density, of an eighth of the nodes, where what sixth derivatives then add
  // to T is a few hundredths of the tolerance: volumes store some .3 % more then.
  void take_differences(std::vector<Rates>& all) {
    constexpr double most_of_tolerance = 0.06;
    Rates sparse = all.front();
    sparse.differences = sparse_differences;
    GoldSource& source = *source_at(sparse);
    const GoldLattice gold = source.kept.lattice(plan_.grid, sparse.gold);
    if (source.remainder->largest_of_sixth(gold) > most_of_tolerance * plan_.epsilon_abs) return;
    for (Rates& r : all) r.differences = sparse_differences;
  }

  void look_at_reference() {
    check_densities(largest_magnitude(plan_.base.samples), units_);
    const CoveredRange range = covered_range(plan_.base, *coverage_);
    plan_.not_covered_count = range.not_covered;
    plan_.not_covered_fraction =
        static_cast<double>(range.not_covered) / static_cast<double>(plan_.grid.sample_count());
    // One plane of covered samples suffices; none does not, but where all that is covered lies between two.
    if (range.not_covered == plan_.grid.sample_count() &&
        (plan_.grid.cells[2] > 1 || !is_seen_between_samples()))
      throw InputError("no sample of the grid is covered by the scan; change `origin`, `size` or `center`");
    plan_.reference_range = range.high - range.low;
    if (range.not_covered < plan_.grid.sample_count())
      plan_.range_at = {plan_.base.grid.position(range.low_at), plan_.base.grid.position(range.high_at)};
  }

  // Of one layer of cells, as of a single row.
  [[nodiscard]] bool is_seen_between_samples() const {
    const double low = plan_.grid.position({0, 0, 0})[2], high = plan_.grid.position({0, 0, 1})[2];
    const std::vector<std::uint8_t> inside = covered_in_plane(plan_.grid, *coverage_);
    return low <= coverage_->heights().second && high >= coverage_->heights().first &&
           std::ranges::any_of(inside, [](std::uint8_t seen) { return seen != 0; });
  }

  // In units of the plan's own, the smallest.
  void take_tolerances() {
    by_brick_ = std::exchange(plan_.settings.by_brick, {});
    const std::int64_t bricks = Bricks(plan_.grid, plan_.layout.granularity).size();
    const auto smallest = static_cast<float>(to_world(plan_.epsilon_abs, units_));
    if (!by_brick_.empty() && std::ssize(by_brick_) != bricks)
      throw InputError(fmt::format("`by_brick` has {} tolerances for {} bricks", by_brick_.size(), bricks));
    for (float& one : by_brick_) {
      if (!(one >= smallest * (1 - 0x1p-20f)))
        throw InputError(fmt::format("a tolerance of {} of a brick lies below the plan's {}", one, smallest));
      one /= smallest;
    }
  }

  [[nodiscard]] bool is_cone() const { return !prepared_->filtered.views.empty(); }
  [[nodiscard]] bool estimates_base() const {
    return is_cone() && plan_.settings.estimate && plan_.settings.forecast;
  }
  [[nodiscard]] bool grid_only() const { return plan_.settings.comparison.terms == Terms::grid; }
  [[nodiscard]] GoldSettings settings_at(const Rates& r) const {
    GoldSettings settings = gold_settings(plan_, r, is_cone());
    settings.of_noise = !by_brick_.empty();
    if (sampled_) settings.part = sampled_->part();
    return settings;
  }

  std::shared_ptr<GoldSource> source_at(const Rates& r) { return prepared_->source(settings_at(r)); }

  Trial try_out(const Rates& r) {
    GoldRates gold(state_, prepared_->filtered, prepared_->sups, settings_at(r), source_at(r));
    const Trial t = try_rates(state_, gold, plan_.base, plan_.epsilon_abs, by_brick_, look(gold));
    add_trial_bounds(plan_.bounds, r, t);
    return t;
  }

  Chosen choose(const std::vector<Rates>& all) {
    return choose_rates(
        all, [&](const Rates& r) { return try_out(r); },
        {plan_.epsilon_abs, plan_.reference_range, grid_only(), &plan_.base, units_}, progress_);
  }

  // Notes the rates with their shares of the tolerance; the base samples are those that gold of them has.
  void take(const Chosen& chosen) {
    const auto& [r, t] = chosen;
    plan_.rates = r;
    plan_.budget.projection = {t.projection, "sups: interpolation in u and between kept gold"};
    plan_.budget.gold = {t.gold, "second differences of gold on trial blocks"};
    plan_.budget.arithmetic = {t.arithmetic, "rounding in fp32"};
    plan_.budget.grid = {grid_only() ? plan_.epsilon_abs : plan_.epsilon_abs - t.slack - t.arithmetic,
                         grid_only() ? "all: no other term counts" : "what is left"};
    plan_.gold_samples = 1;
    for (const std::int64_t cells : plan_.grid.cells)
      plan_.gold_samples *= static_cast<std::uint64_t>(cells * r.gold + 1);
    if (!is_cone() && !estimates_views_ && (r.upsampling != 8 || r.interpolation != Interpolation::six_taps))
      plan_.base = reconstruct_field(state_, prepared_->filtered, prepared_->upsampler, plan_.grid,
                                     r.upsampling, r.interpolation, {});
  }

  // How coarse the base is.
  void lay_out_base(const Trial& t) {
    plan_.layout.coarsening = coarsening_of(plan_, *coverage_, settings_at(plan_.rates), t);
  }

  // What every brick is brought within at first.
  [[nodiscard]] double everywhere() const {
    const auto& wanted = plan_.settings.everywhere;
    return wanted ? from_world(*wanted, units_).as_density(plan_.whole()) : plan_.epsilon_abs;
  }

  // Storage, memory and time.
  void forecast(const Trial& t) {
    GoldRates gold(state_, prepared_->filtered, prepared_->sups, settings_at(plan_.rates),
                   source_at(plan_.rates));
    const std::vector<std::uint8_t>& looked_at = look(gold);
    std::vector<float> stored = take_base(plan_.base, plan_.layout.coarsening);
    const auto size = [](const std::vector<std::uint8_t>& bricks) {
      return static_cast<double>(std::count(bricks.begin(), bricks.end(), 1));
    };
    // What gold takes that is kept is foreseen by itself.
    const KeptGold& kept = gold.fine().source()->kept;
    const double before = kept.prepare_seconds();
    const double with_gold = seconds_of([&] {
      if (plan_.settings.comparison.coefficients == Coefficients::midrange)
        fit_base_samples(state_, prepared_->filtered, prepared_->sups, settings_at(plan_.rates), looked_at,
                         stored, {}, source_at(plan_.rates));
    });
    const double fitting = std::max(0.0, with_gold - (kept.prepare_seconds() - before)),
                 all = size(gold.fine().bricks_near_coverage());
    plan_.forecaster = std::make_shared<Forecaster>(prepared_, settings_at(plan_.rates), plan_.base,
                                                    std::move(stored), looked_at);
    const BuildForecast build = plan_.forecaster->forecast(to_world(everywhere() - t.arithmetic, units_));
    plan_.samples_ratio = build.samples_ratio;
    const double probing = seconds_of([&] { probe_filters(device_); });  // as build will
    plan_.seconds_of_rows = preparation_ + build.kept_seconds;
    plan_.seconds = preparation_ + fitting * all / std::max(1.0, size(looked_at)) + build.seconds + probing;
    forecast_memory(build, kept);
  }

  // Gold that is kept; the base samples, fitted, rounded and on the device; tiles before and after closing
  // and on the device; the scan as read and filtered; and what the trial took beside these, batches of
  // blocks.
  void forecast_memory(const BuildForecast& build, const KeptGold& kept) {
    const std::uint64_t base = 4 * plan_.base.samples.size(),
                        scan = scan_bytes_ + prepared_->filtered.samples.resident_bytes(),
                        held = scan + 2 * base + kept.bytes(), peak = state_.memory.peak();
    plan_.memory_of_rows = kept.bytes() + build.kept_bytes;
    plan_.memory_of_cells = 3 * base;
    plan_.tile_bytes = build.tile_bytes;
    plan_.memory_bytes = scan + plan_.memory_of_rows + plan_.memory_of_cells +
                         memory_of_tiles(plan_.tile_bytes, state_.memory.limit(), state_.info.is_gpu) +
                         (peak > held ? peak - held : 0);
  }

  Device& device_;
  opencl::State& state_;
  Units units_;
  const Progress& progress_;
  HostMemory host_;
  Plan plan_;
  std::shared_ptr<PreparedScan> prepared_;
  std::optional<Coverage> coverage_;
  std::uint64_t scan_bytes_ = 0;  // as read
  double preparation_ = 0;        // seconds that build will take again
  std::vector<float> by_brick_;
  std::vector<std::uint8_t> looked_at_;
  std::optional<SampledColumns> sampled_;  // of estimates of cone beam
  bool estimates_views_ = false;
};

// A scan of more samples is judged from a window of its rows.
constexpr std::int64_t most_samples_planned = std::int64_t{8} << 20;

// The plan of a window of rows, for the whole scan.
Plan of_all_rows(Plan plan, const RowWindow& window, const ProjectionSet& scan, const Grid& grid,
                 std::uint64_t limit, bool on_gpu) {
  const ParallelGeometry& g = scan.geometry;
  plan.estimated = true;
  plan.prepared = nullptr;
  plan.forecaster = nullptr;
  plan.notes.push_back(
      fmt::format("estimated from the rows {} to {} of {}: the range, the bounds and what is foreseen may "
                  "differ in other rows",
                  window.first, window.first + window.rows - 1, g.rows));
  // What is filtered and kept grows with the rows, what is tested with the grid's height.
  const double all_rows = static_cast<double>(g.rows) / static_cast<double>(window.rows),
               all_cells = static_cast<double>(grid.cells[2]) / static_cast<double>(window.grid.cells[2]);
  plan.seconds = plan.seconds_of_rows * all_rows + (plan.seconds - plan.seconds_of_rows) * all_cells;
  plan.seconds_of_rows *= all_rows;
  const bool kept_in_scratch = scan.data.scratch() && !on_gpu;
  const auto of_tiles = [&] { return memory_of_tiles(plan.tile_bytes, limit, on_gpu); };
  plan.memory_bytes -= plan.memory_of_rows + plan.memory_of_cells + of_tiles();
  plan.memory_of_rows =
      kept_in_scratch ? 0 : static_cast<std::uint64_t>(static_cast<double>(plan.memory_of_rows) * all_rows);
  plan.memory_of_cells = static_cast<std::uint64_t>(static_cast<double>(plan.memory_of_cells) * all_cells);
  plan.tile_bytes = static_cast<std::uint64_t>(static_cast<double>(plan.tile_bytes) * all_cells);
  plan.memory_bytes +=
      plan.memory_of_rows + plan.memory_of_cells + of_tiles() + 2 * scan.data.resident_bytes();
  plan.grid = grid;
  plan.gold_samples = 1;
  for (const std::int64_t cells : grid.cells)
    plan.gold_samples *= static_cast<std::uint64_t>(cells * plan.rates.gold + 1);
  ParallelGeometry used = g;
  used.center = center_of(plan.field, g);
  plan.not_covered_count = count_not_covered(grid, Coverage(used));
  plan.not_covered_fraction =
      static_cast<double>(plan.not_covered_count) / static_cast<double>(grid.sample_count());
  return plan;
}

}  // namespace

Plan make_plan(Device& device, const ProjectionSet& scan, const Grid& grid, const FieldOptions& field,
               const RateOptions& rates, const Tolerance& tolerance, const PlanSettings& settings,
               const Progress& progress) {
  if (settings.estimate && !scan.cone)
    if (const auto window = row_window(scan, grid, most_samples_planned))
      return of_all_rows(
          make_plan(device, window->scan, window->grid, field, rates, tolerance, settings, progress), *window,
          scan, grid, device.state().memory.limit(), device.info().is_gpu);
  check_rates(rates);
  check_granularity(settings.granularity);
  check_tolerance(tolerance);
  const ScanInUnits from(scan);
  if (tolerance.relative && from.largest == 0)
    throw InputError(
        "every line integral is 0 in float32, so a relative tolerance means nothing; scale them, or give "
        "`epsilon_abs`");
  const Units& units = from.units;
  Plan plan = to_world(Planner(device, from, from_world(grid, units), field, settings, progress)
                           .make(rates, from_world(tolerance, units)),
                       units);
  plan.grid = plan.base.grid = grid;
  return plan;
}

}  // namespace vdvr
