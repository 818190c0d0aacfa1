// The node test at several rates of gold against the fine rate alone: what any of them accepts is within the
// tolerance.
#define BOOST_TEST_MODULE classify_bricks
#include "host/certify/classify_bricks.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "host/certify/closing/close_boundaries.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {
namespace {

using testing::noise_scan;
using testing::simulated;

Grid grid_around_axis(const Index3& cells, double spacing) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = {spacing, spacing, spacing};
  for (std::size_t a = 0; a < 3; ++a) grid.origin[a] = -0.5 * spacing * static_cast<double>(cells[a]);
  return grid;
}

// A build up to its levels, measured once more on the fine gold.
struct Case {
  Case(const ProjectionSet& scan, const Grid& grid, int rate, double tolerance_of_range,
       bool anisotropic = false, std::uint64_t heights_bytes = std::uint64_t{1} << 30)
      : chain(scan),
        state(attacks::device().state()),
        base(reconstruct_field(state, chain.filtered, chain.upsampler, grid, 8, Interpolation::six_taps, {})),
        host(state),
        gold(state, chain.filtered, chain.sups, settings_of(grid, rate, anisotropic, heights_bytes)),
        unrecorded(gold),
        classify(unrecorded, bricks, host, {},
                 [](float, double) { throw std::runtime_error("even gold is too far from F"); }) {
    const auto [low, high] = std::minmax_element(base.samples.begin(), base.samples.end());
    tolerance = tolerance_of_range * static_cast<double>(*high - *low);
    const GoldSettings& s = gold.fine().settings();
    const std::vector<std::uint8_t> near = gold.fine().bricks_near_coverage();
    bricks = {grid, s.granularity, s.rate, {}, base.samples, {}, {}, {}, {}, false, {}};
    bricks.level.assign(near.size(), LevelTriple{0, 0, 0});
    bricks.involved.assign(near.size(), 0);
    bricks.samples.resize(near.size());
    const DeviceField field(state, as_mixed(base, s.granularity));
    classify.classify(field, tolerance, near);
    decided = classify.measures();
    classify.sharpen(field, tolerance);
    fine = measured_by(gold.fine(), near);
  }
  // Of the base samples.
  std::vector<BrickMeasure> measured_by(GoldStream& stream, const std::vector<std::uint8_t>& wanted) {
    const DeviceField field(state, as_mixed(base, stream.settings().granularity));
    const opencl::DeviceArray<std::uint8_t> selected(state, std::span<const std::uint8_t>(wanted), "bricks");
    std::vector<BrickMeasure> out(wanted.size());
    stream.run(
        wanted,
        [&](GoldStream::Batch& batch) {
          for (const BrickMeasure& m : batch.measure(field, static_cast<float>(tolerance), selected))
            out[static_cast<std::size_t>(m.brick)] = m;
        },
        {}, "measure");
    return out;
  }
  static GoldSettings settings_of(const Grid& grid, int rate, bool anisotropic = false,
                                  std::uint64_t heights_bytes = std::uint64_t{1} << 30) {
    GoldSettings s{grid, 2, rate, 8, Interpolation::six_taps};
    s.midrange = true;
    s.anisotropic = anisotropic;
    s.heights_bytes = heights_bytes;
    return s;
  }
  [[nodiscard]] bool stays(std::size_t i) const {
    return bricks.involved[i] && bricks.level[i] == LevelTriple{0, 0, 0};
  }

  attacks::Chain chain;
  opencl::State& state;
  Volume base;
  HostMemory host;
  GoldRates gold;
  JournalledRates unrecorded;
  OpenBricks bricks;
  ClassifyBricks classify;
  double tolerance = 0;
  std::vector<BrickMeasure> decided, fine;
};

// Rounding of gold and of the sampler differs between blocks of different sizes.
double rounding(Case& c) { return 2 * c.gold.fine().arithmetic(); }

