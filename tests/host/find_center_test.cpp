#define BOOST_TEST_MODULE find_center
#include "vdvr/find_center.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "tests/support/temporary_folder.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;
const std::filesystem::path data = std::filesystem::path(VDVR_SOURCE_DIR) / "data";

// A tenth of a column is what the published centres of the two real scans claim or better, and moves an edge
// by a tenth of a sample: below what linear interpolation does to it.
constexpr double tenth_of_a_column = 0.1;

// Discs of different size off the axis, exact chords at pixel centres, with Gaussian
// noise.
ProjectionSet discs(std::int64_t views, double arc, double center, double noise, std::int64_t columns = 101) {
  struct Disc {
    double x, y, r, density;
  };
  const std::vector<Disc> object{{3, -4, 28, 0.02}, {-12, 9, 6, 0.05}, {15, 5, 4, -0.02}, {2, -20, 5, 0.04}};
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

BOOST_AUTO_TEST_CASE(a_quarter_turn_noise_or_nothing_give_no_centre) {
  BOOST_TEST(!find_center(discs(45, pi / 2, 47.3, 0)).has_value());
  ProjectionSet noise = discs(90, 2 * pi, 5000, 0.1);
  BOOST_TEST(!find_center(noise).has_value());
  BOOST_TEST(!find_center(discs(90, pi, 5000, 0.1)).has_value());
  std::fill(noise.data.begin(), noise.data.end(), 0.0f);
  BOOST_TEST(!find_center(noise).has_value());
  BOOST_TEST(!find_center(discs(1, pi, 50, 0)).has_value());
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
