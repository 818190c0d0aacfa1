#define BOOST_TEST_MODULE common_gold
#include "host/certify/kept/common_gold.hpp"

#include <algorithm>
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

using vdvr::CommonGold;
using vdvr::CommonMemory;

namespace {

CommonGold::Shape shape_of(std::int64_t rows = 100) { return {{{0, 0}, {0, 1}, {1, 0}}, 64, 128, rows, {7}}; }

// Zeros, from a page's first byte on.
CommonMemory memory_for(const CommonGold::Shape& shape) {
  const std::uint64_t bytes = CommonGold::bytes_of(shape);
  const std::shared_ptr<void> owner(std::aligned_alloc(4096, bytes), std::free);
  std::fill_n(static_cast<std::byte*>(owner.get()), bytes, std::byte{0});
  return {{static_cast<std::byte*>(owner.get()), bytes}, owner, 3};
}

}  // namespace

BOOST_AUTO_TEST_CASE(everything_is_made_once_however_many_make_it) {
  const CommonGold::Shape shape = shape_of();
  const CommonMemory memory = memory_for(shape);
  std::vector<std::atomic<int>> made(7), heights(3);
  std::vector<std::thread> threads;
  for (int n = 0; n < 3; ++n)
    threads.emplace_back([&] {
      CommonGold gold(memory, shape, {});
      gold.make_rows([&](std::size_t chunk) { ++made.at(chunk); }, {});
      for (const auto& n_made : made) BOOST_TEST(n_made == 1);  // it returns when all are there
      gold.make_heights([&](std::size_t tile) { ++heights.at(tile); }, {});
      for (const auto& n_made : heights) BOOST_TEST(n_made == 1);
    });
  for (std::thread& thread : threads) thread.join();
}

BOOST_AUTO_TEST_CASE(what_the_first_one_gives_lies_first_and_is_not_made) {
  const CommonGold::Shape shape = shape_of();
  const CommonMemory memory = memory_for(shape);
  const CommonGold first(memory, shape, {0, 1, 0}), other(memory, shape, {});
  BOOST_TEST(first.given() == 1u);
  BOOST_TEST(other.given() == 1u);
  BOOST_TEST(first.order() == (std::vector<std::size_t>{1, 0, 2}), boost::test_tools::per_element());
  BOOST_TEST(other.order() == first.order(), boost::test_tools::per_element());
  first.rows(0, 1)[3] = 5;
  BOOST_TEST(other.rows(0, 3)[3] == 5);
  BOOST_TEST(other.heights(0, 3).data() >= other.rows(0, 3).data() + 3 * 64);

  const CommonMemory all = memory_for(shape);
  CommonGold given(all, shape, {1, 1, 1});
  given.make_rows([](std::size_t) { BOOST_ERROR("nothing is missing"); }, {});
}

BOOST_AUTO_TEST_CASE(what_somebody_took_and_never_made_is_made_by_others) {
  const CommonGold::Shape shape = shape_of(16);
  const CommonMemory memory = memory_for(shape);
  CommonGold dead(memory, shape, {}), alive(memory, shape, {});
  // One that hangs holds the only chunk.
  std::atomic<bool> ends = false, took = false;
  std::thread hangs([&] {
    dead.make_rows(
        [&](std::size_t) {
          took = true;
          while (!ends) std::this_thread::yield();
        },
        {});
  });
  while (!took) std::this_thread::yield();
  int made = 0;
  alive.make_rows([&](std::size_t) { ++made; }, {});
  BOOST_TEST(made == 1);
  ends = true;
  hangs.join();
}

BOOST_AUTO_TEST_CASE(what_failed_is_free_for_others) {
  const CommonGold::Shape shape = shape_of(16);
  const CommonMemory memory = memory_for(shape);
  CommonGold fails(memory, shape, {}), other(memory, shape, {});
  BOOST_CHECK_THROW(fails.make_rows([](std::size_t) { throw std::runtime_error("stopped"); }, {}),
                    std::runtime_error);
  int made = 0;
  other.make_rows([&](std::size_t) { ++made; }, {});
  BOOST_TEST(made == 1);
}

BOOST_AUTO_TEST_CASE(those_who_keep_other_gold_do_not_agree) {
  const CommonGold::Shape shape = shape_of();
  const CommonMemory memory = memory_for(shape);
  const CommonGold first(memory, shape, {0, 0, 0});
  CommonGold::Shape other = shape;
  other.more = {8};
  BOOST_TEST(first.agrees());
  BOOST_TEST(CommonGold(memory, shape, {}).agrees());
  BOOST_TEST(!CommonGold(memory, other, {}).agrees());
  BOOST_CHECK_THROW(CommonGold({memory.bytes.first(100), memory.owner, 1}, shape, {}), std::logic_error);
}
