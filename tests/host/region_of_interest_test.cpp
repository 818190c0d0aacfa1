#define BOOST_TEST_MODULE region_of_interest
#include "vdvr/expert/region_of_interest.hpp"

#include <boost/test/unit_test.hpp>
#include <string>

#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

// Its last bricks of four are one cell thick in x, two in y.
const Grid whole{{41, 38, 24}, {-20.5, -19, 7}, {1, 0.5, 0.25}, "mm"};

using Box = std::array<double, 6>;

}  // namespace

BOOST_AUTO_TEST_CASE(bricks_of_the_region_are_those_of_the_grid) {
  for (const Box& box : {Box{-3, -2, 8.2, 4, 1, 9},
                         {-20, -18.9, 7, -19, -18, 7.1},
                         {-50, -50, 8, 50, 50, 20},
                         {0.5, -3.7, 7.9, 0.5000001, -3.6, 8}}) {
    const Grid part = cropped_to(box, whole, 4);
    const Bricks all(whole, 4), own(part, 4);
    const std::vector<std::uint8_t> wanted = bricks_of(box, whole, 4);
    // Where its first brick lies.
    Index3 first{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double bricks = (part.origin[a] - whole.origin[a]) / (4 * whole.spacing[a]);
      first[a] = static_cast<std::int64_t>(bricks);
      BOOST_TEST(bricks == static_cast<double>(first[a]));
      BOOST_TEST(part.spacing[a] == whole.spacing[a]);
    }
    std::int64_t inside = 0;
    bool same_cells = true;
    for (std::int64_t i = 0; i < own.size(); ++i) {
      const Index3 p = own.position(i), q{p[0] + first[0], p[1] + first[1], p[2] + first[2]};
      same_cells = same_cells && own.cells(p) == all.cells(q);
      inside += wanted[static_cast<std::size_t>(all.number(q))];
    }
    BOOST_TEST(same_cells);
    // All that the region meets, and no other.
    BOOST_TEST(inside == own.size());
    BOOST_TEST(std::count(wanted.begin(), wanted.end(), 1) == own.size());
  }
}

BOOST_AUTO_TEST_CASE(a_grid_is_no_thinner_than_its_bricks) {
  // The brick at the end of x has one cell.
  const Grid part = cropped_to({20.2, -19, 7, 20.4, -18, 8}, whole, 4);
  BOOST_TEST(part.cells[0] == 5);
  BOOST_TEST(part.origin[0] == whole.origin[0] + 36);
  BOOST_TEST(part.cells[1] == 4);
}

BOOST_AUTO_TEST_CASE(a_region_beside_the_grid_is_refused_by_its_axis) {
  for (const auto& [box, axis] : {std::pair{Box{21, 0, 8, 30, 1, 9}, "along x"},
                                  {Box{0, -30, 8, 1, -20, 9}, "along y"},
                                  {Box{0, 0, 13.5, 1, 1, 14}, "along z"}}) {
    const auto is_named = [axis = std::string(axis)](const InputError& e) {
      return std::string(e.what()).find(axis) != std::string::npos;
    };
    BOOST_CHECK_EXCEPTION(cropped_to(box, whole, 4), InputError, is_named);
  }
}
