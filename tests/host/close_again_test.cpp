// Closing again what was closed, and where tiles lie meanwhile.
#define BOOST_TEST_MODULE close_again
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <memory>
#include <random>
#include <utility>

#include "host/certify/closing/close_boundaries.hpp"
#include "host/volume/brick_layout.hpp"
#include "tests/support/open_bricks.hpp"

using namespace vdvr;
using support::anisotropic;
using support::isotropic;
using support::random_bricks;
using support::store_as;

BOOST_AUTO_TEST_CASE(bricks_that_change_are_found) {
  OpenBricks open = random_bricks({{8, 8, 8}, 2, 4, isotropic, 1.0, 4});
  const MixedVolume before = close_boundaries(open);
  BOOST_TEST((changed_bricks(before, before) == std::vector<std::uint8_t>(64, 0)));
  const auto i = static_cast<std::size_t>(
      std::find(open.level.begin(), open.level.end(), LevelTriple{2, 2, 2}) - open.level.begin());
  open.samples[i][open.samples[i].size() / 2] += 1;  // inside: nobody else stores it
  const auto changed = changed_bricks(before, close_boundaries(open));
  BOOST_TEST(changed[i] == 1);
  BOOST_TEST(std::count(changed.begin(), changed.end(), 1) == 1);
}

namespace {

bool same(const SampleBlock& a, const SampleBlock& b) {
  return a.type == b.type && a.f32 == b.f32 && a.u16 == b.u16 && a.u8 == b.u8 && a.offset == b.offset &&
         a.shift == b.shift;
}

bool same(const MixedVolume& a, const MixedVolume& b) {
  return a.level == b.level && a.tile == b.tile && same(a.base, b.base) &&
         std::equal(
             a.tiles.begin(), a.tiles.end(), b.tiles.begin(), b.tiles.end(),
             [](const auto& x, const auto& y) { return x.first == y.first && same(x.second, y.second); });
}

// The bricks of `from` at every third place of the others, as when they rise; which those are.
std::vector<std::uint8_t> take_some(OpenBricks& open, const OpenBricks& from, std::size_t place) {
  std::vector<std::uint8_t> moved(open.level.size(), 0);
  for (std::size_t i = place; i < moved.size(); i += 17) {
    if (!open.involved[i] || from.level[i] == LevelTriple{0, 0, 0}) continue;
    open.level[i] = from.level[i];
    open.samples.put(i, from.samples[i]);
    moved[i] = 1;
  }
  return moved;
}

}  // namespace

BOOST_AUTO_TEST_CASE(closing_again_is_closing_anew) {
  for (const Closing closing : {Closing::coarse, Closing::paper, Closing::none})
    for (const StorageChoice storage : {StorageChoice::f32, StorageChoice::u16, StorageChoice::u8}) {
      const auto& triples = closing == Closing::paper ? isotropic : anisotropic;
      OpenBricks open = random_bricks({{14, 13, 12}, 2, 4, triples, 0.8, 3});
      store_as(open, storage);
      // Steep, so that tiles need steps and types of their own.
      for (std::size_t i = 0; i < open.samples.size(); i += 5)
        for (float& s : open.samples[i]) s *= 1.0f + 0.3f * static_cast<float>(i % 7);
      CloseBoundaries close(open, closing);
      MixedVolume before = close.first();
      BOOST_TEST(same(before, close_boundaries(open, closing)));
      std::int64_t kept = 0;
      for (unsigned round = 0; round < 6; ++round) {
        const OpenBricks other = random_bricks({{14, 13, 12}, 2, 4, triples, 1.0, 10 + round, 0.01});
        const std::vector<std::uint8_t> moved = take_some(open, other, 3 * round);
        MixedVolume again = close.again(before, moved);
        BOOST_TEST(same(again, close_boundaries(open, closing)));
        // No brick that takes part changes but those that were made.
        const auto changed = changed_bricks(before, again);
        for (std::size_t i = 0; i < changed.size(); ++i) {
          BOOST_REQUIRE((!open.involved[i] || !changed[i] || close.made()[i]));
          kept += open.level[i] != LevelTriple{0, 0, 0} && !close.made()[i] ? 1 : 0;
        }
        before = std::move(again);
      }
      BOOST_TEST(kept > 0);
    }
}

BOOST_AUTO_TEST_CASE(tiles_keep_their_samples_wherever_they_lie) {
  const auto scratch = std::make_shared<Scratch>(".", 1 << 16);
  // Parts of 2^16 samples and more: the second begins within these tiles, the third takes one alone.
  for (const std::uint64_t in_memory : {std::uint64_t{0}, std::uint64_t{1} << 19, UINT64_MAX}) {
    TileStore store(MemoryBudget{scratch, in_memory});
    std::vector<std::vector<float>> expected(40);
    store.resize(expected.size());
    std::mt19937 random(7);
    for (int round = 0; round < 3; ++round)
      for (std::size_t i = 0; i < expected.size(); ++i) {
        if (random() % 4 == 0) continue;
        expected[i].resize(i == 17 ? 300000 : random() % 5000);
        for (float& s : expected[i]) s = static_cast<float>(random());
        store.put(i, expected[i]);
      }
    store.drop(3);
    expected[3].clear();
    const TileStore copy = store;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      BOOST_TEST(std::ranges::equal(std::as_const(store)[i], expected[i]));
      BOOST_TEST(std::ranges::equal(copy[i], expected[i]));
    }
    BOOST_TEST((store.memory_bytes() > 0) == (in_memory > 0));
    BOOST_TEST(store.memory_bytes() <= std::max(in_memory, std::uint64_t{0}));
    store.clear();
    BOOST_TEST(store.memory_bytes() == 0u);
    BOOST_TEST(store[17].empty());
  }
}

BOOST_AUTO_TEST_CASE(bricks_close_alike_wherever_their_tiles_lie) {
  OpenBricks open = random_bricks({{10, 7, 6}, 4, 4, anisotropic, .9, 4});
  const MixedVolume in_memory = close_boundaries(open);
  const MemoryBudget budget{std::make_shared<Scratch>(".", 1 << 16), 0};
  TileStore store(budget);
  store.resize(open.samples.size());
  for (std::size_t i = 0; i < store.size(); ++i) store.put(i, std::as_const(open).samples[i]);
  open.samples = std::move(store);
  const MixedVolume in_scratch = CloseBoundaries(open, Closing::coarse, budget).first();
  BOOST_TEST(same(in_scratch, in_memory));
  BOOST_TEST((in_scratch.tiles.begin()->second.f32.scratch() == budget.scratch));
}
