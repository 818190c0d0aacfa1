// Builds the certified volume: classify, extract, close, pack, then measure the packed field and repair until
// it holds (docs/error-bounds.md). Calls gold_stream.cpp and close_boundaries.cpp.
#include "vdvr/expert/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/brick_refinement.hpp"
#include "host/certify/build_journal.hpp"
#include "host/certify/choose_coarsening.hpp"
#include "host/certify/closing/close_boundaries.hpp"
#include "host/certify/closing/raise_levels.hpp"
#include "host/certify/crew/crew.hpp"
#include "host/certify/fill_certificate.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/plan_parts.hpp"
#include "host/certify/sampler_share.hpp"
#include "host/volume/bricks.hpp"
#include "host/volume/result_units.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/region_of_interest.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

// Of scratch, where the device has no limit.
constexpr std::uint64_t least_resident = std::uint64_t{64} << 20;

// Where bricks of the region read it, the base that suits the trilinear filter best; elsewhere F. The plan
// gives its samples away.
std::vector<float> fitted_base(opencl::State& state, PreparedScan& from, Plan& plan,
                               const GoldSettings& settings, const std::vector<std::uint8_t>& selected,
                               Crew* crew, const Progress& progress) {
  std::vector<float> base = take_base(std::exchange(plan.base, {}), plan.layout.coarsening);
  if (plan.settings.comparison.coefficients != Coefficients::midrange) return base;
  GoldStream gold(state, from.filtered, from.sups, fitting_settings(settings), from.source(settings));
  BlockPass pass;
  pass.ask = BlockPass::Ask::fit;
  pass.purpose = GoldStream::For::samples;
  pass.selected = bricks_to_fit(gold, settings, selected);
  const auto shared = std::make_shared<const BlockPass>(std::move(pass));
  // Where blocks meet, the later one in the order of a single device counts.
  std::map<BlockPlace, Bytes> records;
  run_blocks(
      crew, gold, shared, nullptr, gold.works(shared->selected, shared->purpose),
      [&](const Bytes& record) {
        ByteReader in(record);
        records[get_key(in).place(0)] = record;
      },
      progress, "fit");
  for (const auto& [place, record] : records) {
    ByteReader in(record);
    get_key(in);
    read_fit(in, [&](std::size_t i, float sample) { base.at(i) = sample; });
  }
  return base;
}

// Of the devices' texture units the worst.
FilterErrors filters_of(const std::vector<Crew::Kind>& kinds) {
  FilterErrors worst;
  for (const Crew::Kind& kind : kinds) {
    const FilterErrors own = filter_errors(kind.probe);
    worst = {std::max(worst.u8, own.u8), std::max(worst.u16, own.u16)};
  }
  return worst;
}

MemoryBudget memory_budget_of(const opencl::State& state, const ProjectionSet& scan,
                              const BuildOptions& options) {
  const std::uint64_t share = state.memory.limit() / 8;
  if (share == 0 && !options.in_memory_bytes) return {};
  MemoryBudget budget{scan.data.scratch(), options.in_memory_bytes.value_or(share)};
  if (!budget.scratch)
    budget.scratch =
        std::make_shared<Scratch>(options.scratch.empty() ? default_scratch_folder() : options.scratch,
                                  std::max(share, least_resident));
  return budget;
}

OpenBricks open_bricks(const Plan& plan, const std::vector<float>& base, const IntegerLattice& lattice,
                       const MemoryBudget& budget) {
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
  bricks.samples = TileStore(budget);
  bricks.samples.resize(count);
  return bricks;
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
                  !projection || in.plan.rates.interpolation == Interpolation::eight_taps
                      ? "`gold`"
                      : "`upsampling`, or take `u_filter` six-taps,",
                  to_world(in.plan.epsilon_abs + 1.1 * more, in.units)));
}

