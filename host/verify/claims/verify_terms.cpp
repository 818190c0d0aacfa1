// What build computes beside |V - F|, made again by its own code and compared with the certificate. This says
// whether the certificate is the one that build writes; whether V is near F is measured by other means.
#include "host/verify/claims/verify_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "host/certify/classify_bricks.hpp"
#include "host/certify/crew/gold_rates.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/kept/base_of_gold.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/scan/units.hpp"
#include "host/volume/covered_range.hpp"
#include "host/volume/result_units.hpp"

namespace vdvr {
namespace {

// Sups and tables are sums in fp32 over at most a few thousand terms: devices agree on them better than this.
constexpr double table_rounding = 0x1p-10;
// Bricks that are measured by themselves: each takes its rows of all views.
constexpr std::size_t most_alone = 16;

/// The scan filtered as build does, and what follows from that, in `units`.
struct Filtered {
  Filtered(opencl::State& device, const ProjectionSet& projections, const Units& of_scan,
           const FieldOptions& field, Interpolation interpolation, const Progress& progress)
      : state(device),
        units(of_scan),
        scan(filter_scan(device, projections, field, progress, Precision::fp64, units)),
        upsampler(device, scan, ColumnMethod::accurate) {
    sups = is_cone()                                  ? cone_sups(device, upsampler, scan)
           : interpolation == Interpolation::six_taps ? value_sups(device, upsampler, scan)
                                                      : field_sups(device, upsampler, scan);
  }
  Filtered(const Filtered&) = delete;
  Filtered& operator=(const Filtered&) = delete;

  /// As the certificate's reader knows densities.
  [[nodiscard]] double world(double density) const { return to_world(density, units); }
  [[nodiscard]] bool is_cone() const { return !scan.views.empty(); }

