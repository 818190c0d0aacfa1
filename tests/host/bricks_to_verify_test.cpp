// Which bricks a sample has: the worst, enough of every level, and columns or layers that make F cheap.
#define BOOST_TEST_MODULE bricks_to_verify
#include "host/verify/bricks_to_verify.hpp"

#include <algorithm>
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
    const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, true);
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
    const auto sample = sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, false);
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

BOOST_AUTO_TEST_CASE(seeds_give_samples_of_their_own_and_the_region_is_kept_to) {
  Case c = make_case(7);
  for (const bool columns : {false, true}) {
    const auto sample = [&](unsigned seed) {
      return sample_of_bricks(c.volume, c.stored, {false, 0.05, seed}, columns);
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
