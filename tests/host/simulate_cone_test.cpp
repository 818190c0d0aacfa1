// Cone-beam projections against quadrature, closed forms and the parallel limit.
#define BOOST_TEST_MODULE simulate_cone
#include "host/scan/simulate/simulate_cone.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"

using namespace vdvr;

namespace {

Vec3 unit(Vec3 v) {
  const double n = std::hypot(v[0], v[1], v[2]);
  for (double& x : v) x /= n;
  return v;
}

// Midpoints of many parts of a line that the object lies within.
double quadrature(const Phantom& p, const Vec3& from, const Vec3& along, double length, int parts) {
  double sum = 0;
  for (int i = 0; i < parts; ++i) {
    const double s = (i + 0.5) * length / parts;
    sum += p.density({from[0] + s * along[0], from[1] + s * along[1], from[2] + s * along[2]});
  }
  return sum * length / parts;
}

Volume rough_volume() {
  Volume v;
  v.grid.cells = {5, 4, 3};
  v.grid.spacing = {1.0, 1.5, 0.8};
  v.grid.origin = {-2.5, -3, -1.2};
  for (std::int64_t i = 0; i < v.grid.sample_count(); ++i)
    v.samples.push_back(static_cast<float>((i * 7919) % 101) / 50.0f - 1.0f);
  return v;
}

SimulateOptions small_cone(double R) {
  SimulateOptions o;
  o.angles = 5;
  o.arc_deg = 360;
  o.columns = 24;
  o.rows = 20;
  o.band_limited = false;
  o.cone.emplace();
  o.cone->source_to_axis = o.cone->source_to_detector = R;
  return o;
}

}  // namespace

BOOST_AUTO_TEST_CASE(an_ellipsoid_is_as_long_as_the_line_within_it) {
  const Phantom p = ellipsoid_list({{1.5, {1, -2, 0.5}, {3, 2, 1}, 25}}, 0, "one");
  for (int i = 0; i < 40; ++i) {
    const Vec3 from{20 * std::sin(i), 20 * std::cos(i), 3 * std::sin(2.0 * i)};
    const Vec3 along =
        unit({1 - from[0] + std::sin(3.0 * i), -2 - from[1], 0.5 - from[2] + 0.3 * std::cos(i)});
    // The density jumps twice: each costs half a part at most.
    constexpr int parts = 40000;
    BOOST_TEST(std::abs(p.ray_integral(from, along) - quadrature(p, from, along, 50, parts)) <=
               2 * 0.5 * 50.0 / parts * 1.5);
  }
}

BOOST_AUTO_TEST_CASE(a_line_through_the_middle_of_a_ball_is_its_diameter) {
  const Phantom p = sphere(2, 3);
  const Vec3 along = unit({1, 2, -3});
  BOOST_TEST(std::abs(p.ray_integral({-100 * along[0], -100 * along[1], -100 * along[2]}, along) - 12) <=
             tolerance::fp64_sum(100, 100));
}

BOOST_AUTO_TEST_CASE(a_volume_is_integrated_cell_by_cell) {
  const Phantom p = volume_phantom(rough_volume());
  for (int i = 0; i < 40; ++i) {
    const Vec3 from{15 * std::sin(i), 15 * std::cos(i), 6 * std::sin(1.3 * i)};
    const Vec3 along = unit({-from[0] + std::sin(5.0 * i), -from[1] + std::cos(2.0 * i), -from[2]});
    // Within a cell the midpoint rule errs by its square; at the box's faces the density jumps.
    constexpr int parts = 60000;
    BOOST_TEST(std::abs(p.ray_integral(from, along) - quadrature(p, from, along, 40, parts)) <=
               2 * 40.0 / parts * 1.0 + 40.0 * std::pow(40.0 / parts, 2) * 10);
  }
}

BOOST_AUTO_TEST_CASE(level_rays_are_those_of_parallel_beam) {
  for (const Phantom& p : {shepp_logan(10), volume_phantom(rough_volume())})
    for (int i = 0; i < 25; ++i) {
      const double theta = 0.37 * i, u = 2.3 * std::sin(2.0 * i), v = 0.9 * std::cos(1.0 * i);
      const Vec3 on{u * std::cos(theta), u * std::sin(theta), v}, along{-std::sin(theta), std::cos(theta), 0};
      BOOST_TEST(std::abs(p.ray_integral(on, along) - p.line_integral(theta, u, v)) <=
                 tolerance::fp64_sum(1000, 20));
    }
}

BOOST_AUTO_TEST_CASE(a_source_far_away_sees_what_parallel_rays_do) {
  const Phantom p = sphere(6);
  const SimulateOptions far = small_cone(1e7);
  SimulateOptions parallel = far;
  parallel.cone.reset();
  const ProjectionSet a = simulate(p, far), b = simulate(p, parallel);
  double worst = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a.data[i] - b.data[i])));
  // Rays move by 12 * 12 / R; the chord's slope is steepest at the rim, where it grows as a square root.
  BOOST_TEST(worst <= 2 * std::sqrt(2 * 6 * 144 / 1e7) + 12 * 0x1p-23);
}

