// Builds the certified volume: classify, extract, close, pack, then measure the packed field and repair until
// it holds (docs/error-bounds.md). Calls gold_stream.cpp and close_boundaries.cpp.
#include "vdvr/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host/bounds/covered_range.hpp"
#include "host/certify/build_journal.hpp"
#include "host/certify/choose_coarsening.hpp"
#include "host/certify/classify_bricks.hpp"
#include "host/certify/close_boundaries.hpp"
#include "host/certify/raise_levels.hpp"
#include "host/certify/result_units.hpp"
#include "host/fbp/reconstruct.hpp"
#include "host/gold/gold_stream.hpp"
#include "host/gold/worst_node.hpp"
#include "host/opencl/host_memory.hpp"
#include "host/sampler/sampler_terms.hpp"
#include "host/system/casts.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"
#include "vdvr/region_of_interest.hpp"

namespace vdvr {
namespace {

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

// All but the scan, and what is thrown, in `units`.
class Builder {
 public:
  Builder(Device& device, const ProjectionSet& scan, const Units& units, const Plan& plan,
          const BuildOptions& options, const Progress& progress)
      : state_(device.state()),
        units_(units),
        plan_(plan),
        progress_(progress),
        journal_(options.journal),
        host_(state_),
        watch_(seconds_) {
    const std::uint64_t cells =
        static_cast<std::uint64_t>(plan.grid.cells[0] * plan.grid.cells[1] * plan.grid.cells[2]);
    host_.count(8 * static_cast<std::uint64_t>(scan.size()), "the projections, as read and filtered,");
    host_.count(4 * (2 * plan.base.samples.size() + plan.fitted.size()), "the base samples");
    host_.count(8 * cells, "the slack of base cells");
    bricks_.grid = plan.grid;
    bricks_.granularity = plan.layout.granularity;
    bricks_.rate = plan.rates.gold;
    bricks_.coarsening = plan.layout.coarsening;
    bricks_.sampled = plan.settings.comparison.coefficients == Coefficients::sampled;
    choose_storage(options.storage);
    closing_ = plan.settings.comparison.closing;
    selected_ = bricks_of(options.roi, bricks_.grid, bricks_.granularity);
    bricks_.level.assign(selected_.size(), LevelTriple{0, 0, 0});
    bricks_.involved.assign(selected_.size(), 0);
    bricks_.samples.resize(selected_.size());
    if (std::find(selected_.begin(), selected_.end(), 1) == selected_.end())
      throw InputError("`roi` meets no brick of the grid");

    filtered_ = filter_projections(state_, scan, plan.field, progress, FilterMethod::automatic,
                                   Precision::fp64, units);
    upsampler_.emplace(state_, filtered_);
    watch_.lap("filter");
    sups_ = field_sups(state_, *upsampler_, filtered_);
    GoldSettings settings{plan.grid,
                          plan.layout.granularity,
                          plan.rates.gold,
                          plan.rates.upsampling,
                          plan.rates.interpolation,
                          options.window};
    settings.midrange = !bricks_.sampled;
    settings.anisotropic = plan.layout.levels == Levels::anisotropic && closing_ != Closing::paper;
    settings.grid_only = plan.settings.comparison.terms == Terms::grid;
    settings.coarsening = plan.layout.coarsening;
    settings.lattice = bricks_.lattice;
    gold_.emplace(state_, filtered_, *upsampler_, sups_, settings);
    node_test_.emplace(state_, *gold_, bricks_, host_, journal_, progress_,
                       [this](float slack, double tolerance) { refuse(slack, tolerance); });
    watch_.lap("bounds");
    probe_ = probe_sampler(device);
    watch_.lap("probe");
  }

  /// Puts the base on the lattice of integer samples; before it is measured.
  void choose_storage(StorageChoice storage) {
    bricks_.base = plan_.fitted.empty() ? take_base(plan_.base, plan_.layout.coarsening) : plan_.fitted;
    bricks_.lattice = choose_lattice(
        bricks_.base, storage, most_rounding(plan_.epsilon_abs, plan_.layout.levels == Levels::anisotropic),
        units_.density());
    round_base(bricks_.base, bricks_.lattice);
  }
  bool rounds() const { return bricks_.lattice.step > 0; }

