// Stratified sampling of bricks (docs/performance.md).
#include "host/certify/forecaster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/plan_parts.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t layers = 6, timed_blocks = 3;
// How many bricks a forecast looks at, and of a stratum at least: a few by the way.
struct SampleSize {
  double all = 480, of_stratum = 12;
};
constexpr SampleSize a_few{120, 3};
// Of a large grid: columns of blocks to look at, samples times views that may be back-projected for them, and
// kept nodes around a block.
constexpr double fewest_columns = 4, most_back_projected = 3e9, kept_around = 40;

// Middle columns: cells that a column of bricks is wide, and cells around what is looked at in
// which nodes are kept. Filters read seven at most, of the other five samples are fitted.
constexpr std::int64_t sampled_cells = 16;
constexpr double cells_around = 12;

// The larger signed sum of the second differences of base samples in each brick, an eighth of it: what
// trilinear interpolation of them may err by, if they resolved the field. They need not: it only sorts
// bricks.
std::vector<double> expected_error(const Volume& base, int granularity, const Index3& bricks) {
  const Index3 n = base.grid.samples();
  const auto value = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<double>(base.samples[at((z * n[1] + y) * n[0] + x)]);
  };
  std::vector<double> out(at(bricks[0] * bricks[1] * bricks[2]), 0.0);
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const double centre = 2 * value(x, y, z);
        double plus = 0, minus = 0;
        const auto add = [&](bool inside, double neighbours) {
          if (!inside) return;
          plus += std::max(0.0, neighbours - centre);
          minus += std::max(0.0, centre - neighbours);
        };
        const bool in_x = x > 0 && x + 1 < n[0], in_y = y > 0 && y + 1 < n[1], in_z = z > 0 && z + 1 < n[2];
        add(in_x, in_x ? value(x - 1, y, z) + value(x + 1, y, z) : 0);
        add(in_y, in_y ? value(x, y - 1, z) + value(x, y + 1, z) : 0);
        add(in_z, in_z ? value(x, y, z - 1) + value(x, y, z + 1) : 0);
        const auto brick = [&](std::int64_t i, std::size_t a) {
          return std::min(i / granularity, bricks[a] - 1);
        };
        double& e = out[at((brick(z, 2) * bricks[1] + brick(y, 1)) * bricks[0] + brick(x, 0))];
        e = std::max(e, std::max(plus, minus) / 8);
      }
  return out;
}

// One stratum per half octave of expected error over tolerance.
int stratum_of(double error, double tolerance) {
  return static_cast<int>(
      std::clamp(std::round(2 * std::log2(std::max(error / tolerance, 1e-9))), -8.0, 16.0));
}

// Tiles grow with the error to the power 3/2, and so does their spread.
double weight_of_stratum(int key) { return std::pow(2.0, 0.75 * key); }

// What becomes of a brick: level 0 by coarse gold, by fine or by finer, a tile from coarse gold (measured on
// it or on fine gold) or from fine.
enum Fate { coarse_stays, fine_stays, finer_stays, coarse_refined, proposed, fine_refined, fates };

struct Stratum {
  std::vector<std::int64_t> bricks, candidates;  // all, and those in the layers looked at
  double seen = 0, tile_samples = 0;
  std::array<double, fates> share{};  // of the bricks seen
};

