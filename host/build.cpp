// Builds the certified volume: classify, extract, close, pack, then measure the packed field and repair until
// it holds (docs/error-bounds.md). Calls gold_stream.cpp and close_boundaries.cpp.
#include "vdvr/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>

#include "host/build_journal.hpp"
#include "host/close_boundaries.hpp"
#include "host/gold_stream.hpp"
#include "host/host_memory.hpp"
#include "host/reconstruct_field.hpp"
#include "host/sampler_terms.hpp"
#include "host/worst_node.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

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

// Bricks that meet the region of interest; all where there is none.
std::vector<std::uint8_t> bricks_in_roi(const OpenBricks& b,
                                        const std::optional<std::array<double, 6>>& roi) {
  const std::int64_t g = b.granularity;
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (b.grid.cells[a] + g - 1) / g;
  std::vector<std::uint8_t> selected(at(n[0] * n[1] * n[2]), 1);
  if (!roi) return selected;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const auto brick = static_cast<std::int64_t>(i);
    const Index3 p{brick % n[0], brick / n[0] % n[1], brick / n[0] / n[1]};
    for (std::size_t a = 0; a < 3; ++a) {
      const double low = b.grid.origin[a] + static_cast<double>(p[a] * g) * b.grid.spacing[a];
      const double high = b.grid.origin[a] +
                          static_cast<double>(std::min(b.grid.cells[a], (p[a] + 1) * g)) * b.grid.spacing[a];
      if (high < (*roi)[a] || low > (*roi)[a + 3]) selected[i] = 0;
    }
  }
  return selected;
}

// What the classification pass learns besides the levels.
struct Slack {
  double total = 0;       // largest T + P of a tested node
  double projection = 0;  // largest P
  double gold = 0;        // largest T
};

class Builder {
 public:
  Builder(Device& device, const ProjectionSet& scan, const Plan& plan, const BuildOptions& options,
          const Progress& progress)
      : state_(device.state()),
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
    bricks_.granularity = fitting_granularity(options.granularity, plan.grid);
    bricks_.rate = plan.gold_rate;
    bricks_.sampled = plan.settings.coefficients == "sampled";
    choose_storage(options.storage);
    closing_ = options.closing;
    selected_ = bricks_in_roi(bricks_, options.roi);
    bricks_.level.assign(selected_.size(), LevelTriple{0, 0, 0});
    bricks_.involved.assign(selected_.size(), 0);
    bricks_.samples.resize(selected_.size());
    if (std::find(selected_.begin(), selected_.end(), 1) == selected_.end())
      throw InputError("--roi meets no brick of the grid");