  // The largest |V - gold| + T + P that leaves room for arithmetic and the device's samplers.
  double node_tolerance(const SamplerTerms& sampler) const {
    if (stream().settings().grid_only) return plan_.epsilon_abs;
    return plan_.epsilon_abs - arithmetic() -
           std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
  }

  void classify(double tolerance) {
    // Gold computed in two blocks differs by rounding; a brick at the gold rate must pass all the same. The
    // bound on rounding lies far above what is ever seen, and here nothing is promised: verification decides.
    double largest = 0;
    for (const float v : bricks_.base) largest = std::max(largest, std::fabs(static_cast<double>(v)));
    const double strict = tolerance - std::min(2 * arithmetic(), 0x1p-15 * largest);
    const DeviceField base(state_, as_mixed(bricks_.base, stream().settings()));
    node_test_->classify(base, strict, classified());
    watch_.lap("classify");
  }

  // Bricks that may hold a tested node.
  std::vector<std::uint8_t> classified() const {
    std::vector<std::uint8_t> near = stream().bricks_near_coverage();
    for (std::size_t i = 0; i < near.size(); ++i) near[i] = near[i] && selected_[i];
    return near;
  }

  // Closes, packs, measures; raises bricks until every node is within the tolerance.
  MixedVolume close_and_measure(double tolerance) {
    // Bricks that stay at level 0 were measured on the base samples while classifying, and closing does not
    // change those.
    std::vector<std::uint8_t> pending(bricks_.level.size());
    MixedVolume before;
    HostMemory closed(state_);
    for (int round = 0;; ++round) {
      // A repair compares with the volume before it.
      if (round < 2) closed.count(4 * bricks_.base.size() + node_test_->tile_bytes(), "the closed volume");
      MixedVolume volume = close_boundaries(bricks_, closing_);
      // Where integers round, a raised brick can change more than those it touches.
      const std::vector<std::uint8_t> changed =
          round > 0 ? changed_bricks(before, volume) : std::vector<std::uint8_t>(pending.size(), 1);
      for (std::size_t i = 0; i < pending.size(); ++i)
        pending[i] =
            bricks_.involved[i] && changed[i] && (round > 0 || volume.level[i] != LevelTriple{0, 0, 0});
      watch_.lap("close");
      const DeviceField field(state_, volume);
      node_test_->measure(field, volume.level, tolerance, pending, round == 0 ? "verify" : "repair");
      watch_.lap("verify");
      const std::vector<std::uint8_t> raised = raise_violating(tolerance);
      repaired_ += std::count(raised.begin(), raised.end(), 1);
      if (std::find(raised.begin(), raised.end(), 1) == raised.end()) {
        node_test_->sharpen(field, tolerance);
        watch_.lap("verify");
        return volume;
      }
      node_test_->extract(raised);
      watch_.lap("repair");
      before = std::move(volume);
    }
  }

  // The node at which the largest measure lies, on the gold that decided its brick. A brick's border can be
  // tested for its neighbours' sake alone, which computed by itself it does not show: then the brick's first
  // node.
  Vec3 worst_node(const MixedVolume& volume, const BrickMeasure& worst) {
    GoldStream& gold =
        gold_->coarse() && worst.rate != stream().settings().rate ? *gold_->coarse() : stream();
    std::vector<std::uint8_t> one(bricks_.level.size(), 0);
    one[at(worst.brick)] = 1;
    std::optional<Vec3> where;
    gold.run(
        one,
        [&](GoldStream::Batch& batch) { where = vdvr::worst_node(batch, volume, worst.brick, worst.rate); },
        {}, "worst");
    if (where) return *where;
    const Bricks bricks(volume.grid, volume.granularity);
    return volume.grid.position(bricks.first_cell(bricks.position(worst.brick)));
  }

  const std::vector<BrickMeasure>& measures() const { return node_test_->measures(); }
  const std::vector<std::uint8_t>& involved() const { return bricks_.involved; }
  const ClassifyBricks::Bounds& slack() const { return node_test_->bounds(); }
  const SamplerProbe& probe() const { return probe_; }
  const FilteredScan& filtered() const { return filtered_; }
  GoldStream& stream() { return gold_->fine(); }
  [[nodiscard]] const GoldStream& stream() const { return gold_->fine(); }
  [[nodiscard]] double arithmetic() const { return gold_->arithmetic(); }
  std::map<std::string, double>& seconds() { return seconds_; }
  std::int64_t repaired() const { return repaired_; }

