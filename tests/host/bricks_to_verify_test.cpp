// Which bricks a sample has: the worst, enough of every level, and columns or layers that make F cheap.
#define BOOST_TEST_MODULE bricks_to_verify
#include "host/verify/bricks_to_verify.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <map>
#include <random>
#include <set>

using namespace vdvr;

namespace {

constexpr std::int64_t nx = 30, ny = 27, nz = 6;

struct Case {
  MixedVolume volume;
  Certificate stored;
  std::size_t worst = 0;
};

/// Levels of very different frequency; the last brick along x and y is cut.
Case make_case(unsigned seed) {
  std::mt19937 random(seed);
  Case c;
  c.volume.grid.cells = {4 * nx - 1, 4 * ny - 2, 4 * nz};
  for (std::int64_t i = 0; i < nx * ny * nz; ++i) {
    const auto draw = random() % 1000;
    c.volume.level.push_back(draw < 3    ? LevelTriple{2, 1, 1}
                             : draw < 60 ? LevelTriple{1, 0, 1}
                                         : LevelTriple{0, 0, 0});
  }
  const Index3 brick{static_cast<std::int64_t>(random() % nx), static_cast<std::int64_t>(random() % ny),
                     static_cast<std::int64_t>(random() % nz)};
  for (std::size_t a = 0; a < 3; ++a) c.stored.worst_at[a] = 4 * static_cast<double>(brick[a]) + 1.5;
  c.worst = static_cast<std::size_t>((brick[2] * ny + brick[1]) * nx + brick[0]);
  return c;
}

std::map<LevelTriple, std::size_t> by_level(const MixedVolume& volume,
                                            const std::vector<std::uint8_t>& bricks) {
  std::map<LevelTriple, std::size_t> out;
  for (std::size_t i = 0; i < bricks.size(); ++i)
    if (bricks[i] != 0) ++out[volume.level[i]];
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(columns_are_whole_and_every_level_is_among_them) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Case c = make_case(seed);
    const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, SampleOf::columns,
                                         all_bricks(c.volume, c.stored));
    BOOST_TEST(sample[c.worst] == 1);
    std::size_t whole = 0;
    for (std::int64_t column = 0; column < nx * ny; ++column) {
      std::int64_t chosen = 0;
      for (std::int64_t z = 0; z < nz; ++z) chosen += sample[static_cast<std::size_t>(z * nx * ny + column)];
      const bool of_worst = static_cast<std::int64_t>(c.worst) % (nx * ny) == column;
      BOOST_TEST((chosen == 0 || chosen == nz || (of_worst && chosen == 1)));
      whole += chosen == nz ? 1 : 0;
    }
    BOOST_TEST(whole >= 41);  // a twentieth of 810, rounded up
    BOOST_TEST(whole <= 41 + 3 * 8);
    const auto all = by_level(c.volume, all_bricks(c.volume, c.stored)), some = by_level(c.volume, sample);
    for (const auto& [level, members] : all) {
      const auto found = some.find(level);
      BOOST_TEST((found != some.end() && found->second >= std::min<std::size_t>(8, members)));
    }
  }
}

BOOST_AUTO_TEST_CASE(layers_are_few_and_every_level_in_them_is_tested) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Case c = make_case(seed);
    const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, SampleOf::layers,
                                         all_bricks(c.volume, c.stored));
    BOOST_TEST(sample[c.worst] == 1);
    std::set<std::int64_t> layers;
    for (std::size_t i = 0; i < sample.size(); ++i)
      if (sample[i] != 0) layers.insert(static_cast<std::int64_t>(i) / (nx * ny));
    BOOST_TEST((layers.size() >= 2 && layers.size() <= static_cast<std::size_t>(layers_of_sample)));
    auto in_layers = all_bricks(c.volume, c.stored);
    for (std::size_t i = 0; i < in_layers.size(); ++i)
      if (!layers.contains(static_cast<std::int64_t>(i) / (nx * ny))) in_layers[i] = 0;
    const auto all = by_level(c.volume, in_layers), some = by_level(c.volume, sample);
    const double share = 0.05 * nz / static_cast<double>(layers.size());
    for (const auto& [level, members] : all) {
      const auto wanted = std::min(
          members, std::max<std::size_t>(8, static_cast<std::size_t>(share * static_cast<double>(members))));
      const auto found = some.find(level);
      BOOST_TEST((found != some.end() && found->second >= wanted));
    }
  }
}

