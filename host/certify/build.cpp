// Builds the certified volume: classify, extract, close, pack, then measure the packed field and repair until
// it holds (docs/error-bounds.md). Calls gold_stream.cpp and close_boundaries.cpp.
#include "vdvr/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "host/bounds/covered_range.hpp"
#include "host/certify/brick_refinement.hpp"
#include "host/certify/build_journal.hpp"
#include "host/certify/choose_coarsening.hpp"
#include "host/certify/classify_bricks.hpp"
#include "host/certify/close_boundaries.hpp"
#include "host/gold/prepared_scan.hpp"
#include "host/certify/raise_levels.hpp"
#include "host/bounds/result_units.hpp"
#include "host/fbp/reconstruct.hpp"
#include "host/gold/gold_batch.hpp"
#include "host/gold/worst_node.hpp"
#include "host/opencl/host_memory.hpp"
#include "host/sampler/sampler_terms.hpp"
#include "host/system/casts.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"
#include "vdvr/region_of_interest.hpp"

namespace vdvr {
namespace {

// Of scratch, where the device has no limit.
constexpr std::uint64_t least_resident = std::uint64_t{64} << 20;

class Stopwatch {
 public:
  explicit Stopwatch(std::map<std::string, double>& seconds) : seconds_(seconds) {}
  void lap(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[stage] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::map<std::string, double>& seconds_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Where bricks of the region read it, the base that suits the trilinear filter best; elsewhere F. The plan
// gives its samples away.
std::vector<float> fitted_base(opencl::State& state, PreparedScan& from, Plan& plan,
                               const GoldSettings& settings, const std::vector<std::uint8_t>& selected,
                               const Progress& progress) {
  std::vector<float> base = take_base(std::exchange(plan.base, {}), plan.layout.coarsening);
  if (plan.settings.comparison.coefficients == Coefficients::midrange)
    fit_base_samples(state, from.filtered, from.sups, settings, selected, base, progress,
                     from.source(settings));
  return base;
}

// Of integer samples.
Lattice lattice_of(const std::vector<float>& base, const Plan& plan, const Units& units,
                   StorageChoice storage) {
  return choose_lattice(base, storage,
                        most_rounding(plan.epsilon_abs, plan.layout.levels == Levels::anisotropic),
                        units.density());
}

// What every step of a build reads. All but the scan, and what is thrown, in `units`.
struct Inputs {
  opencl::State& state;
  const Units& units;
  const Plan& plan;
  const std::vector<std::uint8_t>& selected;  // by brick: in the region of interest
  JournalledRates& gold;
  double arithmetic = 0;  // fp32 error bound of any gold sample
  const Room& room;       // for what is made of the bricks
  const Progress& progress;
  Stopwatch& watch;
};

Room room_for(const opencl::State& state, const ProjectionSet& scan, const BuildOptions& options) {
  const std::uint64_t share = state.memory.limit() / 8;
  if (share == 0 && !options.in_memory_bytes) return {};
  Room room{scan.data.scratch(), options.in_memory_bytes.value_or(share)};
  if (!room.scratch)
    room.scratch =
        std::make_shared<Scratch>(options.scratch.empty() ? default_scratch_folder() : options.scratch,
                                  std::max(share, least_resident));
  return room;
}

// A closed and packed volume that was measured, node by node, to be within a tolerance.
struct Measured {
  MixedVolume volume;
  std::vector<BrickMeasure> bricks;
  ClassifyBricks::Bounds slack;
  std::int64_t repaired = 0;  // bricks that closing raised
};

GoldSettings gold_settings(const Plan& plan, const BuildOptions& options, const Lattice& lattice, bool cone) {
  const Comparison& comparison = plan.settings.comparison;
  GoldSettings settings{plan.grid,
                        plan.layout.granularity,
                        plan.rates.gold,
                        plan.rates.upsampling,
                        plan.rates.interpolation,
                        options.window};
  settings.midrange = comparison.coefficients != Coefficients::sampled;
  settings.anisotropic = plan.layout.levels == Levels::anisotropic && comparison.closing != Closing::paper;
  settings.grid_only = comparison.terms == Terms::grid;
  settings.coarsening = plan.layout.coarsening;
  settings.lattice = lattice;
  if (cone) settings.least_reach = reach_of_all(settings);
  return settings;
}

OpenBricks open_bricks(const Plan& plan, const std::vector<float>& base, const Lattice& lattice,
                       const Room& room) {
  OpenBricks bricks;
  bricks.grid = plan.grid;
  bricks.granularity = plan.layout.granularity;
  bricks.rate = plan.rates.gold;
  bricks.coarsening = plan.layout.coarsening;
  bricks.sampled = plan.settings.comparison.coefficients == Coefficients::sampled;
  bricks.base = base;
  round_base(bricks.base, lattice);
  bricks.lattice = lattice;
  const auto count = at(Bricks(plan.grid, plan.layout.granularity).size());
  bricks.level.assign(count, LevelTriple{0, 0, 0});
  bricks.involved.assign(count, 0);
  bricks.samples = TileStore(room);
  bricks.samples.resize(count);
  return bricks;
}

// What a bound holds beside what is measured at nodes: arithmetic and the device's samplers.
double beside_nodes(const Inputs& in, const SamplerTerms& sampler) {
  if (in.plan.settings.comparison.terms == Terms::grid) return 0;
  return in.arithmetic + std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
}

// The largest |V - gold| + T + P that leaves room for these.
double node_tolerance(const Inputs& in, double epsilon_abs, const SamplerTerms& sampler) {
  const double tolerance = epsilon_abs - beside_nodes(in, sampler);
  if (tolerance > 0) return tolerance;
  throw ToleranceError(fmt::format("epsilon {:.4g} is out of reach: rounding and samplers alone take {:.4g}",
                                   to_world(epsilon_abs, in.units),
                                   to_world(epsilon_abs - tolerance, in.units)));
}

[[noreturn]] void refuse_slack(const Inputs& in, const ClassifyBricks::Bounds& bounds, float slack,
                               double tolerance) {
  const bool projection = bounds.projection > bounds.gold;
  const double more = static_cast<double>(slack) - tolerance;
  throw ToleranceError(
      fmt::format("epsilon {:.4g} is out of reach at these rates: interpolating {} alone may err by {:.4g} "
                  "of the {:.4g} left for it; raise {} or allow at least {:.4g}",
                  to_world(in.plan.epsilon_abs, in.units), projection ? "the projections" : "gold",
                  to_world(static_cast<double>(slack), in.units), to_world(tolerance, in.units),
                  projection ? "`upsampling`, or take `u_filter` six-taps," : "`gold`",
                  to_world(in.plan.epsilon_abs + 1.1 * more, in.units)));
}

// At the gold rate V is gold, but for the rounding of what is stored and of gold computed in other blocks.
[[noreturn]] void refuse_stored(const Inputs& in, const Lattice& lattice, float total, double tolerance) {
  const std::string found = fmt::format(
      "epsilon {:.4g} is out of reach: a brick at the gold rate may err by {:.4g} of the {:.4g} "
      "left for it, ",
      to_world(in.plan.epsilon_abs, in.units), to_world(static_cast<double>(total), in.units),
      to_world(tolerance, in.units));
  if (lattice.step > 0)
    throw ToleranceError(found + fmt::format("where integer samples round by up to {:.4g}; `storage` auto or "
                                             "f32 may do",
                                             to_world(0.5 * lattice.step, in.units)));
  const double more = static_cast<double>(total) - tolerance;
  throw ToleranceError(found +
                       fmt::format("where rounding in fp32 moved gold; raise `gold` or allow at least {:.4g}",
                                   to_world(in.plan.epsilon_abs + 1.1 * more, in.units)));
}

void classify(const Inputs& in, ClassifyBricks& test, const OpenBricks& bricks, NodeTolerance tolerance) {
  // Gold computed in two blocks differs by rounding; a brick at the gold rate must pass all the same. The
  // bound on rounding lies far above what is ever seen, and here nothing is promised: verification decides.
  double largest = 0;
  for (const float v : bricks.base) largest = std::max(largest, std::fabs(static_cast<double>(v)));
  const double less = std::min(2 * in.arithmetic, 0x1p-15 * largest);
  tolerance.of_all -= less;
  for (float& one : tolerance.by_brick) one -= static_cast<float>(less);
  // Those that may hold a tested node.
  std::vector<std::uint8_t> near = in.gold.fine.gold().bricks_near_coverage();
  for (std::size_t i = 0; i < near.size(); ++i) near[i] = near[i] && in.selected[i];
  const DeviceField base(in.state, as_mixed(bricks.base, in.gold.fine.gold().settings()));
  test.classify(base, tolerance, near);
  in.watch.lap("classify");
}

// Levels only rise. A brick that was found over the tolerance stays so until it changes: what was raised
// for it can have been a neighbour whose samples round to what they were.
std::vector<std::uint8_t> raise_violating(const Inputs& in, const ClassifyBricks& test, OpenBricks& bricks,
                                          const NodeTolerance& tolerances) {
  const std::vector<BrickMeasure>& measures = test.measures();
  const bool anisotropic = in.gold.fine.gold().settings().anisotropic;
  std::vector<LevelTriple> to = bricks.level;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const BrickMeasure& m = measures[i];
    if (!bricks.involved[i] || m.violated == 0) continue;
    const double tolerance = tolerances.of(i);
    // Of a brick that coarse gold proposed a level for.
    if (!(static_cast<double>(m.slack) <= tolerance)) refuse_slack(in, test.bounds(), m.slack, tolerance);
    if (!raise_levels(bricks, static_cast<std::int64_t>(i), m.violated,
                      anisotropic ? &test.along()[i] : nullptr, to))
      refuse_stored(in, bricks.lattice, m.total, tolerance);
  }
  std::vector<std::uint8_t> raised(bricks.level.size(), 0);
  for (std::size_t i = 0; i < raised.size(); ++i) raised[i] = to[i] != bricks.level[i];
  bricks.level = std::move(to);
  return raised;
}

// Of what lies in memory.
std::uint64_t memory_bytes(const SampleBlock& block) {
  const bool in_scratch = block.f32.scratch() || block.u16.scratch() || block.u8.scratch();
  return in_scratch ? 0 : block.bytes();
}
std::uint64_t memory_bytes(const MixedVolume& volume) {
  std::uint64_t bytes = memory_bytes(volume.base);
  for (const auto& [kind, block] : volume.tiles) bytes += memory_bytes(block);
  return bytes;
}

// Whether a measured volume will do; else the smaller tolerance that it is brought within.
using Accept = std::function<std::optional<NodeTolerance>(const Measured&)>;

// Those that a smaller tolerance may ask more of than the one they were measured with.
std::vector<std::uint8_t> bricks_above(const std::vector<BrickMeasure>& measures,
                                       const NodeTolerance& tolerance) {
  std::vector<std::uint8_t> above(measures.size(), 0);
  for (std::size_t i = 0; i < above.size(); ++i)
    above[i] = !(static_cast<double>(measures[i].total) <= tolerance.of(i));
  return above;
}

// Closes, packs, measures; raises bricks until every node is within the tolerance, and the volume accepted.
Measured close_and_measure(const Inputs& in, ClassifyBricks& test, OpenBricks& bricks,
                           NodeTolerance tolerance, const Accept& accept) {
  // Bricks that stay at level 0 were measured on the base samples while classifying, and closing does not
  // change those.
  std::vector<std::uint8_t> pending(bricks.level.size());
  Measured out;
  MixedVolume before;
  HostMemory closed(in.state);
  std::uint64_t closed_bytes = 0;
  CloseBoundaries close(bricks, in.plan.settings.comparison.closing, in.room);
  std::vector<std::uint8_t> raised;
  for (int round = 0;; ++round) {
    MixedVolume volume = round > 0 ? close.again(before, raised) : close.first();
    // Where integers round, a raised brick can change more than those it touches.
    const std::vector<std::uint8_t> changed = round > 0 ? changed_bricks(before, volume, close.made())
                                                        : std::vector<std::uint8_t>(pending.size(), 1);
    for (std::size_t i = 0; i < pending.size(); ++i)
      pending[i] = bricks.involved[i] && changed[i] && (round > 0 || volume.level[i] != LevelTriple{0, 0, 0});
    before = {};  // only a repair compares with it
    closed.uncount(std::exchange(closed_bytes, 0));
    closed.count(memory_bytes(volume), "the closed volume");
    closed_bytes = memory_bytes(volume);
    in.watch.lap("close");
    const DeviceField field(in.state, volume, in.room.for_bytes(sample_buffer_bytes(volume)));
    test.measure(field, volume.level, tolerance, pending, round == 0 ? "verify" : "repair");
    in.watch.lap("verify");
    for (;;) {
      raised = raise_violating(in, test, bricks, tolerance);
      out.repaired += std::count(raised.begin(), raised.end(), 1);
      if (std::find(raised.begin(), raised.end(), 1) != raised.end()) break;
      test.sharpen(field, tolerance);
      in.watch.lap("verify");
      out.volume = std::move(volume);
      out.bricks = test.measures();
      out.slack = test.bounds();
      std::optional<NodeTolerance> smaller = accept(out);
      if (!smaller) return out;
      volume = std::move(out.volume);
      tolerance = std::move(*smaller);
      test.measure(field, volume.level, tolerance, bricks_above(test.measures(), tolerance), "repair");
      in.watch.lap("verify");
    }
    test.extract(raised);
    in.watch.lap("repair");
    before = std::move(volume);
  }
}

// The volume of these base samples within the tolerance.
Measured measured_volume(const Inputs& in, const std::vector<float>& base, const Lattice& lattice,
                         const NodeTolerance& tolerance, const Accept& accept) {
  HostMemory tiles(in.state);
  tiles.count(4 * base.size(), "the base samples, rounded,");
  OpenBricks bricks = open_bricks(in.plan, base, lattice, in.room);
  std::optional<ClassifyBricks> test;
  test.emplace(in.state, in.gold, bricks, tiles, in.progress,
               [&](float slack, double strict) { refuse_slack(in, test->bounds(), slack, strict); });
  classify(in, *test, bricks, tolerance);
  return close_and_measure(in, *test, bricks, tolerance, accept);
}

// The node at which the largest measure lies, on the gold that decided its brick. A brick's border can be
// tested for its neighbours' sake alone, which computed by itself it does not show: then the brick's first
// node.
Vec3 position_of(const Inputs& in, const MixedVolume& volume, const BrickMeasure& worst) {
  GoldStream& fine = in.gold.fine.gold();
  GoldStream& gold = in.gold.coarse && worst.rate != fine.settings().rate ? in.gold.coarse->gold() : fine;
  std::vector<std::uint8_t> one(in.selected.size(), 0);
  one[at(worst.brick)] = 1;
  std::optional<Vec3> where;
  gold.run(
      one, [&](GoldStream::Batch& batch) { where = worst_node(batch, volume, worst.brick, worst.rate); }, {},
      "worst");
  if (where) return *where;
  const Bricks bricks(volume.grid, volume.granularity);
  return volume.grid.position(bricks.first_cell(bricks.position(worst.brick)));
}

Certificate certify(const Inputs& in, const Device& device, const ProjectionSet& scan,
                    const FilteredScan& filtered, const BuildOptions& options, const Measured& measured,
                    const SamplerTerms& sampler, double epsilon_abs) {
  const Plan& plan = in.plan;
  Certificate c;
  c.epsilon =
      epsilon_abs == plan.epsilon_abs ? plan.epsilon : plan.epsilon * (epsilon_abs / plan.epsilon_abs);
  c.epsilon_abs = epsilon_abs;
  c.reference_range = plan.reference_range;
  const BrickMeasure* worst = nullptr;
  c.brick_totals.reserve(measured.bricks.size());
  for (const BrickMeasure& m : measured.bricks) {
    // Two sums in fp32, and this product.
    c.brick_totals.push_back(m.total < 0 ? -1.0f : m.total * (1 + 0x1p-21f));
    if (m.total < 0) continue;
    c.measured_max = std::max(c.measured_max, static_cast<double>(m.error));
    if (!worst || m.total > worst->total) worst = &m;
  }
  if (worst) {
    c.measured_total = static_cast<double>(worst->total) * (1 + 0x1p-22);  // two sums in fp32
    c.worst_at = position_of(in, measured.volume, *worst);
  }
  c.budget.grid = {c.measured_max, "measured at every tested gold node on the stored field"};
  c.budget.gold = {measured.slack.gold, "curvature: signed second differences of gold, with remainder"};
  c.budget.projection = {measured.slack.projection,
                         scan.cone ? "sups of |q|: six taps in u and v, 20 taps from kept gold"
                         : plan.rates.interpolation == Interpolation::six_taps
                             ? "sups of |q|: six taps in u, 16 taps from kept gold"
                             : "sups of |q_uu| and of |q|: interpolation in u, 16 taps from kept gold"};
  c.budget.arithmetic = {in.arithmetic, "rounding in fp32 from the ramp filter to back-projection"};
  c.budget.sampler = sampler;
  c.total_buffer = c.measured_total + c.budget.arithmetic.value + sampler.buffer.value;
  c.comparison = plan.settings.comparison.is_never_certified();
  // Of a volume without a tested node nothing is certified.
  const bool certified = !c.comparison && worst;
  c.holds_buffer = certified && c.total_buffer <= c.epsilon_abs;
  if (sampler.image3d) {
    c.total_image3d = c.measured_total + c.budget.arithmetic.value + sampler.image3d->value;
    c.holds_image3d = certified && *c.total_image3d <= c.epsilon_abs;
  }
  c.rates = plan.rates;
  c.bounds = plan.bounds;
  c.field = plan.field;
  c.field.center = plan.field.center.value_or(scan.geometry.center);
  c.field.preparation = scan.report.preparation;
  c.padding = filtered.fft_length;
  c.window = options.window;
  c.roi = options.roi;
  c.not_covered_count = plan.not_covered_count;
  c.not_covered_fraction = plan.not_covered_fraction;
  c.not_covered_rule = kNotCoveredRule;
  c.input_name = scan.report.name;
  c.input_sha256 = scan.report.sha256;
  c.input_shape = {scan.geometry.views(), scan.geometry.rows, scan.geometry.columns};
  c.input_angles = scan.geometry.views();
  c.device = device.info().name;
  c.driver = device.info().driver;
  c.version = VDVR_VERSION;
  c.notes = plan.notes;
  for (const std::string& note : scan.report.notes)
    if (std::find(c.notes.begin(), c.notes.end(), note) == c.notes.end()) c.notes.push_back(note);
  if (c.comparison)
    c.notes.push_back(fmt::format("built for comparison with {}: nothing is certified",
                                  plan.settings.comparison.terms == Terms::grid
                                      ? "terms grid, which test |V - gold| alone"
                                      : "closing none, whose field is not continuous"));
  c.notes.push_back(
      "covers interpolation, not physics: noise, too few views, the filter window and truncation shape F "
      "itself");
  if (measured.repaired > 0)
    c.notes.push_back(fmt::format("closing raised {} bricks by one level", measured.repaired));
  return c;
}

void count_inputs(HostMemory& host, const ProjectionSet& scan, const Plan& plan) {
  host.count(scan.data.resident_bytes(), "the projections, as read,");
  host.count(4 * plan.base.samples.size(), "the base samples");
}

// How often a volume may be brought within a smaller tolerance: each time takes what was measured and a
// quarter.
constexpr int most_reserves = 4;

SamplerTerms with_reserve(SamplerTerms terms) {
  terms.buffer.value *= 1.25;
  if (terms.image3d) terms.image3d->value *= 1.25;
  return terms;
}

// The scan filtered, gold at the plan's rates, then the volume: once, or again where the base rounds too
// much. All but the scan, and what is thrown, in `units`.
BuildResult build_in_units(Device& device, const ProjectionSet& scan, const Units& units, Plan plan,
                           const BuildOptions& options, const Progress& progress) {
  opencl::State& state = device.state();
  BuildResult result;
  Stopwatch watch(result.seconds);
  HostMemory host(state);
  count_inputs(host, scan, plan);
  const std::vector<std::uint8_t> selected = bricks_of(options.roi, plan.grid, plan.layout.granularity);
  if (std::find(selected.begin(), selected.end(), 1) == selected.end())
    throw InputError("`roi` meets no brick of the grid");

  // Six taps need values alone.
  const bool prepared = plan.prepared && plan.prepared->is_of(state, scan, plan.field, units);
  const auto from = prepared
                        ? plan.prepared
                        : std::make_shared<PreparedScan>(state, scan, plan.field, units,
                                                         plan.rates.interpolation == Interpolation::six_taps
                                                             ? PreparedScan::Sups::of_values
                                                             : PreparedScan::Sups::of_derivatives,
                                                         progress);
  const FilteredScan& filtered = from->filtered;
  watch.lap("filter");
  GoldSettings settings = gold_settings(plan, options, {}, scan.cone.has_value());
  const FieldSlopes slopes = field_slopes(as_mixed(plan.base));
  const std::string digest = options.journal ? plan_digest(scan, plan) : "";
  const std::vector<float> base = fitted_base(state, *from, plan, settings, selected, progress);
  watch.lap("fit");
  settings.lattice = lattice_of(base, plan, units, options.storage);
  GoldRates gold(state, filtered, from->sups, settings, from->source(settings));
  JournalledRates journalled(gold, options.journal);
  watch.lap("bounds");
  const SamplerProbe probe = probe_filters(device);
  watch.lap("probe");

  const Room room = room_for(state, scan, options);
  const Inputs in{state, units, plan, selected, journalled, gold.arithmetic(), room, progress, watch};
  const double underflow = from_world(sampler_underflow(device.info()), units);
  std::optional<BrickRefinement> refinement;
  if (options.refinement) refinement.emplace(*options.refinement, units);
  const double epsilon_abs = refinement ? refinement->everywhere() : plan.epsilon_abs;
  const auto sampler_of = [&](const FieldSlopes& of, std::int64_t atlas) {
    return sampler_terms(of, plan.grid, probe, atlas, epsilon_abs, plan.rates.gold, underflow);
  };
  // The samplers' share is known only from the stored samples: reserve what the base volume suggests. Where
  // that was short, bricks rise until the volume leaves room for what it takes, and a reserve.
  const SamplerTerms reserved = with_reserve(sampler_of(slopes, longest_atlas(device.info())));
  const double tolerance = node_tolerance(in, epsilon_abs, reserved);
  if (options.journal)
    options.journal->begin(journal_head(device, scan, plan, digest, options, gold.fine(), tolerance));
  int times = 0;
  bool refined = false;
  const Accept accept = [&](const Measured& measured) -> std::optional<NodeTolerance> {
    const SamplerTerms sampler =
        sampler_of(field_slopes(measured.volume), atlas_length(device.info(), measured.volume));
    result.certificate = certify(in, device, scan, filtered, options, measured, sampler, epsilon_abs);
    refined = refinement && refinement->asks(measured.volume, result.certificate, beside_nodes(in, sampler),
                                             node_tolerance(in, plan.epsilon_abs, reserved));
    if (refined) return std::nullopt;
    const bool holds = result.certificate.holds_buffer && result.certificate.holds_image3d.value_or(true);
    if (holds || times++ == most_reserves || result.certificate.comparison) return std::nullopt;
    const double less = node_tolerance(in, epsilon_abs, with_reserve(sampler));
    return refinement ? refinement->with_bricks(less) : NodeTolerance(less);
  };
  // Bricks are classified anew for what is asked of them: repair would raise them a level at a time.
  const auto volume_on = [&](const Lattice& lattice) {
    for (;;) {
      times = 0;
      MixedVolume volume =
          measured_volume(in, base, lattice, refinement ? refinement->with_bricks(tolerance) : tolerance,
                          accept)
              .volume;
      if (!refined) return volume;
    }
  };
  try {
    result.volume = volume_on(settings.lattice);
  } catch (const ToleranceError&) {
    // Rounding can take what slack leaves at the gold rate, where nothing finer is left.
    if (!(settings.lattice.step > 0) || options.storage != StorageChoice::automatic) throw;
    result.volume = volume_on(lattice_of(base, plan, units, StorageChoice::f32));
  }
  return result;
}

}  // namespace

BuildResult build(Device& device, const ProjectionSet& scan, Plan plan, const BuildOptions& options,
                  const Progress& progress) {
  check_line_integrals(scan);
  if (plan.estimated) throw InputError("a plan that was estimated from a part of the scan cannot be built");
  const Units units = units_of(scan);
  if (units.are_world()) return build_in_units(device, scan, units, std::move(plan), options, progress);
  const Grid grid = plan.grid;
  BuildOptions wanted = options;
  if (options.roi) wanted.roi = from_world(*options.roi, units);
  if (options.window)
    wanted.window = {from_world(options.window->first, units), from_world(options.window->second, units)};
  BuildResult result =
      build_in_units(device, scan, units, from_world(std::move(plan), units), wanted, progress);
  scale(result.volume, units.density());
  result.volume.grid = grid;
  result.certificate = to_world(std::move(result.certificate), units);
  return result;
}

}  // namespace vdvr