// Returns how many bricks coarse gold decided.
std::size_t check(const ProjectionSet& scan, const Grid& grid, int rate, double tolerance_of_range) {
  Case c(scan, grid, rate, tolerance_of_range);
  BOOST_REQUIRE(c.gold.coarse() != nullptr);
  std::size_t by_coarse = 0, refined = 0;
  double largest = 0, reported = 0;
  for (std::size_t i = 0; i < c.decided.size(); ++i) {
    if (!c.bricks.involved[i]) continue;
    const BrickMeasure& m = c.decided[i];
    if (!c.stays(i)) {
      ++refined;
      // Refined because the fine test fails, too. (Slack at a brick's border grows with the block around it.)
      BOOST_TEST(static_cast<double>(c.fine[i].total) > c.tolerance - rounding(c));
      continue;
    }
    BOOST_TEST(static_cast<double>(m.total) <= c.tolerance);
    if (m.rate < rate) {
      ++by_coarse;
      // The theorem of the coarse rate speaks of the fine nodes too.
      BOOST_TEST(static_cast<double>(c.fine[i].error) <= static_cast<double>(m.total) + rounding(c));
    }
    largest = std::max(largest, static_cast<double>(c.fine[i].error));
    // Finer gold has all nodes of the fine, and others.
    if (m.rate > rate) largest = std::max(largest, static_cast<double>(m.error));
    const BrickMeasure& last = c.classify.measures()[i];
    if (last.rate >= rate) reported = std::max(reported, static_cast<double>(last.error));
  }
  BOOST_TEST_MESSAGE(by_coarse << " bricks by coarse gold, " << refined << " refined of "
                               << c.decided.size());
  BOOST_TEST(std::abs(largest - reported) <= rounding(c));
  return by_coarse;
}

// Each rate bounds |V - F| by itself: nothing is held in reserve for the finer one.
BOOST_AUTO_TEST_CASE(a_brick_that_passes_at_one_rate_has_passed) {
  BrickMeasure m;
  m.total = 0.5f;
  m.slack = 0.4f;
  m.error = 0.1f;
  BOOST_TEST((verdict_of(m, 0.5) == Verdict::within));
  BOOST_TEST((verdict_of(m, 0.499) == Verdict::undecided));
  m.error = 0.499f;
  BOOST_TEST((verdict_of(m, 0.49) == Verdict::beyond));
}

BOOST_AUTO_TEST_CASE(what_coarse_gold_accepts_of_noise_is_within_the_tolerance) {
  const ProjectionSet scan = noise_scan(20, 14, 17, 5);
  for (const int rate : {4, 8, 16})
    for (const double share : {0.1, 0.15, 0.25})
      check(scan, grid_around_axis({10, 10, 11}, 0.7), rate, share);
}

BOOST_AUTO_TEST_CASE(what_finer_gold_accepts_is_within_the_tolerance) {
  const ProjectionSet scan = noise_scan(20, 14, 17, 5);
  std::int64_t all = 0;
  for (const double share : {0.12, 0.16, 0.2, 0.24, 0.28}) {
    Case c(scan, grid_around_axis({10, 10, 11}, 0.7), 8, share);
    BOOST_REQUIRE(c.gold.finer() != nullptr);
    std::vector<std::uint8_t> by_finer(c.decided.size(), 0), refined(c.decided.size(), 0);
    for (std::size_t i = 0; i < c.decided.size(); ++i) {
      if (!c.bricks.involved[i]) continue;
      refined[i] = !c.stays(i);
      by_finer[i] = c.stays(i) && c.decided[i].rate > 8;
    }
    all += std::count(by_finer.begin(), by_finer.end(), 1);
    GoldSettings dense = c.gold.fine().settings();
    dense.rate = 64;
    GoldStream truth(c.state, c.chain.filtered, c.chain.sups, dense, c.gold.fine().source());
    const std::vector<BrickMeasure> errors = c.measured_by(truth, by_finer);
    for (std::size_t i = 0; i < by_finer.size(); ++i) {
      if (!by_finer[i]) continue;
      BOOST_TEST(static_cast<double>(c.fine[i].total) > c.tolerance - rounding(c));
      BOOST_TEST(static_cast<double>(c.decided[i].total) <= c.tolerance);
      BOOST_TEST(static_cast<double>(errors[i].error) <=
                 static_cast<double>(c.decided[i].total) + rounding(c));
    }
    // What is refined fails there, too.
    const std::vector<BrickMeasure> finest = c.measured_by(*c.gold.finer(), refined);
    for (std::size_t i = 0; i < refined.size(); ++i)
      if (refined[i]) BOOST_TEST(static_cast<double>(finest[i].total) > c.tolerance - rounding(c));
  }
  BOOST_TEST(all > 4);
}

