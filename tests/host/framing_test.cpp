// Cameras that frame what is shown: all of it lies in the picture, and fills it.
#define BOOST_TEST_MODULE framing
#include <boost/test/unit_test.hpp>

#include <cmath>

#include "tests/reference/raycast.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/framing.hpp"

using namespace vdvr;
using fields::centred_grid;

namespace {

constexpr double kRadius = 9;
constexpr Vec3 kCentre{15, -12, 11};

double distance(const Vec3& a, double x, double y, double z) {
  return std::hypot(a[0] - x, a[1] - y, a[2] - z);
}

/// A ball off the middle of a grid that is eight times as wide.
double ball(double x, double y, double z) { return distance(kCentre, x, y, z) < kRadius ? 1 : 0; }

MixedVolume ball_volume() { return as_mixed(fields::uniform(centred_grid({72, 72, 72}), ball)); }

RenderOptions shown_above_a_half(std::int64_t width = 100, std::int64_t height = 100) {
  RenderOptions o;
  o.width = width;
  o.height = height;
  o.transfer = {"step", {{0, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 0}, {0.6, {1, 1, 1}, 0.8}, {1, {1, 1, 1}, 0.8}}};
  return o;
}

/// Across and above the middle of the picture, in half pictures.
std::pair<double, double> in_picture(const Camera& c, const Vec3& p, double aspect) {
  const Vec3 view = reference::unit(
      {c.focal_point[0] - c.position[0], c.focal_point[1] - c.position[1], c.focal_point[2] - c.position[2]});
  const Vec3 right = reference::unit(reference::cross(view, c.view_up)), up = reference::cross(right, view);
  const Vec3 d{p[0] - c.position[0], p[1] - c.position[1], p[2] - c.position[2]};
  const double half = reference::dot(d, view) * std::tan(c.view_angle_deg / 2 * M_PI / 180);
  return {reference::dot(d, right) / (half * aspect), reference::dot(d, up) / half};
}

/// How far points on a sphere reach in a picture.
struct Reach {
  double left = 1e300, right = -1e300, below = 1e300, above = -1e300;
};
Reach reach_of(const Camera& c, const Vec3& centre, double radius, double aspect = 1) {
  Reach r;
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 20; ++j) {
      const double a = i * M_PI / 20, b = (j + 0.5) * M_PI / 20;
      const auto [x, y] =
          in_picture(c,
                     {centre[0] + radius * std::cos(a) * std::sin(b),
                      centre[1] + radius * std::sin(a) * std::sin(b), centre[2] + radius * std::cos(b)},
                     aspect);
      r = {std::min(r.left, x), std::max(r.right, x), std::min(r.below, y), std::max(r.above, y)};
    }
  return r;
}
bool is_inside(const Reach& r) { return r.left > -1 && r.right < 1 && r.below > -1 && r.above < 1; }
// A frame holds a margin of a 20th, a cell around what is shown, and boxes of it by rows of blocks of four
// samples, whose corners lie up to sqrt(3) times half a block farther out.
const double kFilled = 0.95 * kRadius / (kRadius + std::sqrt(3.0) * (1 + 4.0 / 2));

}  // namespace

BOOST_AUTO_TEST_CASE(a_small_object_off_the_middle_fills_the_picture_and_is_wholly_inside) {
  const MixedVolume volume = ball_volume();
  for (const double aspect : {1.0, 2.0, 0.5})
    for (const double azimuth : {0.0, 30.0, 217.0})
      for (const double elevation : {-35.0, 0.0, 20.0, 90.0}) {
        RenderOptions o = shown_above_a_half(aspect > 1 ? 200 : 100, aspect < 1 ? 200 : 100);
        for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso}) {
          o.mode = mode;
          o.surfaces = {{0.5}};
          const Camera c = orbit_camera(frame_view(volume, o, azimuth, elevation), azimuth, elevation, 1);
          const Reach r = reach_of(c, kCentre, kRadius, aspect);
          BOOST_TEST(is_inside(r));
          const double width = (r.right - r.left) / 2, height = (r.above - r.below) / 2;
          BOOST_TEST(std::max(width, height) > kFilled);
        }
      }
}