// Whole blocks of the middle slab, at several radii.
std::vector<std::uint8_t> some_blocks(const GoldStream& stream, const Index3& n,
                                      const std::vector<std::uint8_t>& looked_at) {
  std::vector<std::uint8_t> selected(at(n[0] * n[1] * n[2]), 0);
  const Index3 block = stream.block_bricks();
  const std::int64_t z0 = n[2] / 2 / block[2] * block[2];
  // All blocks that are looked at, by their distance from the middle.
  std::vector<std::array<std::int64_t, 3>> blocks;
  for (std::int64_t y = 0; y < n[1]; y += block[1])
    for (std::int64_t x = 0; x < n[0]; x += block[0]) {
      const std::int64_t dx = 2 * x + block[0] - n[0], dy = 2 * y + block[1] - n[1];
      const std::int64_t middle_y = std::min(n[1] - 1, y + block[1] / 2),
                         middle_x = std::min(n[0] - 1, x + block[0] / 2);
      if (looked_at[at((z0 * n[1] + middle_y) * n[0] + middle_x)])
        blocks.push_back({dx * dx + dy * dy, y, x});
    }
  std::ranges::sort(blocks);
  const auto size = static_cast<std::int64_t>(blocks.size());
  // Ranks that stand for equal areas: blocks on the axis fit more than most.
  for (std::int64_t i = 0; i < timed_blocks && size > 0; ++i) {
    const auto& [distance, y0, x0] = blocks[at(size * (2 * i + 1) / (2 * timed_blocks))];
    for (std::int64_t z = z0; z < std::min(n[2], z0 + block[2]); ++z)
      for (std::int64_t y = y0; y < std::min(n[1], y0 + block[1]); ++y)
        for (std::int64_t x = x0; x < std::min(n[0], x0 + block[0]); ++x)
          selected[at((z * n[1] + y) * n[0] + x)] = looked_at[at((z * n[1] + y) * n[0] + x)];
  }
  return selected;
}

// How fast each stream was at each purpose; where one had nothing to do, nothing is foreseen for it either.
class Paces {
 public:
  explicit Paces(GoldRates& gold) : gold_(gold) { reset(); }
  // What was done before does not count.
  void reset() {
    const auto note = [&](const GoldStream& s) {
      for (const auto purpose :
           {GoldStream::For::samples, GoldStream::For::measuring, GoldStream::For::proposing})
        before_[{s.settings().rate, purpose}] = s.spent(purpose);
    };
    note(gold_.fine());
    if (gold_.coarse()) note(*gold_.coarse());
    if (gold_.finer()) note(*gold_.finer());
  }
  double seconds(GoldStream& s, GoldStream::For purpose, const std::vector<std::uint8_t>& bricks) {
    return pace(s, purpose) * s.samples(bricks, purpose);
  }
  /// Seconds a sample.
  double pace(const GoldStream& s, GoldStream::For purpose) {
    GoldSpent spent = s.spent(purpose);
    spent -= before_[{s.settings().rate, purpose}];
    return spent.seconds / std::max(1.0, spent.samples);
  }

 private:
  GoldRates& gold_;
  std::map<std::pair<int, GoldStream::For>, GoldSpent> before_;
};

// The strata of the bricks, and which of them to look at.
std::map<int, Stratum> strata_of(const std::vector<std::uint8_t>& near,
                                 const std::vector<std::uint8_t>& looked_at, const std::vector<double>& error,
                                 const NodeTolerance& tolerance, const Index3& n, bool all_layers,
                                 const SampleSize& size) {
  const std::int64_t some = all_layers ? n[2] : std::min(layers, n[2]);
  std::vector<std::uint8_t> in_layer(at(n[2]), 0);
  for (std::int64_t i = 0; i < some; ++i) in_layer[at((2 * i + 1) * n[2] / (2 * some))] = 1;
  std::map<int, Stratum> strata;
  for (std::size_t i = 0; i < near.size(); ++i) {
    if (!near[i]) continue;
    Stratum& s = strata[stratum_of(error[i], tolerance.of(i))];
    s.bricks.push_back(static_cast<std::int64_t>(i));
    if (looked_at[i] && in_layer[at(static_cast<std::int64_t>(i) / (n[0] * n[1]))])
      s.candidates.push_back(static_cast<std::int64_t>(i));
  }
  const auto excess = [&](std::int64_t i) { return error[at(i)] / tolerance.of(at(i)); };
  // Sampled in proportion to their spread (Neyman).
  const auto weight = [](int key, const Stratum& s) {
    return static_cast<double>(s.bricks.size()) * weight_of_stratum(key);
  };
  double all_weights = 0;
  for (const auto& [key, s] : strata) all_weights += weight(key, s);
  std::mt19937 random(1);
  for (auto& [key, s] : strata) {
    std::shuffle(s.candidates.begin(), s.candidates.end(), random);
    const double wanted = std::max(size.of_stratum, size.all * weight(key, s) / all_weights);
    s.candidates.resize(std::min(s.candidates.size(), static_cast<std::size_t>(wanted)));
    // Bricks that err more, for what they may, lie together, as those that are refined do.
    std::stable_sort(s.bricks.begin(), s.bricks.end(),
                     [&](std::int64_t a, std::int64_t b) { return excess(a) > excess(b); });
  }
  return strata;
}