// At the gold rate V is gold, but for the rounding of what is stored and of gold computed in other blocks.
[[noreturn]] void refuse_stored(const Inputs& in, const IntegerLattice& lattice, float total,
                                double tolerance) {
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

// Of blocks of all rates, which lie on one lattice: whole cells of it, in order, that hold as many bricks
// to test as those of the other shares.
void keep_share(const Inputs& in, const BuildShare& share, std::vector<std::uint8_t>& near) {
  const Bricks bricks(in.plan.grid, in.plan.layout.granularity);
  const Index3 n = bricks.along(), block = in.rates.block_bricks();
  const auto total = std::max<std::int64_t>(1, std::count(near.begin(), near.end(), 1));
  std::int64_t before = 0;
  Index3 c{};
  for (c[2] = 0; c[2] < n[2]; c[2] += block[2])
    for (c[1] = 0; c[1] < n[1]; c[1] += block[1])
      for (c[0] = 0; c[0] < n[0]; c[0] += block[0]) {
        const bool mine = before * share.parts / total == share.part - 1;
        for (std::int64_t z = c[2]; z < std::min(n[2], c[2] + block[2]); ++z)
          for (std::int64_t y = c[1]; y < std::min(n[1], c[1] + block[1]); ++y)
            for (std::int64_t x = c[0]; x < std::min(n[0], c[0] + block[0]); ++x) {
              std::uint8_t& brick = near[at(bricks.number({x, y, z}))];
              before += brick;
              brick = brick && mine;
            }
      }
}

void classify(const Inputs& in, ClassifyBricks& test, const OpenBricks& bricks, NodeTolerance tolerance,
              const BuildShare& share = {}) {
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
  keep_share(in, share, near);
  const MixedVolume level0 = as_mixed(bricks.base, in.gold.fine.gold().settings());
  const DeviceField base(in.state, level0, in.budget.for_bytes(sample_buffer_bytes(level0)));
  if (in.crew) in.crew->use(level0, in.budget);
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
std::uint64_t memory_bytes(const MixedVolume& volume) {
  std::uint64_t bytes = 0;
  for_each_array(volume, [&](const auto& samples) {
    if (!samples.scratch()) bytes += samples.size() * sizeof(*samples.data());
  });
  return bytes;
}

// What a measured volume is certified for, and whether that will do.
struct Judgement {
  Certificate certificate{};
  std::optional<NodeTolerance> smaller{};  // what it is to be brought within
  bool refined = false;                    // bricks are to be classified anew, for what was asked of them
};
using Judge = std::function<Judgement(const Measured&)>;

struct Judged {
  MixedVolume volume{};
  Judgement verdict{};
};

// Those that a smaller tolerance may ask more of than the one they were measured with.
std::vector<std::uint8_t> bricks_above(const std::vector<BrickMeasure>& measures,
                                       const NodeTolerance& tolerance) {
  std::vector<std::uint8_t> above(measures.size(), 0);
  for (std::size_t i = 0; i < above.size(); ++i)
    above[i] = !(static_cast<double>(measures[i].total) <= tolerance.of(i));
  return above;
}

// Closes, packs, measures; raises bricks until every node is within the tolerance, and no smaller one asked.
Judged close_and_measure(const Inputs& in, ClassifyBricks& test, OpenBricks& bricks, NodeTolerance tolerance,
                         const Judge& judge) {
  // Bricks that stay at level 0 were measured on the base samples while classifying, and closing does not
  // change those.
  std::vector<std::uint8_t> pending(bricks.level.size());
  Measured out;
  MixedVolume before;
  HostMemory closed(in.state);
  std::uint64_t closed_bytes = 0;
  CloseBoundaries close(bricks, in.plan.settings.comparison.closing, in.budget);
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
    const DeviceField field(in.state, volume, in.budget.for_bytes(sample_buffer_bytes(volume)));
    if (in.crew) in.crew->use(volume, in.budget);
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
      Judgement verdict = judge(out);
      if (!verdict.smaller) return {std::move(out.volume), std::move(verdict)};
      volume = std::move(out.volume);
      tolerance = std::move(*verdict.smaller);
      test.measure(field, volume.level, tolerance, bricks_above(test.measures(), tolerance), "repair");
      in.watch.lap("verify");
    }
    test.extract(raised);
    in.watch.lap("repair");
    before = std::move(volume);
  }
}

// The volume of these base samples within the tolerance; of a share, what it classifies, and no volume.
Judged judged_volume(const Inputs& in, const std::vector<float>& base, const IntegerLattice& lattice,
                     const NodeTolerance& tolerance, const Judge& judge,
                     const std::optional<BuildShare>& share) {
  HostMemory tiles(in.state);
  tiles.count(4 * base.size(), "the base samples, rounded,");
  OpenBricks bricks = open_bricks(in.plan, base, lattice, in.budget);
  std::optional<ClassifyBricks> test;
  test.emplace(in.gold, bricks, tiles, in.progress,
               [&](float slack, double strict) { refuse_slack(in, test->bounds(), slack, strict); });
  if (!tolerance.by_brick.empty())
    for (std::size_t i = 0; i < bricks.level.size(); ++i)
      bricks.tolerance.push_back(static_cast<float>(tolerance.of(i)));
  classify(in, *test, bricks, tolerance, share.value_or(BuildShare{}));
  if (share) return {};
  return close_and_measure(in, *test, bricks, tolerance, judge);
}