 private:
  [[noreturn]] void refuse(float slack, double strict) const {
    const bool projection = this->slack().projection > this->slack().gold;
    throw ToleranceError(
        fmt::format("epsilon {:.4g} is out of reach at these rates: interpolating {} alone may err by {:.4g} "
                    "of the {:.4g} left for it; raise {} or allow at least {:.4g}",
                    to_world(plan_.epsilon_abs, units_), projection ? "the projections" : "gold",
                    to_world(static_cast<double>(slack), units_), to_world(strict, units_),
                    projection ? "`upsampling`, or take `u_filter` cubic," : "`gold`",
                    to_world(plan_.epsilon_abs + 1.1 * (static_cast<double>(slack) - strict), units_)));
  }

  // At the gold rate V is gold, but for the rounding of what is stored and of gold computed in other blocks.
  [[noreturn]] void refuse_stored(float total, double tolerance) const {
    const std::string found = fmt::format(
        "epsilon {:.4g} is out of reach: a brick at the gold rate may err by {:.4g} of the {:.4g} "
        "left for it, ",
        to_world(plan_.epsilon_abs, units_), to_world(static_cast<double>(total), units_),
        to_world(tolerance, units_));
    if (rounds())
      throw ToleranceError(found +
                           fmt::format("where integer samples round by up to {:.4g}; `storage` auto or "
                                       "f32 may do",
                                       to_world(0.5 * bricks_.lattice.step, units_)));
    throw ToleranceError(
        found +
        fmt::format("where rounding in fp32 moved gold; raise `gold` or allow at least "
                    "{:.4g}",
                    to_world(plan_.epsilon_abs + 1.1 * (static_cast<double>(total) - tolerance), units_)));
  }

  // Levels only rise. A brick that was found over the tolerance stays so until it changes: what was raised
  // for it can have been a neighbour whose samples round to what they were.
  std::vector<std::uint8_t> raise_violating(double tolerance) {
    std::vector<LevelTriple> to = bricks_.level;
    for (std::size_t i = 0; i < to.size(); ++i)
      if (bricks_.involved[i] && measures()[i].violated != 0 &&
          !raise_levels(bricks_, static_cast<std::int64_t>(i), measures()[i].violated,
                        gold_->fine().settings().anisotropic ? &node_test_->along()[i] : nullptr, to))
        refuse_stored(measures()[i].total, tolerance);
    std::vector<std::uint8_t> raised(bricks_.level.size(), 0);
    for (std::size_t i = 0; i < raised.size(); ++i) raised[i] = to[i] != bricks_.level[i];
    bricks_.level = std::move(to);
    return raised;
  }