// The column of blocks that holds a place, in shares of the grid.
void choose_column(std::vector<std::uint8_t>& chosen, const Index3& n, const Index3& block,
                   const std::array<double, 2>& place) {
  const auto first = [&](std::size_t a) {
    return std::min(static_cast<std::int64_t>(place[a] * static_cast<double>(n[a])), n[a] - 1) / block[a] *
           block[a];
  };
  for (std::int64_t y = first(1); y < std::min(n[1], first(1) + block[1]); ++y)
    for (std::int64_t x = first(0); x < std::min(n[0], first(0) + block[0]); ++x)
      chosen[at(y * n[0] + x)] = 1;
}

std::vector<std::uint8_t> bricks_of_columns(std::vector<std::uint8_t> near,
                                            const std::vector<std::uint8_t>& chosen) {
  for (std::size_t i = 0; i < near.size(); ++i) near[i] = near[i] && chosen[i % chosen.size()];
  return near;
}

}  // namespace

std::vector<std::uint8_t> bricks_to_look_at(GoldStream& stream, const ParallelGeometry& geometry) {
  const GoldSettings& settings = stream.settings();
  const Index3 n = Bricks(settings.grid, settings.granularity).along(), block = stream.block_bricks();
  std::vector<std::uint8_t> near = stream.bricks_near_coverage();
  // Back-projected samples of a column of blocks: nodes at twice the cells, with what their filters and fits
  // read around them.
  const auto side = [&](std::size_t a) {
    return 2 * static_cast<double>(block[a] * settings.granularity) + 2 * kept_around;
  };
  const double of_column = side(0) * side(1) * static_cast<double>(geometry.rows * geometry.views());
  const auto blocks = [&](std::size_t a) { return (n[a] + block[a] - 1) / block[a]; };
  const auto columns = static_cast<double>(blocks(0) * blocks(1));
  const auto wanted = static_cast<std::int64_t>(std::max(fewest_columns, most_back_projected / of_column));
  if (static_cast<double>(wanted) >= 0.5 * columns) return near;
  std::vector<std::uint8_t> chosen(at(n[0] * n[1]), 0);
  for (std::int64_t i = 0; i < wanted; ++i) {
    // Turning by the golden angle spreads points evenly over a disc.
    const double r = 0.5 * std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(wanted)),
                 angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    choose_column(chosen, n, block, {0.5 + r * std::cos(angle), 0.5 + r * std::sin(angle)});
  }
  return bricks_of_columns(std::move(near), chosen);
}

SampledColumns::SampledColumns(const Volume& base, const std::vector<std::uint8_t>& near, int granularity,
                               double tolerance)
    : grid_(base.grid), granularity_(granularity) {
  const Index3 n = Bricks(grid_, granularity).along();
  const std::vector<double> error = expected_error(base, granularity, n);
  // By column, how many bricks there are of every stratum.
  std::vector<std::map<int, double>> columns(at(n[0] * n[1]));
  for (std::size_t i = 0; i < error.size(); ++i)
    if (near[i]) columns[i % columns.size()][stratum_of(error[i], tolerance)] += 1;
  const auto add = [](std::map<int, double>& to, const std::map<int, double>& more) {
    for (const auto& [key, bricks] : more) to[key] += bricks;
  };
  const auto size = [](const std::map<int, double>& strata) {
    double sum = 0;
    for (const auto& [key, bricks] : strata) sum += bricks;
    return std::max(1.0, sum);
  };
  std::map<int, double> all;
  for (const auto& column : columns) add(all, column);
  const std::int64_t width = std::min(n[1], std::max<std::int64_t>(1, sampled_cells / granularity)),
                     length = (n[0] + 1) / 2;
  double least = HUGE_VAL;
  for (std::int64_t y = 0; y + width <= n[1]; ++y)
    for (std::int64_t x = 0; x + length <= n[0]; ++x) {
      std::map<int, double> here;
      for (std::int64_t j = y; j < y + width; ++j)
        for (std::int64_t i = x; i < x + length; ++i) add(here, columns[at(j * n[0] + i)]);
      double unlike = 0;
      for (const auto& [key, bricks] : all)
        unlike += weight_of_stratum(key) * std::abs(here[key] / size(here) - bricks / size(all));
      if (!(unlike < least)) continue;
      least = unlike;
      first = {x, y};
      end = {x + length, y + width};
    }
}