  opencl::State& state;
  Units units;
  FilteredScan scan;
  Upsampler upsampler;
  FieldSups sups;
};

/// Rounding as build bounds it, of blocks of samples with this spacing, so many along their sides; `base` is
/// the grid that sets how far columns reach.
double arithmetic_of(Filtered& f, const Grid& base, const Vec3& spacing, double side, int upsampling,
                     Interpolation interpolation, Fp64 fp64) {
  const auto n = static_cast<std::int64_t>(side);
  const ColumnBlocks blocks{n, n, spacing[0], spacing[1], {}, {}};
  return arithmetic_bound(f.upsampler, f.scan, f.sups, columns_for(f.scan.geometry, base, upsampling), blocks,
                          interpolation, fp64);
}

/// What the field errs at the grid's samples, as build makes it: by rounding, here and where the file was
/// built, and by interpolation.
struct BaseErrors {
  double rounding = 0, rounding_of_build = 0, projection = 0;
};

// Of parallel beam those of a reconstruction with six taps at 8x, of cone beam those of gold at the samples.
BaseErrors base_errors(Filtered& f, const MixedVolume& v, KeptGold& kept, bool same_device) {
  if (f.is_cone()) {
    const GoldLattice lattice = kept.lattice(v.grid, 1);
    const GoldErrors errors = kept.errors(lattice);
    return {errors.rounding + errors.ramp,
            kept.rounding_elsewhere(lattice, same_device, Interpolation::eight_taps).second + errors.ramp,
            errors.interpolation};
  }
  const double side = static_cast<double>(std::max(v.grid.cells[0], v.grid.cells[1]) + 2);
  const auto rounding = [&](Fp64 fp64) {
    return arithmetic_of(f, v.grid, v.grid.spacing, side, 8, Interpolation::six_taps, fp64);
  };
  const double here = rounding(Fp64::as_here);
  return {here, same_device ? here : std::max(rounding(Fp64::present), rounding(Fp64::absent)),
          six_tap_facts().sup * f.sups.value};
}

Volume base_again(Filtered& f, const MixedVolume& v, KeptGold& kept, const Progress& progress) {
  return f.is_cone()
             ? base_of_gold(f.state, kept, Coverage(f.scan.geometry, f.scan.views), v.grid,
                            kept_margin(v.grid, 1), progress)
             : reconstruct_field(f.state, f.scan, f.upsampler, v.grid, 8, Interpolation::six_taps, progress);
}

// F at the second place, by other means, less F at the first.
double exact_range(const Filtered& f, const ExactField& exact, const std::array<Vec3, 2>& at) {
  const std::vector<double> F = exact.at(std::array{to_world(at[0], f.units), to_world(at[1], f.units)});
  return from_world(F[1], f.units) - from_world(F[0], f.units);
}

// One made again has the same interpolation error but for rounding, and the extremes of two fields differ by
// no more than the fields do.
void compare_range(Differences& out, Filtered& f, const ExactField& exact, const MixedVolume& v,
                   const Certificate& c, KeptGold& kept, bool same_device, const Progress& progress) {
  const BaseErrors errs = base_errors(f, v, kept, same_device);
  const CoveredRange range =
      covered_range(base_again(f, v, kept, progress), Coverage(f.scan.geometry, f.scan.views));
  const double found = range.high - range.low;
  const double apart = 2 * (errs.rounding + errs.rounding_of_build);
  if (!(std::abs(c.reference_range - found) <= apart))
    out.push_back(fmt::format("reference_range is {}, not {} within {:.3g}", f.world(c.reference_range),
                              f.world(found), f.world(apart)));
  // F itself at the two extremes: the range cannot be smaller.
  const double exactly =
      exact_range(f, exact, {v.grid.position(range.low_at), v.grid.position(range.high_at)});
  if (!(c.reference_range >=
        exactly - 2 * (errs.projection + errs.rounding + from_world(exact.rounding(), f.units))))
    out.push_back(fmt::format("reference_range is {}, below F's own {} between two samples",
                              f.world(c.reference_range), f.world(exactly)));
}

bool is_covered_sample(const Grid& grid, const Coverage& coverage, const Vec3& place) {
  Index3 sample{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double steps = (place[a] - grid.origin[a]) / grid.spacing[a];
    if (!(steps > -0.5 && steps < static_cast<double>(grid.cells[a]) + 0.5)) return false;
    sample[a] = std::llround(steps);
    // World units and others round by less.
    if (!(std::abs(steps - static_cast<double>(sample[a])) <= 1e-6)) return false;
  }
  const Vec3 p = grid.position(sample);
  return coverage.margin(p[0], p[1]) >= 0 && coverage.margin_z(p[2]) >= 0;
}

// Where the certificate says between which covered samples its range lies, F there proves that it is none too
// large, so that the tolerance is not. One that is too small promises more than was asked for.
void compare_range_at(Differences& out, Filtered& f, const ExactField& exact, const MixedVolume& v,
                      const Certificate& c, KeptGold& kept, bool same_device) {
  const Coverage coverage(f.scan.geometry, f.scan.views);
  for (const Vec3& place : *c.range_at)
    if (!is_covered_sample(v.grid, coverage, place)) {
      out.push_back(
          fmt::format("range_at: no sample of the grid that the scan covers is at ({:.6g}, {:.6g}, "
                      "{:.6g})",
                      to_world(place, f.units)[0], to_world(place, f.units)[1], to_world(place, f.units)[2]));
      return;
    }
  const BaseErrors errs = base_errors(f, v, kept, same_device);
  const double exactly = exact_range(f, exact, *c.range_at),
               apart = 2 * (errs.projection + std::max(errs.rounding, errs.rounding_of_build) +
                            from_world(exact.rounding(), f.units));
  if (!(std::abs(c.reference_range - exactly) <= apart))
    out.push_back(
        fmt::format("reference_range is {}, not F's own {} between the samples of range_at within "
                    "{:.3g}",
                    f.world(c.reference_range), f.world(exactly), f.world(apart)));
}

/// |V - gold| + T + P of the selected bricks, as build measures them.
class Totals {
 public:
  Totals(Filtered& f, const MixedVolume& v, const Certificate& c, bool same_device)
      : f_(f),
        volume_(v),
        stored_(c),
        field_(f.state, v),
        gold_(f.state, f.scan, f.sups, settings(f, v, c)),
        same_device_(same_device) {
    for (const GoldStream* gold : rates()) {
      const GoldLattice lattice = kept().lattice(v.grid, gold->settings().rate);
      const double ramp = kept().errors(lattice).ramp;
      const auto [least, most] = kept().rounding_elsewhere(lattice, same_device, taps_of_file());
      // Earlier versions knew no finer rates than the plan's.
      if (gold->settings().rate <= v.rate) least_arithmetic_ = std::max(least_arithmetic_, least + ramp);
      most_arithmetic_ = std::max(most_arithmetic_, most + ramp);
    }
    const double own = gold_.fine().projection();
    const auto apart = [&](double projection) { return std::abs(c.budget.projection.value - projection); };
    const std::vector<double> projections =
        kept().interpolation_by(taps_of_file(), kept().lattice(v.grid, v.rate));
    projection_of_file_ = *std::ranges::min_element(projections, std::less<>{}, apart);
    // Their gold and this one err, each by its own, and a total has 5.25 of either at most.
    if (is_of_six_taps() || projection_of_file_ != projections.front())
      of_other_taps_ = 5.25 * (own + projection_of_file_);
    for (const float b : decoded(v.base, v.step))
      largest_ = std::max(largest_, std::abs(static_cast<double>(b)));
  }