    filtered_ = filter_projections(state_, scan, plan.field, progress);
    measure_filter_error(filtered_, scan, plan.field);
    upsampler_.emplace(state_, filtered_);
    watch_.lap("filter");
    sups_ = field_sups(state_, *upsampler_, filtered_);
    GoldSettings settings{plan.grid,         bricks_.granularity, plan.gold_rate,
                          plan.upsampling_u, plan.u_filter,       options.window};
    settings.midrange = plan.settings.coefficients == "midrange";
    settings.grid_only = plan.settings.terms == "grid";
    stream_.emplace(state_, filtered_, *upsampler_, sups_, settings);
    watch_.lap("bounds");
    probe_ = probe_sampler(device);
    watch_.lap("probe");
  }

  /// Puts the base on the lattice of integer samples; before it is measured.
  void choose_storage(StorageChoice storage) {
    bricks_.base = plan_.fitted.empty() ? plan_.base.samples : plan_.fitted;
    bricks_.lattice = choose_lattice(bricks_.base, storage, most_rounding(plan_.epsilon_abs));
    round_base(bricks_.base, bricks_.lattice);
  }
  bool rounds() const { return bricks_.lattice.step > 0; }

  // The largest |V - gold| + T + P that leaves room for arithmetic and the device's samplers.
  double node_tolerance(const SamplerTerms& sampler) const {
    if (stream_->settings().grid_only) return plan_.epsilon_abs;
    return plan_.epsilon_abs - stream_->arithmetic() -
           std::max(sampler.buffer.value, sampler.image3d ? sampler.image3d->value : 0.0);
  }

  void classify(double tolerance) {
    // Gold computed in two blocks differs by rounding; a brick at the gold rate must pass all the same. The
    // bound on rounding lies far above what is ever seen, and here nothing is promised: verification decides.
    double largest = 0;
    for (const float v : bricks_.base) largest = std::max(largest, std::fabs(static_cast<double>(v)));
    const double strict = tolerance - std::min(2 * stream_->arithmetic(), 0x1p-15 * largest);
    const DeviceField base(state_, as_mixed({bricks_.grid, bricks_.base}, bricks_.granularity));
    const std::vector<std::uint8_t> near = classified();
    const opencl::DeviceArray<std::uint8_t> device_near(state_, std::span<const std::uint8_t>(near),
                                                        "bricks to classify");
    measures_.assign(bricks_.level.size(), {});
    stream_->run(near,
                 {[&](GoldStream::Batch& batch) {
                    return class_record(batch, batch.classify(base, static_cast<float>(strict), device_near));
                  },
                  [&](ByteReader in) { apply_classes(in, strict); }},
                 journal_, progress_, "classify", GoldStream::For::samples);
    watch_.lap("classify");
  }

  // Bricks that may hold a tested node.
  std::vector<std::uint8_t> classified() const {
    std::vector<std::uint8_t> near = stream_->bricks_near_coverage();
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
      if (round < 2) closed.count(4 * bricks_.base.size() + tile_bytes_, "the closed volume");
      MixedVolume volume = close_boundaries(bricks_, closing_);
      // Where integers round, a raised brick can change more than those it touches.
      const std::vector<std::uint8_t> changed =
          round > 0 ? changed_bricks(before, volume) : std::vector<std::uint8_t>(pending.size(), 1);
      for (std::size_t i = 0; i < pending.size(); ++i)
        pending[i] =
            bricks_.involved[i] && changed[i] && (round > 0 || volume.level[i] != LevelTriple{0, 0, 0});
      watch_.lap("close");
      const DeviceField field(state_, volume);
      const opencl::DeviceArray<std::uint8_t> device_pending(state_, std::span<const std::uint8_t>(pending),
                                                             "bricks to verify");
      stream_->run(
          pending,
          {[&](GoldStream::Batch& batch) {
             ByteWriter out;
             for (const BrickMeasure& m : batch.measure(field, static_cast<float>(tolerance), device_pending))
               put(out, m);
             return out.take();
           },
           [&](ByteReader in) {
             while (!in.empty()) {
               const BrickMeasure m = get_measure(in);
               measures_.at(at(m.brick)) = m;
             }
           }},
          journal_, progress_, round == 0 ? "verify" : "repair");
      watch_.lap("verify");
      const std::vector<std::uint8_t> raised = raise_violating(pending);
      repaired_ += std::count(raised.begin(), raised.end(), 1);
      if (std::find(raised.begin(), raised.end(), 1) == raised.end()) return volume;
      stream_->run(raised,
                   {[&](GoldStream::Batch& batch) {
                      Tiles tiles;
                      for (const std::int64_t id : batch.bricks())
                        tiles.emplace_back(id, bricks_.level[at(id)]);
                      ByteWriter out;
                      put_tiles(out, batch, tiles);
                      return out.take();
                    },
                    [&](ByteReader in) { take_tiles(in); }},
                   journal_, progress_, "repair", GoldStream::For::samples);
      watch_.lap("repair");
      before = std::move(volume);
    }
  }

  // The node at which the largest measure lies.
  Vec3 worst_node(const MixedVolume& volume, std::int64_t brick) {
    std::vector<std::uint8_t> one(bricks_.level.size(), 0);
    one[at(brick)] = 1;
    Vec3 where{};
    stream_->run(
        one, [&](GoldStream::Batch& batch) { where = vdvr::worst_node(batch, volume, brick); }, {}, "worst");
    return where;
  }

  const std::vector<BrickMeasure>& measures() const { return measures_; }
  const std::vector<std::uint8_t>& involved() const { return bricks_.involved; }
  const Slack& slack() const { return slack_; }
  const SamplerProbe& probe() const { return probe_; }
  const FilteredScan& filtered() const { return filtered_; }
  GoldStream& stream() { return *stream_; }
  std::map<std::string, double>& seconds() { return seconds_; }
  std::int64_t repaired() const { return repaired_; }

 private:
  [[noreturn]] void refuse(float slack, double strict) const {
    const bool projection = slack_.projection > slack_.gold;
    throw ToleranceError(
        fmt::format("epsilon {:.4g} is out of reach at these rates: interpolating {} alone may err by {:.4g} "
                    "of the {:.4g} left for it; raise {} or allow at least {:.4g}",
                    plan_.epsilon_abs, projection ? "the projections" : "gold", slack, strict,
                    projection ? "--upsampling, or take --u-filter cubic," : "--gold",
                    plan_.epsilon_abs + 1.1 * (static_cast<double>(slack) - strict)));
  }

  using Tiles = std::vector<std::pair<std::int64_t, LevelTriple>>;

  static LevelTriple triple(int level) {
    const auto l = static_cast<std::uint8_t>(level);
    return {l, l, l};
  }

  void put_tiles(ByteWriter& out, GoldStream::Batch& batch, const Tiles& tiles) const {
    std::vector<std::int64_t> bricks;
    std::vector<std::uint8_t> levels;
    for (const auto& [brick, level] : tiles) {
      bricks.push_back(brick);
      levels.push_back(level[0]);
    }
    out.put(bricks);
    out.put(levels);
    out.put(batch.extract(tiles));
  }

  void take_tiles(ByteReader& in) {
    const auto bricks = in.get_vector<std::int64_t>();
    const auto levels = in.get_vector<std::uint8_t>();
    const auto samples = in.get_vector<float>();
    auto next = samples.begin();
    const MixedVolume shape{bricks_.grid, bricks_.granularity, bricks_.rate, {}, {}, {}, {}, 0};
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      const std::int64_t size = shape.tile_size(triple(levels.at(i)));
      if (size > samples.end() - next)
        throw FileError("a journal record lacks samples; start without --resume");
      const auto end = next + size;
      std::vector<float>& tile = bricks_.samples.at(at(bricks[i]));
      const std::uint64_t more = 4 * static_cast<std::uint64_t>(size), less = 4 * tile.size();
      host_.count(more, "the tiles before closing");
      host_.uncount(less);
      tile_bytes_ += more - less;
      tile.assign(next, end);
      next = end;
    }
  }

  // What a batch's classes are, with the bounds behind them and the tiles that they ask for.
  Bytes class_record(GoldStream::Batch& batch, const std::vector<BrickClass>& classes) const {
    ByteWriter out;
    const auto p = batch.largest_p();
    Tiles tiles;
    out.put(static_cast<std::uint64_t>(classes.size()));
    for (std::size_t i = 0; i < classes.size(); ++i) {
      const BrickClass& c = classes[i];
      put(out, c.base);
      out.put(c.level);
      out.put(p[i].first);
      out.put(p[i].second);
      if (c.base.total >= 0 && c.level > 0) tiles.emplace_back(c.base.brick, triple(c.level));
    }
    put_tiles(out, batch, tiles);
    return out.take();
  }

  void apply_classes(ByteReader& in, double strict) {
    const auto n = in.get<std::uint64_t>();
    for (std::uint64_t i = 0; i < n; ++i) {
      const BrickMeasure base = get_measure(in);
      const auto level = in.get<int>();
      const auto largest_p = static_cast<double>(in.get<float>()),
                 smallest_p = static_cast<double>(in.get<float>());
      const std::size_t id = at(base.brick);
      bricks_.involved.at(id) = base.total >= 0;
      if (!bricks_.involved[id]) continue;
      measures_[id] = base;
      const auto slack = static_cast<double>(base.slack);
      slack_.total = std::max(slack_.total, slack);
      slack_.projection = std::max(slack_.projection, largest_p);
      slack_.gold = std::max(slack_.gold, slack - smallest_p);
      if (!(slack <= strict)) refuse(base.slack, strict);
      bricks_.level[id] = triple(level);
    }
    take_tiles(in);
  }

  // A violation on a shared part raises the coarser bricks there; any other raises the brick itself. Levels
  // only rise.
  std::vector<std::uint8_t> raise_violating(const std::vector<std::uint8_t>& pending) {
    const int top = std::countr_zero(static_cast<unsigned>(plan_.gold_rate));
    std::vector<std::uint8_t> raise(bricks_.level.size(), 0);
    for (std::size_t i = 0; i < pending.size(); ++i) {
      if (!pending[i] || measures_[i].violated == 0) continue;
      for (int part = 0; part < 27; ++part) {
        if (!(measures_[i].violated >> part & 1)) continue;
        const auto incident =
            incident_bricks(bricks_, static_cast<std::int64_t>(i), {part % 3, part / 3 % 3, part / 9});
        bool any_coarser = false;
        for (const std::int64_t j : incident)
          if (bricks_.level[at(j)][0] < bricks_.level[i][0]) {
            raise[at(j)] = 1;
            any_coarser = true;
          }
        if (any_coarser) continue;
        if (bricks_.level[i][0] == top) refuse(measures_[i].total, plan_.epsilon_abs);
        raise[i] = 1;
      }
    }
    for (std::size_t i = 0; i < raise.size(); ++i)
      if (raise[i]) bricks_.level[i] = triple(bricks_.level[i][0] + 1);
    return raise;
  }

  opencl::State& state_;
  const Plan& plan_;
  const Progress& progress_;
  Journal* journal_;
  HostMemory host_;
  std::uint64_t tile_bytes_ = 0;  // of bricks_.samples
  OpenBricks bricks_;
  Closing closing_ = Closing::coarse;
  std::vector<std::uint8_t> selected_;
  std::map<std::string, double> seconds_;
  Stopwatch watch_;
  FilteredScan filtered_;
  std::optional<Upsampler> upsampler_;
  FieldSups sups_;
  std::optional<GoldStream> stream_;
  SamplerProbe probe_;
  Slack slack_;
  std::vector<BrickMeasure> measures_;
  std::int64_t repaired_ = 0;
};