  opencl::State& state_;
  Units units_;
  const Plan& plan_;
  const Progress& progress_;
  Journal* journal_;
  HostMemory host_;
  OpenBricks bricks_;
  Closing closing_ = Closing::coarse;
  std::vector<std::uint8_t> selected_;
  std::map<std::string, double> seconds_;
  Stopwatch watch_;
  FilteredScan filtered_;
  std::optional<Upsampler> upsampler_;
  FieldSups sups_;
  std::optional<GoldRates> gold_;
  std::optional<ClassifyBricks> node_test_;
  SamplerProbe probe_;
  std::int64_t repaired_ = 0;
};

Certificate certify(Builder& builder, Device& device, const ProjectionSet& scan, const Plan& plan,
                    const BuildOptions& options, const MixedVolume& volume, const SamplerTerms& sampler) {
  Certificate c;
  c.epsilon = plan.epsilon;
  c.epsilon_abs = plan.epsilon_abs;
  c.reference_range = plan.reference_range;
  const BrickMeasure* worst = nullptr;
  c.brick_totals.reserve(builder.measures().size());
  for (const BrickMeasure& m : builder.measures()) {
    // Two sums in fp32, and this product.
    c.brick_totals.push_back(m.total < 0 ? -1.0f : m.total * (1 + 0x1p-21f));
    if (m.total < 0) continue;
    c.measured_max = std::max(c.measured_max, static_cast<double>(m.error));
    if (!worst || m.total > worst->total) worst = &m;
  }
  if (worst) {
    c.measured_total = static_cast<double>(worst->total) * (1 + 0x1p-22);  // two sums in fp32
    c.worst_at = builder.worst_node(volume, *worst);
  }
  c.budget.grid = {c.measured_max, "measured at every tested gold node on the stored field"};
  c.budget.gold = {builder.slack().gold, "curvature: signed second differences of gold, with remainder"};
  c.budget.projection = {builder.slack().projection, plan.rates.interpolation == Interpolation::cubic
                                                         ? "curvature: signed sums of |q_uuuu| maxima"
                                                         : "curvature: signed sums of |q_uu| maxima"};
  c.budget.arithmetic = {builder.arithmetic(), "rounding in fp32 from the ramp filter to back-projection"};
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
  c.field.center = builder.filtered().geometry.center;
  c.padding = builder.filtered().fft_length;
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
  if (builder.repaired() > 0)
    c.notes.push_back(fmt::format("closing raised {} bricks by one level", builder.repaired()));
  return c;
}

// All but the scan, and what is thrown, in `units`.
BuildResult build_in_units(Device& device, const ProjectionSet& scan, const Units& units, const Plan& plan,
                           const BuildOptions& options, const Progress& progress) {
  Builder builder(device, scan, units, plan, options, progress);
  // The samplers' share is known only from the stored samples: reserve what the base volume suggests, and
  // more if that was short.
  const FieldSlopes base_slopes = field_slopes(as_mixed(plan.base));
  const double underflow = from_world(sampler_underflow(device.info()), units);
  SamplerTerms reserve = sampler_terms(base_slopes, plan.grid, builder.probe(), longest_atlas(device.info()),
                                       plan.epsilon_abs, plan.rates.gold, underflow);
  const auto scale = [](SamplerTerms& t, double f) {
    t.buffer.value *= f;
    if (t.image3d) t.image3d->value *= f;
  };
  scale(reserve, 1.25);
  for (int attempt = 0;; ++attempt) {
    const double tolerance = builder.node_tolerance(reserve);
    if (!(tolerance > 0)) {
      throw ToleranceError(
          fmt::format("epsilon {:.4g} is out of reach: rounding and samplers alone take {:.4g}",
                      to_world(plan.epsilon_abs, units), to_world(plan.epsilon_abs - tolerance, units)));
    }
    if (attempt == 0 && options.journal)
      options.journal->begin(journal_head(device, scan, plan, options, builder.stream(), tolerance));
    builder.classify(tolerance);
    BuildResult result;
    try {
      result.volume = builder.close_and_measure(tolerance);
    } catch (const ToleranceError&) {
      // Rounding can take what slack leaves at the gold rate, where nothing finer is left.
      if (!builder.rounds() || options.storage != StorageChoice::automatic) throw;
      builder.choose_storage(StorageChoice::f32);
      continue;
    }
    const SamplerTerms sampler = sampler_terms(field_slopes(result.volume), plan.grid, builder.probe(),
                                               atlas_length(device.info(), result.volume), plan.epsilon_abs,
                                               plan.rates.gold, underflow);
    result.certificate = certify(builder, device, scan, plan, options, result.volume, sampler);
    const bool holds = result.certificate.holds_buffer && result.certificate.holds_image3d.value_or(true);
    if (holds || attempt >= 2 || result.certificate.comparison) {
      result.seconds = builder.seconds();
      return result;
    }
    reserve = sampler;
    scale(reserve, 1.25);
  }
}

}  // namespace

BuildResult build(Device& device, const ProjectionSet& scan, const Plan& plan, const BuildOptions& options,
                  const Progress& progress) {
  check_line_integrals(scan);
  const Units units = units_of(scan);
  if (units.are_world()) return build_in_units(device, scan, units, plan, options, progress);
  BuildOptions wanted = options;
  if (options.roi) wanted.roi = from_world(*options.roi, units);
  if (options.window)
    wanted.window = {from_world(options.window->first, units), from_world(options.window->second, units)};
  BuildResult result = build_in_units(device, scan, units, from_world(plan, units), wanted, progress);
  scale(result.volume, units.density());
  result.volume.grid = plan.grid;
  result.certificate = to_world(std::move(result.certificate), units);
  return result;
}

}  // namespace vdvr
