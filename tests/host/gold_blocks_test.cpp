// Covers of selected bricks by boxes.
#define BOOST_TEST_MODULE gold_blocks
#include "host/certify/gold/gold_blocks.hpp"

#include <boost/test/unit_test.hpp>
#include <random>

namespace vdvr {
namespace {

// Samples of a box with a halo, as gold has them.
double with_halo(const Index3& size) {
  double product = 1;
  for (const std::int64_t n : size) product *= static_cast<double>(n * 8 + 5);
  return product;
}

std::vector<int> counts(const Index3& bricks, const std::vector<BrickBox>& boxes) {
  std::vector<int> n(static_cast<std::size_t>(bricks[0] * bricks[1] * bricks[2]), 0);
  for (const BrickBox& b : boxes)
    for (std::int64_t z = b.first[2]; z < b.first[2] + b.size[2]; ++z)
      for (std::int64_t y = b.first[1]; y < b.first[1] + b.size[1]; ++y)
        for (std::int64_t x = b.first[0]; x < b.first[0] + b.size[0]; ++x)
          ++n.at(static_cast<std::size_t>((z * bricks[1] + y) * bricks[0] + x));
  return n;
}

double total(const std::vector<BrickBox>& boxes) {
  double sum = 0;
  for (const BrickBox& b : boxes) sum += with_halo(b.size);
  return sum;
}

BOOST_AUTO_TEST_CASE(every_selected_brick_is_in_one_box_and_none_costs_more_than_blocks_or_single_bricks) {
  std::mt19937 random(3);
  for (const double share : {0.0, 0.01, 0.1, 0.4, 0.9, 1.0})
    for (const Index3& bricks : {Index3{1, 1, 1}, Index3{9, 5, 17}, Index3{4, 4, 8}, Index3{3, 13, 2}}) {
      const auto n = static_cast<std::size_t>(bricks[0] * bricks[1] * bricks[2]);
      std::vector<std::uint8_t> selected(n);
      std::bernoulli_distribution chosen(share);
      for (auto& s : selected) s = chosen(random) ? 1 : 0;
      const Index3 block{4, 4, 8};
      const auto boxes = cover_bricks(bricks, selected, block, with_halo);
      const auto covered = counts(bricks, boxes);
      double single = 0;
      for (std::size_t i = 0; i < n; ++i) {
        BOOST_TEST(covered[i] <= 1);
        if (selected[i]) BOOST_TEST(covered[i] == 1);
        single += selected[i] ? with_halo({1, 1, 1}) : 0;
      }
      const double all = total(cover_bricks(bricks, std::vector<std::uint8_t>(n, 1), block, with_halo));
      BOOST_TEST(total(boxes) <= single);
      BOOST_TEST(total(boxes) <= all);
    }
}

BOOST_AUTO_TEST_CASE(a_cluster_is_one_box_and_a_far_brick_another) {
  const Index3 bricks{8, 8, 8};
  std::vector<std::uint8_t> selected(512, 0);
  for (std::size_t z = 0; z < 2; ++z)
    for (std::size_t y = 0; y < 2; ++y)
      for (std::size_t x = 0; x < 2; ++x) selected[(z * 8 + y) * 8 + x] = 1;
  selected[511] = 1;
  const auto boxes = cover_bricks(bricks, selected, {4, 4, 4}, with_halo);
  BOOST_REQUIRE(boxes.size() == 2u);
  BOOST_TEST((boxes[0].first == Index3{0, 0, 0}));
  BOOST_TEST((boxes[0].size == Index3{2, 2, 2}));
  BOOST_TEST((boxes[1].first == Index3{7, 7, 7}));
  BOOST_TEST((boxes[1].size == Index3{1, 1, 1}));
}

}  // namespace
}  // namespace vdvr