BOOST_AUTO_TEST_CASE(a_small_ball_is_seen_where_the_matrix_says) {
  SimulateOptions o = small_cone(70);
  o.cone->source_to_detector = 105;
  o.pitch_u = o.pitch_v = 1.5;
  o.cone->detector_offset = 3;
  o.cone->in_plane_deg = 4;
  o.cone->out_of_plane_deg = -6;
  o.cone->supersampling = 4;
  const Vec3 place{3, -2, 1.5};
  const ProjectionSet scan = simulate(ellipsoid_list({{1, place, {1, 1, 1}, 0}}, 0, "ball"), o);
  for (std::int64_t k = 0; k < 5; ++k) {
    double sum = 0, u = 0, v = 0;
    for (std::int64_t j = 0; j < o.rows; ++j)
      for (std::int64_t i = 0; i < o.columns; ++i) {
        const auto s =
            static_cast<double>(scan.data[static_cast<std::size_t>((k * o.rows + j) * o.columns + i)]);
        sum += s;
        u += s * static_cast<double>(i);
        v += s * static_cast<double>(j);
      }
    const Vec3 seen = projected(scan.cone->views[static_cast<std::size_t>(k)], place);
    // A ball's shadow is an ellipse, whose middle is off the centre's image by (radius / distance)^2 of its
    // distance from the foot of the normal; pixels of a quarter cost a tenth.
    BOOST_TEST(std::abs(u / sum - seen[0]) <= 0.1);
    BOOST_TEST(std::abs(v / sum - seen[1]) <= 0.1);
  }
}

BOOST_AUTO_TEST_CASE(a_pixel_is_the_mean_of_its_parts) {
  const Phantom p = sphere(6);
  SimulateOptions o = small_cone(60), fine = o;
  o.cone->supersampling = 3;
  fine.columns *= 3;
  fine.rows *= 3;
  fine.pitch_u /= 3;
  fine.pitch_v /= 3;
  const ProjectionSet a = simulate(p, o), b = simulate(p, fine);
  for (std::int64_t k = 0; k < 5; ++k)
    for (std::int64_t j = 0; j < o.rows; ++j)
      for (std::int64_t i = 0; i < o.columns; ++i) {
        double sum = 0;
        for (std::int64_t m = 0; m < 9; ++m)
          sum += static_cast<double>(b.data[static_cast<std::size_t>(
              (k * fine.rows + 3 * j + m / 3) * fine.columns + 3 * i + m % 3)]);
        BOOST_REQUIRE(
            std::abs(sum / 9 - static_cast<double>(
                                   a.data[static_cast<std::size_t>((k * o.rows + j) * o.columns + i)])) <=
            tolerance::fp32_sum(4, 12));
      }
}

BOOST_AUTO_TEST_CASE(a_wide_source_blurs_and_keeps_the_mean) {
  const Phantom p = sphere(3);
  SimulateOptions o = small_cone(60), wide = o;
  o.cone->source_to_detector = wide.cone->source_to_detector = 120;
  o.pitch_u = o.pitch_v = wide.pitch_u = wide.pitch_v = 2;
  o.cone->supersampling = wide.cone->supersampling = 4;
  wide.cone->focal_spot = 6;
  const ProjectionSet a = simulate(p, o), b = simulate(p, wide);
  double sum_a = 0, sum_b = 0;
  float top_a = 0, top_b = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    sum_a += static_cast<double>(a.data[i]);
    sum_b += static_cast<double>(b.data[i]);
    top_a = std::max(top_a, a.data[i]);
    top_b = std::max(top_b, b.data[i]);
  }
  BOOST_TEST(top_b < top_a);
  BOOST_TEST(std::abs(sum_b / sum_a - 1) < 0.02);
}

BOOST_AUTO_TEST_CASE(the_folder_holds_the_geometry_that_was_simulated) {
  const vdvr::support::TemporaryFolder folder;
  SimulateOptions o = small_cone(70);
  o.angles = 12;
  o.cone->source_to_detector = 105;
  o.cone->in_plane_deg = 1;
  o.cone->out_of_plane_deg = -2;
  o.cone->sense = -1;
  const ProjectionSet scan = simulate(sphere(4), o);
  write_cone_scan(folder.path(), scan, o);
  const ProjectionSet read = read_scan(folder.path());
  BOOST_REQUIRE(read.cone.has_value());
  for (std::size_t k = 0; k < 12; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        BOOST_TEST(std::abs(read.cone->views[k][i][j] - scan.cone->views[k][i][j]) <=
                   tolerance::fp64_sum(20, 100));
  BOOST_TEST(std::equal(read.data.begin(), read.data.end(), scan.data.begin()));
}

BOOST_AUTO_TEST_CASE(set_ups_that_are_no_scan_are_refused) {
  const SimulateOptions good = small_cone(60);
  BOOST_CHECK_THROW(simulate(marschner_lobb(8), good), InputError);
  for (const auto& spoil : std::vector<std::function<void(ConeSetup&)>>{
           [](ConeSetup& c) { c.source_to_axis = 0; }, [](ConeSetup& c) { c.source_to_detector = -1; },
           [](ConeSetup& c) { c.in_plane_deg = 90; }, [](ConeSetup& c) { c.sense = 2; },
           [](ConeSetup& c) { c.supersampling = 0; }, [](ConeSetup& c) { c.focal_spot = -1; }}) {
    SimulateOptions bad = good;
    spoil(*bad.cone);
    BOOST_CHECK_THROW(simulate(sphere(4), bad), InputError);
  }
}
