// What light a box of gradients can give, held to the light of gradients in it.
#define BOOST_TEST_MODULE light_range
#include <boost/test/unit_test.hpp>

#include <random>

#include "host/picture/rays/light_range.hpp"
#include "tests/reference/ideal_light.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

Vec3 unit_vector(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Vec3 v{normal(random), normal(random), normal(random)};
  const double length = std::hypot(v[0], v[1], v[2]);
  for (double& x : v) x /= length;
  return v;
}

RenderOptions lights_of(std::mt19937& random) {
  RenderOptions o;
  o.head_light = random() % 3 != 0;
  const auto others = random() % 3 + (o.head_light ? 0 : 1);
  for (unsigned i = 0; i < others; ++i) {
    o.lights.push_back(unit_vector(random));
    for (double& x : o.lights.back()) x *= 3;
  }
  return o;
}

// Cosines and powers of some tens of roundings: the highlight takes its cosine's 24 times, of 9 lights at
// most.
constexpr double rounding = 0x1p-53 * 24 * 64 * 9;

}  // namespace

BOOST_AUTO_TEST_CASE(light_of_a_gradient_is_the_renderers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> size(0, 2);
  for (int k = 0; k < 20000; ++k) {
    const RenderOptions o = lights_of(random);
    const Lights lights(o, 0.7);
    Vec3 g = unit_vector(random);
    const Vec3 view = unit_vector(random);
    const double length = k % 50 == 0 ? 0 : size(random), colour = size(random) / 2;
    for (double& x : g) x *= length;
    const Light l = lights.at(g, view);
    const reference::IdealLight expected = reference::light_on(g, view, o, 0.7);
    BOOST_TEST(std::abs(lit_colour(colour, l.strength, l.diffuse, l.highlight) - expected.on(colour)) <=
               rounding);
  }
}

BOOST_AUTO_TEST_CASE(light_of_every_gradient_of_a_box_lies_in_its_range) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(0, 1);
  std::int64_t closed = 0;
  for (int k = 0; k < 4000; ++k) {
    const RenderOptions o = lights_of(random);
    const double full = 0.1 + part(random);
    const Lights lights(o, full);
    const Vec3 view = unit_vector(random);
    // From far from all turns to boxes that hold the middle; also flat ones, and towards the eye.
    GradientBox box;
    const Vec3 middle = k % 5 == 0 ? view : unit_vector(random);
    const double wide = std::pow(10.0, -4 * part(random));
    for (std::size_t a = 0; a < 3; ++a) {
      const double half = k % 7 == static_cast<int>(a) ? 0 : wide * part(random);
      box.low[a] = middle[a] - half;
      box.high[a] = middle[a] + half;
    }
    const LightRange range = lights.over(box, view);
    closed += range.most.diffuse - range.least.diffuse < 0.1 ? 1 : 0;
    const double low = part(random), high = low + (1 - low) * part(random);
    const auto [darkest, lightest] = lit_colours(low, high, range);
    for (int i = 0; i < 64; ++i) {
      Vec3 g{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double at = i < 8 ? static_cast<double>(i >> a & 1) : part(random);
        g[a] = (1 - at) * box.low[a] + at * box.high[a];
      }
      const reference::IdealLight l = reference::light_on(g, view, o, full);
      for (const double c : {low, high}) {
        BOOST_TEST(l.on(c) >= darkest - rounding);
        BOOST_TEST(l.on(c) <= lightest + rounding);
      }
    }
  }
  BOOST_TEST(closed > 1000);  // boxes that are small say something
}

BOOST_AUTO_TEST_CASE(a_box_without_ends_may_have_any_light) {
  RenderOptions o;
  o.lights = {{1, 0, 0}};
  const Lights lights(o, 1);
  const LightRange range = lights.over({{-INFINITY, 0, 0}, {INFINITY, 1, 1}}, {0, 0, 1});
  BOOST_TEST(range.least.strength == 0);
  BOOST_TEST(range.most.strength == 1);
  BOOST_TEST(range.most.highlight == 2);
  const auto [darkest, lightest] = lit_colours(0.5, 0.5, range);
  BOOST_TEST(darkest == 0.125);
  BOOST_TEST(lightest == 0.9);
}

BOOST_AUTO_TEST_CASE(the_range_of_a_point_is_the_point) {
  RenderOptions o;
  const Lights lights(o, 0.5);
  std::mt19937 random(9);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 g = unit_vector(random), view = unit_vector(random);
    const LightRange range = lights.over({g, g}, view);
    const Light at = lights.at(g, view);
    // The cone is 2^-24 wide.
    BOOST_TEST(range.most.diffuse - range.least.diffuse <= 0x1p-22);
    BOOST_TEST(range.most.highlight - range.least.highlight <= 24 * 0x1p-22);
    BOOST_TEST(at.diffuse >= range.least.diffuse);
    BOOST_TEST(at.diffuse <= range.most.diffuse);
  }
}