// Where heights of all rows are too many for all blocks, a band of them goes through all tests before the
// next.
BOOST_AUTO_TEST_CASE(bands_decide_what_all_blocks_together_do) {
  const ProjectionSet scan = noise_scan(20, 45, 17, 5);
  const Grid grid = grid_around_axis({6, 6, 40}, 0.7);
  Case together(scan, grid, 16, 0.15, true), bands(scan, grid, 16, 0.15, true, 1);
  BOOST_TEST(together.gold.fine().source()->kept.cells_together() == 40);
  BOOST_TEST(bands.gold.fine().source()->kept.cells_together() == 1);
  BOOST_TEST((bands.bricks.level == together.bricks.level));
  BOOST_TEST((bands.bricks.involved == together.bricks.involved));
  BOOST_TEST((bands.bricks.samples == together.bricks.samples));
  std::int64_t above = 0;
  for (std::size_t i = 0; i < together.decided.size(); ++i) {
    above += together.bricks.level[i] != LevelTriple{0, 0, 0};
    BOOST_TEST(bands.decided[i].total == together.decided[i].total);
    BOOST_TEST(bands.decided[i].rate == together.decided[i].rate);
  }
  BOOST_TEST(above > 0);
}

BOOST_AUTO_TEST_CASE(what_coarse_gold_accepts_of_phantoms_is_within_the_tolerance) {
  const ProjectionSet lobes = simulated(marschner_lobb(10), 21, 21, 30);
  for (const double share : {0.03, 0.1, 0.2})
    BOOST_TEST(check(lobes, grid_around_axis({16, 16, 16}, 0.8), 8, share) > 0u);
  const ProjectionSet head = simulated(shepp_logan(10), 21, 17, 30);
  for (const double share : {0.08, 0.2})
    BOOST_TEST(check(head, grid_around_axis({16, 16, 12}, 0.9), 8, share) > 0u);
}

BOOST_AUTO_TEST_CASE(a_field_that_does_not_vary_along_z_is_not_refined_along_z) {
  ProjectionSet scan = noise_scan(20, 12, 17, 5);
  const std::int64_t columns = scan.geometry.columns, rows = scan.geometry.rows;
  for (std::int64_t i = 0; i < scan.size(); ++i)
    scan.data[static_cast<std::size_t>(i)] =
        scan.data[static_cast<std::size_t>(i / (rows * columns) * rows * columns + i % columns)];
  for (const int rate : {4, 8}) {
    Case c(scan, grid_around_axis({10, 10, 10}, 0.7), rate, 0.1, true);
    std::size_t refined = 0, across = 0;
    for (std::size_t i = 0; i < c.decided.size(); ++i) {
      const LevelTriple& l = c.bricks.level[i];
      BOOST_TEST(l[0] == 0);
      refined += l != LevelTriple{0, 0, 0};
      across += l[1] != l[2];
    }
    BOOST_TEST(refined > 20u);
    BOOST_TEST(across > 0u);
  }
}

// The cell test makes T of a cell by itself, node_slack.cl in arrays. In a grid of one brick both look at the
// same cells. Fields above and below F show what either side takes.
BOOST_AUTO_TEST_CASE(totals_of_cells_are_those_of_nodes) {
  attacks::Chain chain(noise_scan(20, 14, 17, 5));
  for (const int rate : {4, 8})
    for (const double spacing : {0.4, 0.8, 1.2})
      for (const float value : {-1.0f, 0.0f, 1.0f}) {
        GoldSettings settings = Case::settings_of(grid_around_axis({4, 4, 4}, spacing), rate);
        settings.granularity = 4;
        GoldStream gold(attacks::device().state(), chain.filtered, chain.sups, settings);
        const float size = value * static_cast<float>(chain.sups.value);
        const DeviceField field(attacks::device().state(), as_mixed(std::vector<float>(125, size), settings));
        const std::vector<std::uint8_t> all(1, 1);
        const opencl::DeviceArray<std::uint8_t> selected(attacks::device().state(),
                                                         std::span<const std::uint8_t>(all), "the brick");
        BrickMeasure cells;
        Slack largest{0, 0};
        double total = 0, magnitude = 0;
        gold.run(
            all,
            [&](GoldStream::Batch& batch) {
              cells = batch.measure(field, 1.0f, selected).front();
              batch.for_each_node(0, [&](const Index3&, float g, const Slack& s) {
                if (!s.tested()) return;
                largest = {std::max(largest.above, s.above), std::max(largest.below, s.below)};
                total = std::max(total, static_cast<double>(s.total(size - g)));
                magnitude = std::max(magnitude, std::abs(static_cast<double>(g)));
              });
            },
            {}, "totals");
        BOOST_TEST(std::min(largest.above, largest.below) > 0.0f);
        // Half a dozen roundings more or less, of gold and of what is added to it.
        magnitude += static_cast<double>(std::abs(size) + std::max(largest.above, largest.below));
        BOOST_TEST(std::abs(static_cast<double>(cells.total) - total) <= 6 * unit_roundoff * magnitude);
        BOOST_TEST(std::abs(static_cast<double>(cells.slack - std::max(largest.above, largest.below))) <=
                   6 * unit_roundoff * magnitude);
      }
}