std::vector<std::uint8_t> SampledColumns::of(std::vector<std::uint8_t> near) const {
  const Index3 n = Bricks(grid_, granularity_).along();
  for (std::int64_t i = 0; i < std::ssize(near); ++i) {
    const std::int64_t x = i % n[0], y = i / n[0] % n[1];
    if (x < first[0] || x >= end[0] || y < first[1] || y >= end[1]) near[at(i)] = 0;
  }
  return near;
}

bool SampledColumns::is_worth_it() const {
  double of_part = 1, of_all = 1;
  for (std::size_t a = 0; a < 2; ++a) {
    of_part *= static_cast<double>((end[a] - first[a]) * granularity_) + 2 * cells_around;
    of_all *= static_cast<double>(grid_.cells[a]) + 2 * cells_around;
  }
  return of_part < of_all / 3;
}

PlanePart SampledColumns::part() const {
  PlanePart out;
  for (std::size_t a = 0; a < 2; ++a) {
    const auto place = [&](std::int64_t brick, double more) {
      return grid_.origin[a] + (static_cast<double>(brick * granularity_) + more) * grid_.spacing[a];
    };
    out.low[a] = place(first[a], -cells_around);
    out.high[a] = place(end[a], cells_around);
  }
  return out;
}

// A brick that was classified to see what becomes of it.
struct Forecaster::Classified {
  double samples = 0;  // of its tile
  BrickMeasure measure;
  bool easy = false;  // measured on coarse gold first

  [[nodiscard]] Fate fate(int fine_rate) const {
    const bool fine = measure.rate >= fine_rate;
    if (samples > 0) return fine ? fine_refined : easy ? coarse_refined : proposed;
    return measure.rate > fine_rate ? finer_stays : fine ? fine_stays : coarse_stays;
  }
};

Forecaster::Forecaster(std::shared_ptr<PreparedScan> prepared, const GoldSettings& settings,
                       const Volume& base, std::vector<float> stored, std::vector<std::uint8_t> looked_at)
    : prepared_(std::move(prepared)),
      gold_(prepared_->state, prepared_->filtered, prepared_->sups, settings, prepared_->source(settings)),
      stored_(std::move(stored)),
      looked_at_(std::move(looked_at)),
      near_(gold_.fine().bricks_near_coverage()),
      error_(expected_error(base, settings.granularity, Bricks(settings.grid, settings.granularity).along())),
      base_samples_(std::ssize(base.samples)),
      field_(prepared_->state, as_mixed(stored_, gold_.fine().settings())) {}

std::vector<Forecaster::Classified> Forecaster::classify(const NodeTolerance& tolerance,
                                                         const std::vector<std::uint8_t>& selected) {
  const GoldSettings& settings = gold_.fine().settings();
  OpenBricks bricks;
  bricks.grid = settings.grid;
  bricks.granularity = settings.granularity;
  bricks.rate = settings.rate;
  bricks.coarsening = settings.coarsening;
  bricks.sampled = false;
  bricks.level.assign(near_.size(), LevelTriple{0, 0, 0});
  bricks.involved.assign(near_.size(), 0);
  bricks.samples.resize(near_.size());
  JournalledRates unrecorded(gold_);
  HostMemory host(prepared_->state);
  ClassifyBricks test(unrecorded, bricks, host, {}, [](float, double) {});
  test.classify(field_, tolerance, selected);
  std::vector<Classified> out;
  const MixedVolume shape = bricks.shape();
  for (std::size_t i = 0; i < near_.size(); ++i)
    out.push_back({bricks.level[i] == LevelTriple{0, 0, 0}
                       ? 0.0
                       : static_cast<double>(shape.tile_size(bricks.level[i])),
                   test.measures()[i], test.is_easy(i, tolerance.of(i))});
  return out;
}

