#define BOOST_TEST_MODULE find_center
#include "vdvr/expert/find_center.hpp"

#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "tests/support/places.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;
const std::filesystem::path data = std::filesystem::path(vdvr::support::source_dir) / "data";

// A tenth of a column is what the published centres of the two real scans claim or better, and moves an edge
// by a tenth of a sample: below what linear interpolation does to it.
constexpr double tenth_of_a_column = 0.1;

// Discs of different size off the axis, exact chords at pixel centres, with Gaussian
// noise.
ProjectionSet discs(std::int64_t views, double arc, double center, double noise, std::int64_t columns = 101,
                    double size = 1) {
  struct Disc {
    double x, y, r, density;
  };
  std::vector<Disc> object{{3, -4, 28, 0.02}, {-12, 9, 6, 0.05}, {15, 5, 4, -0.02}, {2, -20, 5, 0.04}};
  for (Disc& d : object) d = {size * d.x, size * d.y, size * d.r, d.density};
  ProjectionSet scan;
  scan.geometry.columns = columns;
  scan.geometry.rows = 3;
  scan.geometry.center = -1;  // must not be looked at
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (std::int64_t k = 0; k < views; ++k) {
    const double theta = 0.3 + arc * static_cast<double>(k) / static_cast<double>(views);
    scan.geometry.theta_rad.push_back(theta);
    for (std::int64_t v = 0; v < scan.geometry.rows; ++v)
      for (std::int64_t i = 0; i < columns; ++i) {
        double p = noise * normal(random);
        for (const Disc& d : object) {
          const double t = static_cast<double>(i) - center - d.x * std::cos(theta) - d.y * std::sin(theta);
          if (std::abs(t) < d.r) p += 2 * d.density * std::sqrt(d.r * d.r - t * t);
        }
        scan.data.push_back(static_cast<float>(p));
      }
  }
  return scan;
}

void check_center(const ProjectionSet& scan, double expected, double within) {
  const auto found = find_center(scan);
  BOOST_REQUIRE(found.has_value());
  BOOST_TEST_MESSAGE("centre " << found->center << ", expected " << expected << ", " << found->method
                               << ", quality " << found->quality);
  BOOST_TEST(std::abs(found->center - expected) <= within);
  BOOST_TEST(found->quality >= 0.5);
}

}  // namespace

BOOST_AUTO_TEST_CASE(full_turn_gives_the_centre_from_opposite_views) {
  for (const double center : {50.0, 47.3, 61.77})
    check_center(discs(90, 2 * pi, center, 0), center, tenth_of_a_column);
}

BOOST_AUTO_TEST_CASE(odd_full_turn_gives_the_centre_from_views_half_a_step_off) {
  check_center(discs(91, 2 * pi, 53.4, 0), 53.4, tenth_of_a_column);
}

BOOST_AUTO_TEST_CASE(half_turn_without_its_end_gives_the_centre) {
  for (const double center : {50.0, 44.6, 57.21})
    for (const std::int64_t views : {60, 121})
      check_center(discs(views, pi, center, 0), center, tenth_of_a_column);
}

BOOST_AUTO_TEST_CASE(clockwise_half_turn_gives_the_centre) {
  check_center(discs(90, -pi, 46.2, 0), 46.2, tenth_of_a_column);
}

BOOST_AUTO_TEST_CASE(noise_of_a_tenth_of_the_object_does_not_move_the_centre) {
  check_center(discs(90, 2 * pi, 47.3, 0.1), 47.3, tenth_of_a_column);
  check_center(discs(90, pi, 47.3, 0.1), 47.3, tenth_of_a_column);
}

// A quarter of a column, or it says that it is unsure: what the command promises. These ten are found.
BOOST_AUTO_TEST_CASE(ten_scans_of_all_kinds_are_found_within_a_quarter_of_a_column) {
  struct Case {
    std::int64_t views;
    double arc_deg, center, noise;
    std::int64_t columns;
    double size;
  };
  const std::vector<Case> cases{
      {100, 200, 47.3, 0.05, 101, 1},  // more than half a turn
      {137, 270, 53.7, 0.05, 101, 1},  // three quarters, angles that do not divide it
      {181, 181, 53.7, 0.05, 101, 1},  // one pair of opposite views
      {63, 360, 61.2, 0, 101, 1},      // odd full turn: every pair half a step off
      {90, 360, 31.3, 0.02, 128, 1},   // outside the middle half
      {90, 180, 91.8, 0.02, 128, 1},   // the same of half a turn
      {180, 360, 11.6, 0.05, 80, 2},   // half acquisition, axis to the left
      {180, 360, 70.2, 0.02, 80, 2},   // and to the right
      {63, 360, 20.8, 0, 101, 2},      // odd half acquisition
      {90, 180, 47.3, 0.1, 101, 1}};   // noise of a tenth of the object
  for (const Case& c : cases) {
    const auto found =
        find_center(discs(c.views, c.arc_deg * pi / 180, c.center, c.noise, c.columns, c.size));
    BOOST_TEST_CONTEXT(c.views << " views, " << c.arc_deg << " degrees, centre " << c.center) {
      BOOST_REQUIRE(found.has_value());
      BOOST_TEST(found->sure, found->doubt);
      BOOST_TEST(std::abs(found->center - c.center) <= center_agreement);
    }
  }
}