Certificate certify(Builder& builder, Device& device, const ProjectionSet& scan, const Plan& plan,
                    const BuildOptions& options, const MixedVolume& volume, const SamplerTerms& sampler) {
  Certificate c;
  c.epsilon = plan.epsilon;
  c.epsilon_abs = plan.epsilon_abs;
  c.reference_range = plan.reference_range;
  const BrickMeasure* worst = nullptr;
  for (const BrickMeasure& m : builder.measures()) {
    if (m.total < 0) continue;
    c.measured_max = std::max(c.measured_max, static_cast<double>(m.error));
    if (!worst || m.total > worst->total) worst = &m;
  }
  if (worst) {
    c.measured_total = static_cast<double>(worst->total) * (1 + 0x1p-22);  // two sums in fp32
    c.worst_at = builder.worst_node(volume, worst->brick);
  }
  c.budget.grid = {c.measured_max, "measured at every tested gold node on the stored field"};
  c.budget.gold = {builder.slack().gold, "curvature: signed second differences of gold, with remainder"};
  c.budget.projection = {builder.slack().projection, plan.u_filter == "cubic"
                                                         ? "curvature: signed sums of |q_uuuu| maxima"
                                                         : "curvature: signed sums of |q_uu| maxima"};
  c.budget.arithmetic = {builder.stream().arithmetic(),
                         "rounding in fp32 from the ramp filter to back-projection"};
  c.budget.sampler = sampler;
  c.total_buffer = c.measured_total + c.budget.arithmetic.value + sampler.buffer.value;
  c.comparison = is_comparison(plan.settings, options);
  c.holds_buffer = !c.comparison && c.total_buffer <= c.epsilon_abs;
  if (sampler.image3d) {
    c.total_image3d = c.measured_total + c.budget.arithmetic.value + sampler.image3d->value;
    c.holds_image3d = !c.comparison && *c.total_image3d <= c.epsilon_abs;
  }
  c.upsampling_u = plan.upsampling_u;
  c.u_filter = plan.u_filter;
  c.gold_rate = plan.gold_rate;
  c.bounds = plan.bounds;
  c.field = plan.field;
  c.field.center = builder.filtered().geometry.center;
  c.padding = builder.filtered().fft_length;
  c.window = options.window;
  c.roi = options.roi;
  c.not_covered_count = plan.not_covered_count;
  c.not_covered_fraction = plan.not_covered_fraction;
  c.not_covered_rule =
      "a point is covered when all its projections fall on the detector; samples more than two base-cell "
      "diagonals outside are stored as 0";
  c.input_name = scan.report.name;
  c.input_sha256 = scan.report.sha256;
  c.input_shape = {scan.geometry.views(), scan.geometry.rows, scan.geometry.columns};
  c.input_angles = scan.geometry.views();
  c.device = device.info().name;
  c.driver = device.info().driver;
  c.version = VDVR_VERSION;
  c.notes = plan.notes;
  if (c.comparison)
    c.notes.push_back(fmt::format("built for comparison with {}: nothing is certified",
                                  plan.settings.terms == "grid"
                                      ? "terms grid, which test |V - gold| alone"
                                      : "closing none, whose field is not continuous"));
  c.notes.push_back(
      "covers interpolation, not physics: noise, too few views, the filter window and truncation shape F "
      "itself");
  if (builder.repaired() > 0)
    c.notes.push_back(fmt::format("closing raised {} bricks by one level", builder.repaired()));
  return c;
}

}  // namespace