BOOST_AUTO_TEST_CASE(a_turn_has_one_distance_from_which_all_is_inside) {
  const MixedVolume volume = ball_volume();
  const RenderOptions o = shown_above_a_half();
  const OrbitFrame frame = frame_turn(volume, o, 20);
  double widest = 0;
  for (double azimuth = 0; azimuth < 360; azimuth += 7) {
    const Reach r = reach_of(orbit_camera(frame, azimuth, 20, 1), kCentre, kRadius);
    BOOST_TEST(is_inside(r));
    widest = std::max(widest, std::max((r.right - r.left) / 2, (r.above - r.below) / 2));
  }
  BOOST_TEST(widest > kFilled);
  // Zoom is relative to the frame: it divides the tangent of the half angle.
  const Reach one = reach_of(orbit_camera(frame, 0, 20, 1), kCentre, kRadius),
              half = reach_of(orbit_camera(frame, 0, 20, 0.5), kCentre, kRadius);
  BOOST_TEST(!(std::abs(half.above - one.above / 2) > tolerance::fp64_sum(256, 1)));
}

BOOST_AUTO_TEST_CASE(where_nothing_is_shown_the_grid_is_framed) {
  const MixedVolume volume = ball_volume();
  RenderOptions o = shown_above_a_half();
  for (auto& p : o.transfer.points) p.opacity = 0;
  const OrbitFrame grid = frame_grid(volume.grid);
  for (const OrbitFrame& frame : {frame_view(volume, o, 30, 20), frame_turn(volume, o, 20)}) {
    BOOST_TEST(frame.middle == grid.middle, boost::test_tools::per_element());
    BOOST_TEST(frame.distance == grid.distance);
  }
  o.mode = RenderMode::iso;
  o.surfaces = {{7}};
  BOOST_TEST(frame_view(volume, o, 30, 20).distance == grid.distance);
  BOOST_CHECK_THROW(frame_view(std::vector<Vec3>{}, 0, 0, 1), InputError);
}

BOOST_AUTO_TEST_CASE(a_speck_is_left_out_and_a_second_object_is_not) {
  const Grid grid = centred_grid({72, 72, 72});
  const RenderOptions o = shown_above_a_half();
  const auto with = [&](double radius) {
    return as_mixed(fields::uniform(grid, [&](double x, double y, double z) {
      return distance({-28, 28, -28}, x, y, z) < radius ? 1 : ball(x, y, z);
    }));
  };
  // A sample is 1 / 3,000 of the ball, a ball of radius 3 a 27th.
  const OrbitFrame alone = frame_view(with(0), o, 30, 20), speck = frame_view(with(0.5), o, 30, 20);
  BOOST_TEST(speck.distance == alone.distance);
  const MixedVolume two = with(3);
  const Camera c = orbit_camera(frame_view(two, o, 30, 20), 30, 20, 1);
  BOOST_TEST(is_inside(reach_of(c, kCentre, kRadius)));
  BOOST_TEST(is_inside(reach_of(c, {-28, 28, -28}, 3)));
}

BOOST_AUTO_TEST_CASE(a_veil_that_is_seen_is_inside_and_noise_around_it_does_not_count) {
  const Grid grid = centred_grid({72, 72, 72});
  // A cell of the veil stops a hundredth, 18 cells a sixth; of the air, where it is noisy, 72 cells a 140th.
  std::uint32_t state = 1;
  const auto noise = [&] {
    state = state * 1664525u + 1013904223u;
    return (state >> 24) < 26;
  };
  const auto veil = [&](double x, double y, double z) {
    return distance(kCentre, x, y, z) < kRadius ? 0.01 : noise() ? 0.001 : 0.0;
  };
  const MixedVolume volume = as_mixed(fields::uniform(grid, veil));
  RenderOptions o = shown_above_a_half();
  o.transfer = {"veil", {{0, {1, 1, 1}, 0}, {0.01, {1, 1, 1}, 0.01}, {1, {1, 1, 1}, 0.01}}};
  for (const double azimuth : {0.0, 40.0, 250.0}) {
    const Camera c = orbit_camera(frame_view(volume, o, azimuth, 20), azimuth, 20, 1);
    const Reach r = reach_of(c, kCentre, kRadius);
    BOOST_TEST(is_inside(r));
    BOOST_TEST(std::max((r.right - r.left) / 2, (r.above - r.below) / 2) > kFilled);
  }
}

BOOST_AUTO_TEST_CASE(the_automatic_view_frames_what_it_shows) {
  const MixedVolume volume = ball_volume();
  const RenderOptions o = automatic_view(volume);
  const Camera c = orbit_camera(frame_view(volume, o, 30, 20), 30, 20, 1);
  BOOST_TEST(o.camera.position == c.position, boost::test_tools::per_element());
  BOOST_TEST(o.camera.focal_point == c.focal_point, boost::test_tools::per_element());
}