// A level that coarse gold proposed for fine gold: no promise.
bool is_proposed(const Case& c, std::size_t i) {
  return c.decided[i].rate < 8 && !c.classify.is_easy(i, c.tolerance);
}

BOOST_AUTO_TEST_CASE(what_coarse_gold_proposes_is_measured_on_fine_gold_and_mostly_right) {
  Case c(noise_scan(20, 14, 17, 5), grid_around_axis({10, 10, 11}, 1.0), 8, 0.08, true);
  std::vector<std::uint8_t> proposed(c.bricks.level.size(), 0);
  for (std::size_t i = 0; i < proposed.size(); ++i)
    proposed[i] = c.bricks.level[i] != LevelTriple{0, 0, 0} && is_proposed(c, i);
  const MixedVolume open = close_boundaries(c.bricks, Closing::none);
  c.classify.measure(DeviceField(c.state, open), open.level, c.tolerance, proposed, "verify");
  std::size_t all = 0, right = 0;
  for (std::size_t i = 0; i < proposed.size(); ++i) {
    if (!proposed[i]) continue;
    const BrickMeasure& m = c.classify.measures()[i];
    BOOST_TEST(m.rate >= 8);
    ++all;
    right += static_cast<double>(m.total) <= c.tolerance ? 1 : 0;
  }
  BOOST_TEST_MESSAGE(right << " of " << all << " proposals are right");
  BOOST_TEST(all > 20u);
  // Else nothing is saved.
  BOOST_TEST(right > all / 2);
}

BOOST_AUTO_TEST_CASE(tiles_of_every_triple_pass_before_closing_and_take_less_than_isotropic_ones) {
  const ProjectionSet lobes = simulated(marschner_lobb(10), 21, 21, 30);
  const Grid grid = grid_around_axis({16, 16, 16}, 0.8);
  std::array<double, 2> samples{};
  for (const bool anisotropic : {false, true}) {
    Case c(lobes, grid, 8, 0.03, anisotropic);
    std::vector<std::uint8_t> refined(c.bricks.level.size(), 0);
    for (std::size_t i = 0; i < refined.size(); ++i) {
      refined[i] = c.bricks.level[i] != LevelTriple{0, 0, 0};
      samples[anisotropic] += static_cast<double>(c.bricks.samples[i].size());
    }
    const MixedVolume open = close_boundaries(c.bricks, Closing::none);
    c.classify.measure(DeviceField(c.state, open), open.level, c.tolerance, refined, "verify");
    for (std::size_t i = 0; i < refined.size(); ++i)
      if (refined[i] && *std::max_element(open.level[i].begin(), open.level[i].end()) < 3 &&
          !is_proposed(c, i))
        BOOST_TEST(static_cast<double>(c.classify.measures()[i].total) <= c.tolerance + rounding(c));
  }
  BOOST_TEST(samples[true] > 0);
  BOOST_TEST(samples[true] < 0.8 * samples[false]);
}

// Samples are fitted on the bricks that want them; what lies beside those must not show.
BOOST_AUTO_TEST_CASE(a_tile_does_not_depend_on_what_else_is_asked_for) {
  const ProjectionSet scan = noise_scan(20, 14, 17, 5);
  Case c(scan, grid_around_axis({10, 10, 11}, 0.7), 4, 0.2, true);
  const auto near = c.gold.fine().bricks_near_coverage();
  c.gold.fine().run(
      near,
      [&](GoldStream::Batch& batch) {
        for (const LevelTriple& level :
             {LevelTriple{0, 0, 1}, LevelTriple{1, 0, 2}, LevelTriple{0, 2, 2}, LevelTriple{1, 1, 1}}) {
          std::vector<std::pair<std::int64_t, LevelTriple>> all;
          for (const std::int64_t brick : batch.bricks()) all.emplace_back(brick, level);
          const auto together = batch.extract(all);
          const std::size_t size = together.size() / all.size();
          for (std::size_t i = 0; i < all.size(); i += 7) {
            const auto alone = batch.extract({all[i]});
            BOOST_TEST((std::equal(alone.begin(), alone.end(),
                                   together.begin() + static_cast<std::ptrdiff_t>(i * size))));
          }
        }
      },
      {}, "tiles", GoldStream::For::samples);
}