BOOST_AUTO_TEST_CASE(blocks_are_few_and_every_level_in_them_is_tested) {
  const auto block_of = [](std::size_t i) {
    const auto brick = static_cast<std::int64_t>(i);
    return std::array{brick % nx / bricks_of_block, brick / nx % ny / bricks_of_block,
                      brick / (nx * ny) / bricks_of_block};
  };
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Case c = make_case(seed);
    const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, SampleOf::blocks,
                                         all_bricks(c.volume, c.stored));
    BOOST_TEST(sample[c.worst] == 1);
    std::set<std::array<std::int64_t, 3>> blocks;
    for (std::size_t i = 0; i < sample.size(); ++i)
      if (sample[i] != 0) blocks.insert(block_of(i));
    // Four at least are drawn from, half of all at most; a part has 64 bricks at most.
    BOOST_TEST((blocks.size() >= 2 && blocks.size() <= 8));
    const auto chosen = std::count(sample.begin(), sample.end(), 1);
    BOOST_TEST((chosen >= nx * ny * nz / 20 && chosen <= nx * ny * nz / 20 + 64 + 3 * 8 + 1));
    auto in_blocks = all_bricks(c.volume, c.stored);
    for (std::size_t i = 0; i < in_blocks.size(); ++i)
      if (!blocks.contains(block_of(i))) in_blocks[i] = 0;
    const auto all = by_level(c.volume, in_blocks), some = by_level(c.volume, sample);
    for (const auto& [level, members] : all) {
      const auto found = some.find(level);
      BOOST_TEST((found != some.end() && found->second >= std::min<std::size_t>(8, members)));
    }
  }
}

BOOST_AUTO_TEST_CASE(blocks_lie_where_bricks_may_be_chosen) {
  const Case c = make_case(3);
  auto corner = all_bricks(c.volume, c.stored);
  std::size_t left = 0;
  for (std::size_t i = 0; i < corner.size(); ++i) {
    const auto brick = static_cast<std::int64_t>(i);
    if (brick % nx >= 5 || brick / nx % ny >= 5) corner[i] = 0;
    left += corner[i];
  }
  const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.5, 3}, SampleOf::blocks, corner);
  for (std::size_t i = 0; i < sample.size(); ++i) BOOST_TEST(sample[i] <= corner[i]);
  BOOST_TEST(2 * std::count(sample.begin(), sample.end(), 1) >= left);
}

BOOST_AUTO_TEST_CASE(a_sample_of_blocks_has_a_limit) {
  const Case c = make_case(5);
  VerifyOptions options{false, 0.5, 5};
  options.most_of_cone = 100;
  const auto sample =
      sample_of_bricks(c.volume, c.stored, options, SampleOf::blocks, all_bricks(c.volume, c.stored));
  const auto chosen = std::count(sample.begin(), sample.end(), 1);
  BOOST_TEST((chosen >= 100 && chosen <= 100 + 64 + 3 * 8 + 1));
}

BOOST_AUTO_TEST_CASE(seeds_give_samples_of_their_own_and_the_region_is_kept_to) {
  Case c = make_case(7);
  for (const SampleOf shape : {SampleOf::columns, SampleOf::layers, SampleOf::blocks}) {
    const auto sample = [&](unsigned seed) {
      return sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, shape, all_bricks(c.volume, c.stored));
    };
    BOOST_TEST((sample(3) == sample(3)));
    BOOST_TEST((sample(3) != sample(4)));
    c.stored.roi = std::array<double, 6>{20, 20, 0, 60, 60, 11};
    const auto inside = all_bricks(c.volume, c.stored), some = sample(3);
    for (std::size_t i = 0; i < some.size(); ++i) BOOST_TEST(some[i] <= inside[i]);
    BOOST_TEST(std::count(some.begin(), some.end(), 1) > 0);
    c.stored.roi.reset();
  }
}