BuildResult build(Device& device, const ProjectionSet& scan, const Plan& plan, const BuildOptions& options,
                  const Progress& progress) {
  if (options.granularity != 1 && options.granularity != 2 && options.granularity != 4 &&
      options.granularity != 8)
    throw InputError(fmt::format("--granularity {} must be 1, 2, 4 or 8", options.granularity));
  Builder builder(device, scan, plan, options, progress);
  // The samplers' share is known only from the stored samples: reserve what the base volume suggests, and
  // more if that was short.
  const FieldSlopes base_slopes = field_slopes(as_mixed(plan.base));
  SamplerTerms reserve = sampler_terms(base_slopes, plan.grid, builder.probe(), longest_atlas(device.info()),
                                       plan.epsilon_abs, plan.gold_rate);
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
                      plan.epsilon_abs, plan.epsilon_abs - tolerance));
    }
    if (attempt == 0 && options.journal)
      options.journal->begin(journal_head(device, scan, plan, options, builder.stream(), tolerance));
    builder.classify(tolerance);
    BuildResult result;
    try {
      result.volume = builder.close_and_measure(tolerance);
    } catch (ToleranceError& e) {
      // Rounding can take what slack leaves at the gold rate, where nothing finer is left.
      if (!builder.rounds()) throw;
      if (options.storage != StorageChoice::automatic) {
        e.add_context("integer samples round: --storage auto or f32 may do");
        throw;
      }
      builder.choose_storage(StorageChoice::f32);
      continue;
    }
    const SamplerTerms sampler =
        sampler_terms(field_slopes(result.volume), plan.grid, builder.probe(),
                      atlas_length(device.info(), result.volume), plan.epsilon_abs, plan.gold_rate);
    result.certificate = certify(builder, device, scan, plan, options, result.volume, sampler);
    const bool holds = result.certificate.holds_buffer && result.certificate.holds_image3d.value_or(true);
    if (holds || attempt == 2 || is_comparison(plan.settings, options)) {
      result.seconds = builder.seconds();
      return result;
    }
    reserve = sampler;
    scale(reserve, 1.25);
  }
}

}  // namespace vdvr