// One brick builds the kernels; then whole blocks tell the pace of the first pass.
double Forecaster::first_pass_seconds(const NodeTolerance& tolerance) {
  std::vector<std::uint8_t> one(near_.size(), 0);
  // The middle one of those that are looked at.
  std::int64_t before = std::count(looked_at_.begin(), looked_at_.end(), 1) / 2;
  for (std::size_t i = 0; i < one.size() && before >= 0; ++i)
    if (looked_at_[i] && before-- == 0) one[i] = 1;
  classify(tolerance, one);
  const GoldSettings& settings = gold_.fine().settings();
  const bool screens = gold_.coarse() != nullptr;
  GoldStream& first = screens ? *gold_.coarse() : gold_.fine();
  const auto purpose = screens ? GoldStream::For::measuring : GoldStream::For::samples;
  Paces large(gold_);
  classify(tolerance, some_blocks(first, Bricks(settings.grid, settings.granularity).along(), looked_at_));
  return large.seconds(first, purpose, near_);
}

NodeTolerance Forecaster::in_own_units(NodeTolerance tolerance) const {
  const Units& units = prepared_->of.units;
  tolerance.of_all = from_world(tolerance.of_all, units);
  for (float& one : tolerance.by_brick) one = static_cast<float>(from_world(static_cast<double>(one), units));
  return tolerance;
}

// What becomes of every brick, from some of every stratum.
struct Forecaster::Fates {
  double tile_samples = 0;
  std::array<std::vector<std::uint8_t>, fates> bricks;
};

Forecaster::Fates Forecaster::foresee(const NodeTolerance& tolerance, bool by_the_way) {
  const GoldSettings& settings = gold_.fine().settings();
  const Index3 n = Bricks(settings.grid, settings.granularity).along();
  std::map<int, Stratum> strata = strata_of(near_, looked_at_, error_, tolerance, n,
                                            settings.part.has_value(), by_the_way ? a_few : SampleSize{});
  std::vector<std::uint8_t> sampled(near_.size(), 0);
  for (const auto& [key, s] : strata)
    for (const std::int64_t i : s.candidates) sampled[at(i)] = 1;
  const auto classes = classify(tolerance, sampled);
  if (!by_the_way) measured_.clear();
  for (auto& [key, s] : strata)
    for (const std::int64_t i : s.candidates) {
      const Classified& c = classes[at(i)];
      if (c.measure.total >= 0 && !by_the_way) measured_.push_back(c.measure);
      s.seen += 1;
      s.tile_samples += c.samples;
      if (c.measure.total >= 0) s.share[c.fate(settings.rate)] += 1;
    }
  // A stratum without a brick in the layers takes after the one below it.
  Fates out;
  for (auto& b : out.bricks) b.assign(near_.size(), 0);
  double mean = 0;
  std::array<double, fates> share{};
  for (const auto& [key, s] : strata) {
    if (s.seen > 0) {
      mean = s.tile_samples / s.seen;
      for (std::size_t f = 0; f < fates; ++f) share[f] = s.share[f] / s.seen;
    }
    out.tile_samples += mean * static_cast<double>(s.bricks.size());
    std::size_t next = 0;
    for (const Fate fate : {fine_refined, proposed, coarse_refined, finer_stays, fine_stays})
      for (double i = 0; i < share[fate] * static_cast<double>(s.bricks.size()) && next < s.bricks.size();
           ++i)
        out.bricks[fate][at(s.bricks[next++])] = 1;
  }
  return out;
}

double Forecaster::ratio_of(const Fates& foreseen) const {
  return (static_cast<double>(stored_.size()) + static_cast<double>(near_.size()) + foreseen.tile_samples) /
         static_cast<double>(base_samples_);
}

double Forecaster::samples_ratio(const NodeTolerance& tolerance, bool by_the_way) {
  return ratio_of(foresee(in_own_units(tolerance), by_the_way));
}