// A brick that coarse gold decided, given a tile at the fine rate.
struct Refined {
  explicit Refined(Case& c) {
    while (brick < c.decided.size() && !(c.decided[brick].total >= 0 && c.decided[brick].rate < 8)) ++brick;
    BOOST_REQUIRE(brick < c.decided.size());
    c.bricks.level[brick] = {3, 3, 3};
    alone.assign(c.bricks.level.size(), 0);
    alone[brick] = 1;
    c.classify.extract(alone);
  }
  std::size_t brick = 0;
  std::vector<std::uint8_t> alone;  // the selection of it
};

BOOST_AUTO_TEST_CASE(tile_finer_than_coarse_gold_is_measured_on_fine_gold) {
  const ProjectionSet lobes = simulated(marschner_lobb(10), 21, 21, 30);
  Case c(lobes, grid_around_axis({16, 16, 16}, 0.8), 8, 0.2);
  const auto [brick, raised] = Refined(c);
  // Altered at a node that coarse gold does not have.
  BOOST_REQUIRE(c.bricks.samples[brick].size() == 17u * 17u * 17u);
  c.bricks.samples[brick][(5 * 17 + 5) * 17 + 5] += static_cast<float>(3 * c.tolerance);
  const MixedVolume volume = close_boundaries(c.bricks, Closing::none);
  c.classify.measure(DeviceField(c.state, volume), volume.level, c.tolerance, raised, "verify");
  BOOST_TEST(static_cast<double>(c.classify.measures()[brick].error) > 2 * c.tolerance);
}

// Closing `paper` raises a brick beside a finer one: coarse gold no longer resolves it.
BOOST_AUTO_TEST_CASE(brick_that_closing_raised_is_measured_at_its_stored_level) {
  const ProjectionSet lobes = simulated(marschner_lobb(10), 21, 21, 30);
  Case c(lobes, grid_around_axis({16, 16, 16}, 0.8), 8, 0.2);
  const auto [brick, raised] = Refined(c);
  const std::vector<LevelTriple> stored = c.bricks.level;
  MixedVolume volume = close_boundaries(c.bricks, Closing::none);
  // As if its own level were 1 and closing had raised it: the volume holds the tile of level 3.
  c.bricks.level[brick] = {1, 1, 1};
  c.classify.measure(DeviceField(c.state, volume), stored, c.tolerance, raised, "verify");
  BOOST_TEST(c.classify.measures()[brick].rate == 8);
  BOOST_TEST(static_cast<double>(c.classify.measures()[brick].total) <= c.tolerance);
}

BOOST_AUTO_TEST_CASE(terms_are_those_of_the_gold_that_errs_most) {
  const ProjectionSet scan = noise_scan(12, 9, 30, 7);
  attacks::Chain chain(scan);
  opencl::State& state = attacks::device().state();
  for (const double spacing : {0.4, 1.0, 2.0}) {
    GoldRates gold(state, chain.filtered, chain.sups,
                   Case::settings_of(grid_around_axis({10, 10, 6}, spacing), 8));
    const GoldStream* coarse = gold.coarse();
    if (coarse == nullptr) throw std::runtime_error("no coarse gold");
    double arithmetic = std::max(coarse->arithmetic(), gold.fine().arithmetic()),
           projection = std::max(coarse->projection(), gold.fine().projection());
    const GoldStream* finer = gold.finer();
    if (finer == nullptr) throw std::runtime_error("no finer gold");
    arithmetic = std::max(arithmetic, finer->arithmetic());
    projection = std::max(projection, finer->projection());
    BOOST_TEST(gold.arithmetic() == arithmetic);
    BOOST_TEST(gold.projection() == projection);
    // Kept nodes themselves err by less than what is interpolated from them.
    if (spacing == 2.0) BOOST_TEST(coarse->projection() < gold.fine().projection());
  }
}

BOOST_AUTO_TEST_CASE(comparison_without_slack_and_windows_take_the_fine_gold_alone) {
  const ProjectionSet scan = noise_scan(12, 9, 11, 7);
  attacks::Chain chain(scan);
  GoldSettings settings = Case::settings_of(grid_around_axis({6, 6, 6}, 0.7), 8);
  opencl::State& state = attacks::device().state();
  const auto has_coarse = [&](const GoldSettings& s) {
    return GoldRates(state, chain.filtered, chain.sups, s).coarse() != nullptr;
  };
  BOOST_TEST(has_coarse(settings));
  GoldSettings grid_only = settings, window = settings, low = settings;
  grid_only.grid_only = true;
  window.window = {0.0, 1.0};
  low.rate = 2;
  BOOST_TEST(!has_coarse(grid_only));
  BOOST_TEST(!has_coarse(window));
  BOOST_TEST(!has_coarse(low));
}

}  // namespace
}  // namespace vdvr