  [[nodiscard]] KeptGold& kept() const { return gold_.fine().source()->kept; }

  void compare(Differences& out, std::vector<std::uint8_t> selected, bool exhaustive,
               const Progress& progress) {
    const std::vector<std::uint8_t> near = gold_.fine().bricks_near_coverage();
    for (std::size_t i = 0; i < selected.size(); ++i) selected[i] = selected[i] && near[i];
    if (!exhaustive) kept().make_only_what_is_read();
    gold_.fine().will_measure(selected);
    // A brick has its total from one rate of gold: the coarse one explains most, for an eighth of the
    // work.
    if (GoldStream* coarse = gold_.coarse()) {
      std::vector<std::uint8_t> resolved = selected;
      for (std::size_t i = 0; i < resolved.size(); ++i) resolved[i] = resolved[i] && resolves(*coarse, i);
      run(*coarse, resolved, progress, [&](const BrickMeasure& m) {
        if (!agrees(m)) return;
        selected[at(m.brick)] = 0;
        // What build certified by coarse gold has no larger error between that gold's nodes.
        if (m.total >= 0) most_ = std::max(most_, static_cast<double>(m.total) + tolerance(m));
      });
    }
    std::vector<BrickMeasure> low;
    const auto measure = [&](GoldStream& gold) {
      run(gold, selected, progress, [&](const BrickMeasure& m) {
        if (m.total >= 0) {
          if (&gold == &gold_.fine()) error_ = std::max(error_, error_that_counts(m));
          most_ = std::max(most_, static_cast<double>(m.error) + arithmetic() + arithmetic_of_build());
        }
        if (!agrees(m)) low.push_back(m);
        // Finer gold may have decided it for less than rounding, and seen another largest error.
        else if (is_below(m)) most_ = std::max(most_, static_cast<double>(m.total));
      });
    };
    measure(gold_.fine());
    // Build took finer gold where that left a brick undecided.
    if (GoldStream* finer = gold_.finer()) {
      selected.assign(selected.size(), 0);
      for (const BrickMeasure& m : std::exchange(low, {})) selected[at(m.brick)] = 1;
      measure(*finer);
    }
    compare_alone(out, std::move(low), progress);
    compare_constants(out);
    compare_largest(out, exhaustive);
  }

 private:
  // Those at which build can have decided a brick.
  std::vector<GoldStream*> rates() {
    std::vector<GoldStream*> out{&gold_.fine()};
    if (gold_.coarse()) out.push_back(gold_.coarse());
    if (gold_.finer()) out.push_back(gold_.finer());
    return out;
  }

  static GoldSettings settings(const Filtered& f, const MixedVolume& v, const Certificate& c) {
    GoldSettings s{v.grid, v.granularity, v.rate, c.rates.upsampling, c.rates.interpolation, c.window};
    s.coarsening = v.coarsening;
    s.differences = c.rates.differences;
    // As build's: what kept nodes are charged depends on how far they reach.
    if (f.is_cone()) s.least_reach = reach_of_all(s);
    return s;
  }

  void run(GoldStream& gold, const std::vector<std::uint8_t>& selected, const Progress& progress,
           const std::function<void(const BrickMeasure&)>& visit) {
    run(gold, selected, stored_.epsilon_abs, {}, progress, visit);
  }
  void run(GoldStream& gold, const std::vector<std::uint8_t>& selected, double tolerance,
           std::span<const CellBox> cells, const Progress& progress,
           const std::function<void(const BrickMeasure&)>& visit) {
    if (std::find(selected.begin(), selected.end(), 1) == selected.end()) return;
    const opencl::DeviceArray<std::uint8_t> on_device(f_.state, std::span<const std::uint8_t>(selected),
                                                      "bricks to measure");
    gold.run_in_strands(
        selected,
        [&](GoldStream::Batch& batch) -> Take {
          return [&visit, found = batch.measure(field_, tolerance, on_device, false, cells)] {
            std::ranges::for_each(found, visit);
          };
        },
        progress, "totals");
  }