// The volume that will do: made once, or again for what was asked of bricks, where the base rounds too much,
// or where the texture unit takes too much.
struct VolumeMaker {
  const Inputs& in;
  Device& device;
  const ProjectionSet& scan;
  const FilteredScan& filtered;
  const BuildOptions& options;
  const std::optional<BuildShare>& share;
  const std::vector<float>& base;
  const IntegerLattice& lattice;
  SamplerShare& samplers;
  BrickRefinement* refinement;  // none: one tolerance holds for all
  double epsilon_abs;

  Judged make() {
    try {
      return in_integers_or_not();
    } catch (const ToleranceError&) {
      if (!samplers.raised_for_image3d()) throw;
      samplers.give_up_image3d();
      return in_integers_or_not();
    }
  }

 private:
  Judged in_integers_or_not() {
    try {
      return made_on(lattice);
    } catch (const NoRoomForImage3d&) {
      throw;
    } catch (const ToleranceError&) {
      // Rounding can take what slack leaves at the gold rate, where nothing finer is left.
      if (!(lattice.step > 0) || options.storage != StorageChoice::automatic || share) throw;
      return made_on(lattice_of(base, in.plan.epsilon_abs, in.plan.layout, in.units, StorageChoice::f32, {}));
    }
  }

  // Bricks are classified anew for what is asked of them: repair would raise them a level at a time.
  Judged made_on(const IntegerLattice& integers) {
    for (;;) {
      NodeTolerance tolerance = samplers.begin();
      if (refinement) tolerance.lower_to(refinement->with_bricks(tolerance.of_all));
      Judged made = judged_volume(
          in, base, integers, tolerance, [&](const Measured& m) { return judge(m); }, share);
      if (!made.verdict.refined && !samplers.anew()) return made;
    }
  }

  Judgement judge(const Measured& measured) {
    const SamplerTerms sampler = samplers.of(measured.volume);
    Judgement verdict{fill_certificate(in, device, scan, filtered, options, measured, sampler, epsilon_abs)};
    const double rest = samplers.beside_nodes(sampler);
    const bool by_brick = refinement && refinement->knows_bricks();
    const bool asked =
        refinement && refinement->asks(measured.volume, verdict.certificate, rest,
                                       samplers.first_tolerance(in.plan.epsilon_abs) / (by_brick ? 2 : 1));
    // What is known from the start only changes by what samplers were measured to take: little, of few
    // bricks.
    if (asked && by_brick) {
      verdict.smaller = refinement->with_bricks(samplers.now());
    } else if (asked) {
      verdict.refined = true;
    } else {
      verdict.smaller = samplers.smaller(verdict.certificate, measured.bricks);
      if (verdict.smaller && refinement)
        verdict.smaller->lower_to(refinement->with_bricks(verdict.smaller->of_all));
    }
    return verdict;
  }
};

