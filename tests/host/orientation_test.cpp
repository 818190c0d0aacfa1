#define BOOST_TEST_MODULE orientation
#include "host/verify/audit/orientation.hpp"

#include <boost/test/unit_test.hpp>

#include <numeric>
#include <set>
#include <vector>

using namespace vdvr;

namespace {

Volume numbered() {
  Volume v;
  v.grid.cells = {3, 4, 5};
  v.grid.spacing = {1, 2, 3};
  v.samples.resize(static_cast<std::size_t>(v.grid.sample_count()));
  std::iota(v.samples.begin(), v.samples.end(), 0.0f);
  return v;
}

}  // namespace

BOOST_AUTO_TEST_CASE(there_are_48_and_each_makes_another_volume) {
  BOOST_TEST(orientations().size() == 48u);
  BOOST_TEST(orientations().front().is_plain());
  std::set<std::vector<float>> seen;
  std::set<std::string> words;
  int turns = 0;
  for (const Orientation& o : orientations()) {
    seen.insert(oriented(numbered(), o).samples);
    words.insert(words_of(o));
    turns += o.is_turn() ? 1 : 0;
  }
  BOOST_TEST(seen.size() == 48u);
  BOOST_TEST(words.size() == 48u);
  BOOST_TEST(turns == 24);
}

BOOST_AUTO_TEST_CASE(each_can_be_taken_back) {
  const Volume v = numbered();
  for (const Orientation& o : orientations()) {
    Orientation back;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto from = static_cast<std::size_t>(o.axes[a]);
      back.axes[from] = static_cast<int>(a);
      back.mirrored[from] = o.mirrored[a];
    }
    const Volume again = oriented(oriented(v, o), back);
    BOOST_TEST(again.samples == v.samples);
    BOOST_TEST((again.grid.cells == v.grid.cells && again.grid.spacing == v.grid.spacing));
  }
}

BOOST_AUTO_TEST_CASE(words_say_what_it_is) {
  BOOST_TEST(words_of({}).empty());
  BOOST_TEST(words_of({{0, 1, 2}, {false, true, false}}) == "mirrored along y");
  BOOST_TEST(words_of({{0, 1, 2}, {true, true, false}}) ==
             "mirrored along x and y, which is half a turn about z");
  BOOST_TEST(words_of({{0, 1, 2}, {true, true, true}}) == "mirrored along x, y and z");
  BOOST_TEST(words_of({{1, 0, 2}, {}}) == "axes x and y transposed");
  BOOST_TEST(words_of({{1, 2, 0}, {}}) == "axes in another order: x, y, z are the file's y, z, x");
}