  // Earlier programs made gold of cone beam with six taps at 8x, and charged more roundings than they took;
  // then of leaning detectors without tables of upright ones.
  [[nodiscard]] bool is_of_six_taps() const {
    return f_.is_cone() && stored_.rates.interpolation != Interpolation::eight_taps;
  }
  [[nodiscard]] Interpolation taps_of_file() const {
    return is_of_six_taps() ? Interpolation::six_taps : Interpolation::eight_taps;
  }
  [[nodiscard]] double arithmetic() const { return gold_.arithmetic(); }
  // Of a device without double precision it is several times as large, and its certificate says so.
  [[nodiscard]] double arithmetic_of_build() const {
    return same_device_ ? arithmetic() : std::max(arithmetic(), stored_.budget.arithmetic.value);
  }

  // A node takes T and P from the cells around it in its block, and blocks are cut to the bricks asked for:
  // of a brick alone the total is the least that build can have found, by one rate of gold or another.
  void compare_alone(Differences& out, std::vector<BrickMeasure> low, const Progress& progress) {
    const auto deficit = [&](const BrickMeasure& m) {
      return static_cast<double>(m.total) - static_cast<double>(stored_.brick_totals[at(m.brick)]);
    };
    std::sort(low.begin(), low.end(),
              [&](const BrickMeasure& a, const BrickMeasure& b) { return deficit(a) > deficit(b); });
    std::int64_t different = 0;
    std::string first;
    for (std::size_t i = 0; i < std::min(low.size(), most_alone); ++i) {
      std::vector<std::uint8_t> one(volume_.level.size(), 0);
      one[at(low[i].brick)] = 1;
      bool right = false;
      for (GoldStream* gold : rates())
        if (!right && resolves(*gold, at(low[i].brick)))
          run(*gold, one, progress, [&](const BrickMeasure& m) { right = agrees(m); });
      if (right || agrees_by_cells(low[i], one, progress)) continue;
      if (++different == 1)
        first = fmt::format("the total of brick {} is {}, not {} within {:.3g}", low[i].brick,
                            f_.world(static_cast<double>(stored_.brick_totals[at(low[i].brick)])),
                            f_.world(static_cast<double>(low[i].total)), f_.world(tolerance(low[i])));
    }
    if (different > 0)
      out.push_back(different > 1 ? fmt::format("{} totals of bricks differ; {}", different, first) : first);
  }

  // Build goes to finer gold where cells fail, and in their box alone, since finer gold need not find less in
  // the others: they err by less on the coarser gold than the brick has been given.
  bool agrees_by_cells(const BrickMeasure& m, const std::vector<std::uint8_t>& one,
                       const Progress& progress) {
    GoldStream& fine = gold_.fine();
    if (!gold_.finer() || !resolves(fine, at(m.brick))) return false;
    const double given = static_cast<double>(stored_.brick_totals[at(m.brick)]) + tolerance(m);
    std::optional<BrickMeasure> before;
    run(fine, one, given, {}, progress, [&](const BrickMeasure& found) { before = found; });
    if (!before) return false;
    std::vector<CellBox> cells(one.size());
    cells[at(m.brick)] = cells_of_finer(before->open);
    bool right = false;
    run(*gold_.finer(), one, given, cells, progress,
        [&](const BrickMeasure& found) { right = agrees(on_finer_too(*before, found)); });
    return right;
  }

  [[nodiscard]] bool resolves(const GoldStream& gold, std::size_t brick) const {
    const LevelTriple finest = gold.settings().finest();
    const LevelTriple& level = volume_.level[brick];
    return level[0] <= finest[0] && level[1] <= finest[1] && level[2] <= finest[2];
  }

  // Of two computations each: gold errs by A, a second difference by 4 A and T, an eighth of three of them,
  // by 1.5 A. One device computes a brick in two boxes alike, but for how products along z are cut into runs:
  // far below 2^-15 of the largest sample (see build's classify).
  [[nodiscard]] double tolerance(const BrickMeasure& m) const {
    const double gold = 2.5 * (arithmetic() + arithmetic_of_build());
    // Build may have had other memory, or double precision that this device lacks: a total has its rounding
    // in nodes and in differences, 5.25 times at most.
    return (same_device_ ? std::min(gold, 0x1p-15 * largest_) : gold) + of_other_taps_ +
           5.25 * (arithmetic() - least_arithmetic_) +
           table_rounding * static_cast<double>(std::max(m.total, 0.0f));
  }

  [[nodiscard]] bool agrees(const BrickMeasure& m) const {
    if (stored_.brick_totals.empty()) return true;
    const auto stored = static_cast<double>(stored_.brick_totals[at(m.brick)]);
    if (m.total < 0) return true;
    return stored >= 0 && stored >= static_cast<double>(m.total) - tolerance(m);
  }