BuildForecast Forecaster::forecast(const NodeTolerance& wanted) {
  const NodeTolerance tolerance = in_own_units(wanted);
  const double first_pass = first_pass_seconds(tolerance);
  Paces small(gold_);
  Fates foreseen = foresee(tolerance, false);
  auto& bricks = foreseen.bricks;
  tile_pace_ = small.pace(gold_.fine(), GoldStream::For::samples);
  measure_pace_ = small.pace(gold_.fine(), GoldStream::For::measuring);
  BuildForecast out;
  out.samples_ratio = ratio_of(foreseen);
  out.tile_bytes = static_cast<std::uint64_t>(4 * foreseen.tile_samples);
  add_kept(out);
  out.seconds = first_pass + out.kept_seconds;
  const auto add = [&](GoldStream& gold, GoldStream::For purpose, const std::vector<std::uint8_t>& of) {
    out.seconds += small.seconds(gold, purpose, of);
  };
  using For = GoldStream::For;
  std::vector<std::uint8_t> hard = bricks[proposed];
  for (std::size_t i = 0; i < hard.size(); ++i) hard[i] = hard[i] || bricks[fine_refined][i];
  if (gold_.coarse() != nullptr) {
    GoldStream& coarse = *gold_.coarse();
    for (const Fate stays : {fine_stays, finer_stays}) add(gold_.fine(), For::measuring, bricks[stays]);
    if (gold_.finer()) add(*gold_.finer(), For::measuring, bricks[finer_stays]);
    add(coarse, For::samples, bricks[coarse_refined]);
    add(coarse, For::proposing, hard);
    add(gold_.fine(), For::samples, bricks[fine_refined]);
    // Verification.
    add(coarse, For::measuring, bricks[coarse_refined]);
  }
  add(gold_.fine(), For::measuring, hard);
  return out;
}

// What will be kept and was not needed so far.
void Forecaster::add_kept(BuildForecast& out) {
  KeptGold& kept = gold_.fine().source()->kept;
  const auto tiles = static_cast<double>(std::max<std::int64_t>(1, kept.tiles()));
  KeptGold::Shares shares = kept.all_over_part();
  if (!gold_.fine().settings().part) {
    const auto missing = static_cast<double>(gold_.fine().missing_tiles(near_, GoldStream::For::samples));
    shares.columns = shares.tiles = (static_cast<double>(kept.tiles()) + missing) / tiles;
  }
  out.kept_bytes = static_cast<std::uint64_t>(static_cast<double>(kept.bytes()) * (shares.tiles - 1));
  out.kept_seconds = kept.column_seconds() + kept.tile_seconds() * shares.columns;
}

std::vector<BrickMeasure> Forecaster::measured() const {
  std::vector<BrickMeasure> out = measured_;
  for (BrickMeasure& m : out)
    for (float* value : {&m.error, &m.slack})
      *value = static_cast<float>(to_world(static_cast<double>(*value), prepared_->of.units));
  return out;
}

IntegerLattice Forecaster::lattice(const Plan& plan, StorageChoice storage,
                                   const FilterErrors& filters) const {
  return lattice_of(stored_, from_world(plan.epsilon_abs, prepared_->of.units), plan.layout,
                    prepared_->of.units, storage, filters);
}

double Forecaster::repair_seconds(const std::vector<std::uint8_t>& raises) {
  double seconds = 0;
  const std::uint8_t most =
      raises.empty() ? std::uint8_t{0} : *std::max_element(raises.begin(), raises.end());
  // Where the sample measured nothing on fine gold: what extraction takes bounds it.
  const double measuring = measure_pace_ > 0 ? measure_pace_ : tile_pace_;
  for (std::uint8_t round = 1; round <= most; ++round) {
    std::vector<std::uint8_t> raised(raises.size(), 0);
    for (std::size_t i = 0; i < raised.size(); ++i) raised[i] = raises[i] >= round ? 1 : 0;
    seconds += tile_pace_ * gold_.fine().samples(raised, GoldStream::For::samples) +
               measuring * gold_.fine().samples(raised, GoldStream::For::measuring);
  }
  return seconds;
}

std::uint64_t memory_of_tiles(std::uint64_t tiles, std::uint64_t limit, bool on_gpu) {
  const std::uint64_t eighth = limit / 8;
  if (limit == 0 || tiles <= eighth) return 3 * tiles;
  return 2 * eighth + (on_gpu ? tiles : 0);
}

}  // namespace vdvr
