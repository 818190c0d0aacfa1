#define BOOST_TEST_MODULE camera
#include <boost/test/unit_test.hpp>

#include "tests/reference/raycast.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

// Where a world point appears: right of and below the picture's centre, by the camera's own axes.
std::pair<double, double> right_and_down(const Camera& c, const Vec3& p) {
  const Vec3 view = reference::unit(
      {c.focal_point[0] - c.position[0], c.focal_point[1] - c.position[1], c.focal_point[2] - c.position[2]});
  const Vec3 right = reference::unit(reference::cross(view, c.view_up)), up = reference::cross(right, view);
  const Vec3 d{p[0] - c.position[0], p[1] - c.position[1], p[2] - c.position[2]};
  return {reference::dot(d, right), -reference::dot(d, up)};
}

// An independent few operations on coordinates up to a hundred.
const double rounding = tolerance::fp64_sum(64, 100);

}  // namespace

BOOST_AUTO_TEST_CASE(azimuth_zero_looks_along_minus_y_with_x_right_and_z_down) {
  const Grid grid = fields::centred_grid({8, 8, 8});
  const Camera c = orbit_camera(grid, 0, 0, 1);
  BOOST_TEST(c.position[0] == 0);
  BOOST_TEST(c.position[1] > 0);
  BOOST_TEST(c.position[2] == 0);
  BOOST_TEST(c.view_up[2] == -1);
  const auto [right, down] = right_and_down(c, {2, 0, 3});
  BOOST_TEST(!(std::abs(right - 2) > rounding));
  BOOST_TEST(!(std::abs(down - 3) > rounding));
}

BOOST_AUTO_TEST_CASE(azimuth_turns_about_z_and_moves_the_camera_to_its_right) {
  const Camera c = orbit_camera(fields::centred_grid({8, 8, 8}), 90, 0, 1);
  BOOST_TEST(c.position[0] > 0);
  BOOST_TEST(c.position[1] == 0);
  BOOST_TEST(c.position[2] == 0);
}

BOOST_AUTO_TEST_CASE(elevation_moves_the_camera_towards_view_up_even_to_the_pole) {
  const Grid grid = fields::centred_grid({8, 8, 8});
  for (const double elevation : {30.0, 90.0}) {
    const Camera c = orbit_camera(grid, 20, elevation, 1);
    BOOST_TEST(c.position[2] < 0);
    const Vec3 view{-c.position[0], -c.position[1], -c.position[2]};
    BOOST_TEST(!(std::abs(reference::dot(reference::unit(view), c.view_up)) > rounding));
  }
}

BOOST_AUTO_TEST_CASE(zoom_one_fits_the_bounding_sphere) {
  Grid grid = fields::centred_grid({10, 20, 30}, {0.5, 1, 2});
  grid.origin = {7, -3, 11};
  const double radius = std::sqrt(5.0 * 5 + 20 * 20 + 60 * 60) / 2;
  const Camera c = orbit_camera(grid, 33, -12, 1);
  const Vec3 d{c.position[0] - c.focal_point[0], c.position[1] - c.focal_point[1],
               c.position[2] - c.focal_point[2]};
  const double half = c.view_angle_deg / 2 * M_PI / 180;
  BOOST_TEST(!(std::abs(std::sqrt(reference::dot(d, d)) * std::sin(half) - radius) > rounding));
  BOOST_TEST(c.focal_point[2] == 11 + 30);
  const Camera near = orbit_camera(grid, 33, -12, 2);
  BOOST_TEST(!(std::abs(2 * std::tan(near.view_angle_deg / 2 * M_PI / 180) - std::tan(half)) > rounding));
}

BOOST_AUTO_TEST_CASE(useless_zoom_is_refused) {
  const Grid grid = fields::centred_grid({1, 1, 1});
  BOOST_CHECK_THROW(orbit_camera(grid, 0, 0, 0), InputError);
  BOOST_CHECK_THROW(orbit_camera(grid, NAN, 0, 1), InputError);
}

BOOST_AUTO_TEST_CASE(view_up_is_minus_z_unless_that_is_the_direction_of_view) {
  const Camera level = look_at({0, 5, 0}, {0, 0, 0}, std::nullopt, 30);
  BOOST_TEST((level.view_up == Vec3{0, 0, -1}));
  // Seen from -z as a slice across z: x right, y down; from +z x stays right.
  const auto below = right_and_down(look_at({0, 0, -5}, {0, 0, 0}, std::nullopt, 30), {2, 3, 0});
  BOOST_TEST(!(std::abs(below.first - 2) > rounding));
  BOOST_TEST(!(std::abs(below.second - 3) > rounding));
  const auto above = right_and_down(look_at({0, 0, 5}, {0, 0, 0}, std::nullopt, 30), {2, 3, 0});
  BOOST_TEST(!(std::abs(above.first - 2) > rounding));
  BOOST_TEST(!(std::abs(above.second + 3) > rounding));
}

BOOST_AUTO_TEST_CASE(cameras_without_a_direction_are_refused) {
  const Vec3 eye{0, 5, 0}, middle{0, 0, 0};
  BOOST_CHECK_THROW(look_at(eye, eye, std::nullopt, 30), InputError);
  BOOST_CHECK_THROW(look_at(eye, middle, Vec3{0, -2, 0}, 30), InputError);
  BOOST_CHECK_THROW(look_at(eye, middle, Vec3{0, 0, 0}, 30), InputError);
  BOOST_CHECK_THROW(look_at(eye, middle, std::nullopt, 180), InputError);
  BOOST_CHECK_THROW(look_at(eye, {0, NAN, 0}, std::nullopt, 30), InputError);
}

BOOST_AUTO_TEST_CASE(every_camera_is_held_to_one_check) {
  const Camera good;
  check_camera(good);
  const auto refused = [&](auto&& change) {
    Camera c = good;
    change(c);
    BOOST_CHECK_THROW(check_camera(c), InputError);
  };
  refused([](Camera& c) { c.focal_point = c.position; });
  refused([](Camera& c) { c.view_up = {0, 0, 0}; });
  refused([](Camera& c) { c.view_up = {0, 7, 0}; });
  // Nearly parallel: within 1e-6, whoever made the camera.
  refused([](Camera& c) { c.view_up = {1e-7, 1, 0}; });
  BOOST_CHECK_THROW(look_at(good.position, good.focal_point, Vec3{1e-7, 1, 0}, 30), InputError);
  check_camera(look_at(good.position, good.focal_point, Vec3{1e-5, 1, 0}, 30));
  refused([](Camera& c) { c.view_angle_deg = 0; });
  refused([](Camera& c) { c.view_angle_deg = NAN; });
  refused([](Camera& c) { c.view_up[1] = INFINITY; });
}