  // Of a brick that finer gold decided, no more than its total: nodes with larger errors are not covered.
  [[nodiscard]] double error_that_counts(const BrickMeasure& m) const {
    const auto error = static_cast<double>(m.error);
    return is_below(m) ? std::min(error, static_cast<double>(stored_.brick_totals[at(m.brick)])) : error;
  }

  [[nodiscard]] bool is_below(const BrickMeasure& m) const {
    return !stored_.brick_totals.empty() && stored_.brick_totals[at(m.brick)] < m.total;
  }

  // What follows from sups alone. The filter's own error is measured, and another device's may be smaller.
  void compare_constants(Differences& out) const {
    // Programs from before kept gold bounded curvature where this one takes constants: other terms, not wrong
    // ones.
    if (stored_.brick_totals.empty() || stored_.budget.projection.method.starts_with("curvature")) return;

    const double projection = projection_of_file_, found = stored_.budget.projection.value;
    if (!(std::abs(found - projection) <= table_rounding * projection))
      out.push_back(fmt::format("the projection term is {}, not {}", f_.world(found), f_.world(projection)));
    const double value = stored_.budget.arithmetic.value,
                 least = same_device_ ? least_arithmetic_ : least_arithmetic_ - kept().errors({}).ramp;
    if (!(value >= least * (1 - table_rounding)))
      out.push_back(fmt::format("the arithmetic term is {}, below {}", f_.world(value), f_.world(least)));
    if (same_device_ && !is_of_six_taps() && !(value <= most_arithmetic_ * (1 + table_rounding)))
      out.push_back(
          fmt::format("the arithmetic term is {}, above {}", f_.world(value), f_.world(most_arithmetic_)));
  }

  void compare_largest(Differences& out, bool exhaustive) const {
    const double value = stored_.measured_max;
    if (!(value >= error_ - arithmetic() - arithmetic_of_build() - of_other_taps_) ||
        (exhaustive && !(value <= most_ + of_other_taps_)))
      out.push_back(fmt::format("measured_max is {}, not {}{}", f_.world(value),
                                exhaustive ? "" : "at least ", f_.world(error_)));
  }

  Filtered& f_;
  const MixedVolume& volume_;
  const Certificate& stored_;
  DeviceField field_;
  GoldRates gold_;
  bool same_device_;
  // What the arithmetic term is, whatever memory allows, and of another device whatever its precision.
  double least_arithmetic_ = 0, most_arithmetic_ = 0;
  double largest_ = 0;  // sample of the base
  double projection_of_file_ = 0, of_other_taps_ = 0;
  double error_ = 0;  // largest seen on the gold that certifies
  double most_ = 0;   // what measured_max can be
};

// All but the scan, F and what is reported in `units`.
void compare_in_units(Differences& out, Device& device, const ProjectionSet& scan, const Units& units,
                      const ExactField& exact, const MixedVolume& volume, const Certificate& stored,
                      const std::vector<std::uint8_t>& selected, bool exhaustive, const Progress& progress) {
  Filtered f(device.state(), scan, units, stored.field, stored.rates.interpolation, progress);
  const bool same_device = device.info().name == stored.device && device.info().driver == stored.driver;
  Totals totals(f, volume, stored, same_device);
  if (exhaustive || !stored.range_at)
    compare_range(out, f, exact, volume, stored, totals.kept(), same_device, progress);
  if (stored.range_at) compare_range_at(out, f, exact, volume, stored, totals.kept(), same_device);
  if (same_device && stored.version == VDVR_VERSION && stored.padding != f.scan.fft_length)
    out.push_back(fmt::format("field.padding is {}, not {}", stored.padding, f.scan.fft_length));
  totals.compare(out, selected, exhaustive, progress);
}

}  // namespace

Differences compare_terms(Device& device, const ProjectionSet& scan, const ExactField& exact,
                          const MixedVolume& volume, const Certificate& stored,
                          const std::vector<std::uint8_t>& selected, bool exhaustive,
                          const Progress& progress) {
  Differences out;
  HostMemory host(device.state());
  host.count(scan.data.resident_bytes(), "the projections, filtered,");
  host.count(4 * static_cast<std::uint64_t>(volume.grid.sample_count()), "the base samples");
  const Units units = units_of(scan);
  if (!units.are_world()) host.count(volume.base.bytes(), "the stored field in other units");
  std::optional<MixedVolume> scaled;
  if (!units.are_world()) {
    scaled = volume;
    scaled->grid = from_world(volume.grid, units);
    scale(*scaled, -units.density());
  }
  compare_in_units(out, device, scan, units, exact, scaled ? *scaled : volume, from_world(stored, units),
                   selected, exhaustive, progress);
  return out;
}

}  // namespace vdvr