// The scan filtered, gold at the plan's rates, then the volume: once, or again where the base rounds too
// much. All but the scan, and what is thrown, in its units.
BuildResult build_in_units(Device& device, const ScanInUnits& of_scan, Plan plan, const BuildOptions& options,
                           const std::optional<BuildShare>& share, const Progress& progress) {
  opencl::State& state = device.state();
  const ProjectionSet& scan = of_scan.scan;
  const Units& units = of_scan.units;
  require_trusted(device, "certifying a volume");
  BuildResult result;
  Stopwatch watch(result.seconds);
  HostMemory host(state);
  host.count(scan.data.resident_bytes(), "the projections, as read,");
  host.count(4 * plan.base.samples.size(), "the base samples");
  const std::vector<std::uint8_t> selected = bricks_of(options.roi, plan.grid, plan.layout.granularity);
  if (std::find(selected.begin(), selected.end(), 1) == selected.end())
    throw InputError("`roi` meets no brick of the grid");

  const std::shared_ptr<PreparedScan> from = preparation_of(state, of_scan, plan, progress);
  const FilteredScan& filtered = from->filtered;
  watch.lap("filter");
  GoldSettings settings = gold_settings(plan, plan.rates, scan.cone.has_value());
  settings.window = options.window;
  settings.of_noise = options.refinement && !options.refinement->by_brick.empty();
  // That closing knows no levels per axis.
  if (plan.settings.comparison.closing == Closing::paper) settings.anisotropic = false;
  std::optional<Crew> crew;
  const bool all = 2 * std::count(selected.begin(), selected.end(), 1) > std::ssize(selected);
  if (!options.crew.alone()) {
    settings.views_together = from->source(settings)->kept.views_together();
    crew.emplace(device, *from, settings, options.crew, all);
  }
  Crew* const others = crew ? &*crew : nullptr;
  watch.lap("crew");
  const FieldSlopes slopes = field_slopes(as_mixed(plan.base));
  const std::string digest = options.journal ? plan_digest(scan, plan) : "";
  const std::vector<float> base = fitted_base(state, *from, plan, settings, selected, others, progress);
  watch.lap("fit");
  const std::vector<Crew::Kind> kinds =
      crew ? crew->kinds() : std::vector<Crew::Kind>{{device.info(), probe_filters(device), 0}};
  watch.lap("probe");
  settings.lattice =
      lattice_of(base, plan.epsilon_abs, plan.layout, units, options.storage, filters_of(kinds));
  GoldRates gold(state, filtered, from->sups, settings, from->source(settings));
  BlockRecords records(options.journal, options.parts);
  JournalledRates journalled(gold, &records, others);
  watch.lap("bounds");

  const MemoryBudget budget = memory_budget_of(state, scan, options);
  double arithmetic = gold.arithmetic();
  for (const Crew::Kind& kind : kinds) arithmetic = std::max(arithmetic, kind.arithmetic);
  const Inputs in{state,  units,      plan,   selected, journalled, gold,
                  others, arithmetic, budget, progress, watch};
  std::optional<BrickRefinement> refinement;
  if (options.refinement) refinement.emplace(*options.refinement, units);
  const double epsilon_abs = refinement ? refinement->everywhere() : plan.epsilon_abs;
  const bool by_brick = refinement && refinement->knows_bricks();
  SamplerShare samplers(kinds, plan, units, epsilon_abs, arithmetic, slopes,
                        by_brick ? refinement->bounds() : std::vector<double>());
  if (refinement)
    refinement->begin(epsilon_abs - samplers.first_tolerance(epsilon_abs),
                      samplers.first_tolerance(plan.epsilon_abs));
  records.begin(
      journal_head(kinds, scan, plan, digest, options, gold.fine(), samplers.first_tolerance(epsilon_abs)));
  Judged made = VolumeMaker{in,         device,
                            scan,       filtered,
                            options,    share,
                            base,       settings.lattice,
                            samplers,   refinement ? &*refinement : nullptr,
                            epsilon_abs}
                    .make();
  result.volume = std::move(made.volume);
  result.certificate = std::move(made.verdict.certificate);
  if (crew) {
    result.message_bytes = crew->bytes();
    result.message_seconds = crew->message_seconds();
  }
  return result;
}

BuildResult build_all_or_share(Device& device, const ProjectionSet& scan, Plan plan,
                               const BuildOptions& options, const std::optional<BuildShare>& share,
                               const Progress& progress) {
  const ScanInUnits of_scan(scan);
  if (plan.estimated) throw InputError("a plan that was estimated from a part of the scan cannot be built");
  const Units& units = of_scan.units;
  if (units.are_world()) return build_in_units(device, of_scan, std::move(plan), options, share, progress);
  const Grid grid = plan.grid;
  BuildOptions wanted = options;
  if (options.roi) wanted.roi = from_world(*options.roi, units);
  if (options.window)
    wanted.window = {from_world(options.window->first, units), from_world(options.window->second, units)};
  BuildResult result =
      build_in_units(device, of_scan, from_world(std::move(plan), units), wanted, share, progress);
  if (share) return result;
  scale(result.volume, units.density());
  result.volume.grid = grid;
  result.certificate = to_world(std::move(result.certificate), units);
  return result;
}

}  // namespace

BuildResult build(Device& device, const ProjectionSet& scan, Plan plan, const BuildOptions& options,
                  const Progress& progress) {
  return build_all_or_share(device, scan, std::move(plan), options, std::nullopt, progress);
}

void build_share(Device& device, const ProjectionSet& scan, Plan plan, const BuildOptions& options,
                 const BuildShare& share, const Progress& progress) {
  if (!options.journal) throw InputError("a share is written into a journal, and none was given");
  if (share.parts < 1 || share.part < 1 || share.part > share.parts)
    throw InputError(fmt::format("share {} of {}: there is no such part", share.part, share.parts));
  build_all_or_share(device, scan, std::move(plan), options, share, progress);
}

}  // namespace vdvr