BOOST_AUTO_TEST_CASE(whatever_it_is_sure_of_lies_within_a_quarter_of_a_column) {
  std::mt19937 random(11);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  int sure = 0;
  constexpr int scans = 60;
  for (int i = 0; i < scans; ++i) {
    const std::array arcs{360.0, 180.0, between(140, 300), 360.0};
    const double arc = arcs[static_cast<std::size_t>(i % 4)], size = i % 4 == 3 ? 2 : 1,
                 center = size > 1 ? between(8, 25) : between(38, 62), noise = between(0, 0.08);
    const auto views = static_cast<std::int64_t>(between(40, 160));
    const auto found = find_center(discs(views, arc * pi / 180, center, noise, 101, size));
    if (!found || !found->sure) continue;
    ++sure;
    BOOST_TEST(std::abs(found->center - center) <= center_agreement,
               views << " views, " << arc << " degrees, centre " << center << ", noise " << noise << ": "
                     << found->center);
  }
  // Arcs short of half a turn are a tenth of them; a method that is never sure would pass the rest.
  BOOST_TEST(sure >= scans * 3 / 4);
}

BOOST_AUTO_TEST_CASE(a_quarter_turn_is_unsure) {
  const auto found = find_center(discs(45, pi / 2, 47.3, 0));
  BOOST_REQUIRE(found.has_value());
  BOOST_TEST(!found->sure);
  BOOST_TEST(!found->doubt.empty());
}

// A cut object in half a turn: its mirror image is no continuation of it, and its centroids wander.
BOOST_AUTO_TEST_CASE(a_cut_object_of_half_a_turn_is_unsure_or_right) {
  int unsure = 0;
  for (const double center : {40.3, 45.6, 58.8}) {
    const auto found = find_center(discs(103, pi, center, 0.05, 101, 2));
    if (!found || !found->sure) ++unsure;
    else BOOST_TEST(std::abs(found->center - center) <= center_agreement);
  }
  BOOST_TEST(unsure > 0);
}

BOOST_AUTO_TEST_CASE(an_object_that_repeats_itself_is_unsure) {
  // Bars of nine columns across a detector that they fill: all mirrors on or between bars are alike.
  ProjectionSet scan = discs(90, 2 * pi, 50, 0);
  for (std::size_t i = 0; i < scan.data.size(); ++i)
    scan.data[i] = static_cast<float>(std::cos(2 * pi / 9 * (static_cast<double>(i % 101) - 50)));
  const auto found = find_center(scan);
  BOOST_TEST((!found || !found->sure));
}

BOOST_AUTO_TEST_CASE(noise_a_constant_or_one_view_give_no_centre) {
  ProjectionSet noise = discs(90, 2 * pi, 5000, 0.1);
  BOOST_TEST(!find_center(noise).has_value());
  BOOST_TEST(!find_center(discs(90, pi, 5000, 0.1)).has_value());
  for (const float constant : {0.0f, 3.0f}) {
    std::fill(noise.data.begin(), noise.data.end(), constant);
    BOOST_TEST(!find_center(noise).has_value());
  }
  BOOST_TEST(!find_center(discs(1, pi, 50, 0)).has_value());
  BOOST_TEST(!find_center(discs(3, 2 * pi, 50, 0)).has_value());
}

BOOST_AUTO_TEST_CASE(cone_beam_of_a_full_turn_is_found_wherever_the_geometry_puts_it) {
  for (const double said : {47.5, 44.0}) {
    ScanOptions options;
    options.center = said;
    const auto found = find_center(read_scan(data / "cone-head", options));
    BOOST_REQUIRE(found.has_value());
    BOOST_TEST(found->sure, found->doubt);
    BOOST_TEST(std::abs(found->center - 47.5) <= center_agreement);
  }
}

BOOST_AUTO_TEST_CASE(diamond_centre_is_found_from_its_half_turn) {
  check_center(read_scan(data / "diamond-24737"), 85.85, tenth_of_a_column);
}

BOOST_AUTO_TEST_CASE(diamond_centre_is_found_from_its_first_and_last_view) {
  const support::TemporaryFolder folder;
  const auto copy = folder / "scan";
  std::filesystem::copy(data / "diamond-24737", copy, std::filesystem::copy_options::recursive);
  auto description = nlohmann::json::parse(support::bytes_of(copy / "scan.json"));
  description.erase("use");  // all 91: views 0 and 90 are exactly opposite
  for (const bool air : {true, false}) {
    if (!air) description.erase("air_columns");
    static_cast<void>(folder.file("scan/scan.json", description.dump()));
    check_center(read_scan(copy), 85.85, tenth_of_a_column);
  }
}

BOOST_AUTO_TEST_CASE(tooth_centre_is_found_from_its_half_turn) {
  check_center(read_scan(data / "aps-tooth"), 295.9, 2 * tenth_of_a_column);
}
