// Pictures against closed forms: absorption of a ramp, depths, normals across level borders, surfaces in
// order.
#define BOOST_TEST_MODULE raycast_truth
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>

#include "host/picture/render/raycast.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels, support::u;

namespace {

// Along -y through the middle of an odd picture; the eye stands `distance` before the centre.
RenderOptions along_y(const Grid& grid, RenderMode mode, double azimuth = 0) {
  RenderOptions o;
  o.mode = mode;
  o.width = o.height = 9;
  o.camera = orbit_camera(grid, azimuth, 0, 1);
  o.sampler = SamplerKind::buffer;
  o.shading = false;
  o.termination = 1;
  o.background_top = o.background_bottom = {0, 0, 0};
  o.transfer = {"clear", {{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, 0}}};
  return o;
}
constexpr std::size_t kCentre = 9 * 4 + 4;

double eye_distance(const RenderOptions& o) { return std::abs(o.camera.position[1]); }

}  // namespace

BOOST_AUTO_TEST_CASE(a_ramp_absorbs_by_the_closed_form_with_the_square_of_the_step) {
  const Grid grid = centred_grid({24, 24, 24});
  const double length = 24, largest = 0.2, kappa = largest / length;
  // Seen along -y the opacity of a cell grows from 0 at the entry to 0.2 at the exit.
  const ResidentVolume v(
      device(), as_mixed(fields::uniform(grid, [&](double, double y, double) { return (12 - y) / length; })));
  RenderOptions o = along_y(grid, RenderMode::dvr);
  o.transfer = {"ramp", {{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, largest}}};
  // The integral of ln(1 - kappa s) over the path.
  const double rest = 1 - largest, integral = (-1 - (rest * std::log(rest) - rest)) / kappa;
  const double truth = 1 - std::exp(integral);
  for (const double step : {2.0, 1.0, 0.5, 0.25}) {
    o.step = step;
    const double alpha = static_cast<double>(raycast(device(), v, o).values.values[kCentre]);
    // Midpoints err by h^2 / 24 times the length and the largest second derivative of the logarithm. The
    // table errs by h^2 / 8 of its spacing times the curvature of the opacity, 0.2^2 s^2 / 0.8 at most, per
    // sample.
    const double midpoint = step * step / 24 * length * (kappa * kappa) / (rest * rest);
    const double table = length / step * (largest * largest / rest) / (8.0 * 1023 * 1023);
    const double rounding = tolerance::fp32_sum(6 * static_cast<std::int64_t>(length / step), 1);
    BOOST_TEST(!(std::abs(alpha - truth) > midpoint + table + rounding));
  }
}

BOOST_AUTO_TEST_CASE(dvr_depth_is_of_the_sample_that_reaches_half_the_opacity) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 0.5; })));
  RenderOptions o = along_y(grid, RenderMode::dvr);
  o.transfer = {"constant", {{0, {1, 1, 1}, 0.05}, {1, {1, 1, 1}, 0.05}}};
  o.output = RenderOutput::depth;
  const auto r = raycast(device(), v, o);
  // 0.95^14 is the first power below a half.
  const double truth = eye_distance(o) - 12 + 13.5;
  BOOST_TEST(!(std::abs(static_cast<double>(r.values.values[kCentre]) - truth) > 8 * u * truth));
  // A constant field faces nowhere.
  o.output = RenderOutput::normal;
  const auto normals = raycast(device(), v, o).values;
  BOOST_TEST(normals.channels == 3);
  BOOST_TEST(normals.values.size() == 3u * 81);
  BOOST_TEST(std::isnan(normals.values[3 * kCentre]));
  // Too thin to hide a half: no depth.
  o.transfer.points = {{0, {1, 1, 1}, 0.01}, {1, {1, 1, 1}, 0.01}};
  o.output = RenderOutput::depth;
  BOOST_TEST(std::isnan(raycast(device(), v, o).values.values[kCentre]));
}

BOOST_AUTO_TEST_CASE(mip_depth_is_of_the_largest_sample) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(
      device(), as_mixed(fields::uniform(grid, [](double, double y, double) { return -std::abs(y - 3.5); })));
  RenderOptions o = along_y(grid, RenderMode::mip);
  o.output = RenderOutput::depth;
  const double truth = eye_distance(o) - 3.5;
  BOOST_TEST(!(std::abs(static_cast<double>(raycast(device(), v, o).values.values[kCentre]) - truth) >
               8 * u * truth));
}

BOOST_AUTO_TEST_CASE(translucent_surfaces_are_composited_in_the_order_of_the_ray) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double y, double) { return y; })));
  const IsoSurface low{-4.25, 0.25, {1, 0, 0}}, high{5.5, 0.5, {0, 1, 0}};
  for (const double azimuth : {0.0, 180.0})
    // A step of 16 crosses both between two samples.
    for (const double step : {1.0, 16.0}) {
      RenderOptions o = along_y(grid, RenderMode::iso, azimuth);
      o.step = step;
      o.surfaces = {high, low};  // in any order
      const auto p = raycast_float(device(), v, o).pixels[kCentre];
      // From +y the high surface comes first.
      const IsoSurface &first = azimuth == 0 ? high : low, &second = azimuth == 0 ? low : high;
      for (std::size_t c = 0; c < 3; ++c) {
        const double truth =
            first.opacity * first.rgb[c] + (1 - first.opacity) * second.opacity * second.rgb[c];
        BOOST_TEST(!(std::abs(static_cast<double>(p.s[c]) - truth) > 4 * u));
      }
      const double depth = eye_distance(o) - std::abs(first.value);
      BOOST_TEST(!(std::abs(static_cast<double>(p.s[3]) - depth) > 0x1p-13 * step + 8 * u * depth));
    }
}

BOOST_AUTO_TEST_CASE(one_opaque_surface_hides_those_behind_it) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double y, double) { return y; })));
  RenderOptions o = along_y(grid, RenderMode::iso);
  o.surfaces = {{5.5, 1, {0, 1, 0}}};
  const auto one = raycast(device(), v, o).image.rgb;
  o.surfaces.push_back({-4, 1, {1, 0, 0}});
  BOOST_TEST(raycast(device(), v, o).image.rgb == one, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(normals_follow_the_analytic_gradient_across_every_level_border) {
  const Grid grid = centred_grid({30, 27, 33});
  // f = -(x^2 + y^2 + z^2) / 2: second derivatives are 1, gradients are positions.
  const auto f = [](double x, double y, double z) { return -(x * x + y * y + z * z) / 2; };
  const ResidentVolume uniform(device(), as_mixed(fields::uniform(grid, f)));
  const ResidentVolume mixed(device(), fields::mixed(grid, 4, scattered_levels, f));
  const double radius = 11;
  for (const ResidentVolume* v : {&uniform, &mixed})
    for (const double azimuth : {0.0, 37.0, 200.0}) {
      RenderOptions o = along_y(grid, RenderMode::iso);
      o.width = o.height = 101;
      o.camera = orbit_camera(grid, azimuth, 21, 1);
      o.surfaces = {{-radius * radius / 2}};
      o.output = RenderOutput::normal;
      const auto normals = raycast(device(), *v, o).values.values;
      o.output = RenderOutput::depth;
      const auto depths = raycast(device(), *v, o).values.values;
      int hits = 0;
      double worst = 0;
      for (std::int64_t i = 0; i < 101 * 101; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (std::isnan(depths[k])) continue;
        ++hits;
        const Vec3 p = reference::along(reference::pixel_ray(o.camera, 101, 101, i % 101, i / 101),
                                        static_cast<double>(depths[k]));
        const Vec3 truth = reference::unit(p);
        for (std::size_t a = 0; a < 3; ++a)
          worst = std::max(worst, std::abs(static_cast<double>(normals[3 * k + a]) - truth[a]));
      }
      BOOST_TEST(hits > 1000);
      // An interpolant of second derivatives 1 lies 0 to 1/8 above per axis, so a difference over one cell
      // errs by 3/8 at most, also between levels; three axes, and the gradient is `radius` long less that
      // much.
      const double error = std::sqrt(3.0) * 3 / 8;
      BOOST_TEST(!(worst > error / (radius - 0.5 - error)));
    }
}

BOOST_AUTO_TEST_CASE(a_linear_field_has_one_normal_at_every_point) {
  const Grid grid = centred_grid({30, 27, 33});
  const auto f = [](double x, double y, double z) { return 0.5 + 0.01 * x + 0.007 * y - 0.011 * z; };
  const ResidentVolume v(device(), fields::mixed(grid, 4, scattered_levels, f));
  const Vec3 truth = reference::unit({-0.01, -0.007, 0.011});
  RenderOptions o = along_y(grid, RenderMode::iso);
  o.width = o.height = 101;
  o.output = RenderOutput::normal;
  for (const double iso : {0.4, 0.5, 0.55}) {
    o.surfaces = {{iso}};
    const auto normals = raycast(device(), v, o).values.values;
    double worst = 0;
    int hits = 0;
    for (std::size_t i = 0; i < normals.size(); i += 3)
      for (std::size_t a = 0; a < 3 && !std::isnan(normals[i]); ++a, ++hits)
        worst = std::max(worst, std::abs(static_cast<double>(normals[i + a]) - truth[a]));
    BOOST_TEST(hits > 1000);
    // Samples of at most 1 err by u stored and 14 u interpolated, differences by twice that.
    const double gradient = std::hypot(0.01, 0.007, 0.011);
    BOOST_TEST(!(worst > std::sqrt(3.0) * 2 * 15 * u / gradient + 8 * u));
  }
}

BOOST_AUTO_TEST_CASE(geometry_is_the_same_without_skipping_and_in_packets_of_any_size) {
  const auto blob = [](double x, double y, double z) {
    return std::max(0.0, 1 - ((x - 3) * (x - 3) + (y + 2) * (y + 2) * 1.5 + z * z) / 90);
  };
  const ResidentVolume v(device(), fields::mixed(centred_grid({30, 27, 33}), 4, scattered_levels, blob));
  const auto same = [](const auto& a, const auto& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(cl_float4)) == 0;
  };
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso}) {
    RenderOptions o = along_y(v.grid(), mode, 37);
    o.width = o.height = 37;
    o.transfer = transfer_preset("default", 0, 1);
    o.surfaces = {{0.3, 0.4}, {0.6, 0.7}};
    for (const RenderOutput output : {RenderOutput::colour, RenderOutput::normal}) {
      o.output = output;
      o.shading = true;
      o.skip_empty = true;
      const auto with = raycast_float(device(), v, o).pixels;
      BOOST_TEST(same(with, raycast_float(device(), v, o, {8, 8, 1}).pixels));
      o.skip_empty = false;
      BOOST_TEST(same(with, raycast_float(device(), v, o).pixels));
    }
  }
}

BOOST_AUTO_TEST_CASE(what_a_mode_cannot_show_is_refused) {
  const Grid grid = centred_grid({4, 4, 4});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 1.0; })));
  const auto is_refused = [&](RenderMode mode, auto&& change) {
    RenderOptions o = along_y(grid, mode);
    o.surfaces = {{0.5}};
    change(o);
    try {
      raycast(device(), v, o);
    } catch (const InputError&) {
      return true;
    }
    return false;
  };
  BOOST_TEST(is_refused(RenderMode::mip, [](auto& o) { o.output = RenderOutput::normal; }));
  BOOST_TEST(is_refused(RenderMode::slice, [](auto& o) { o.output = RenderOutput::depth; }));
  BOOST_TEST(is_refused(RenderMode::iso, [](auto& o) { o.surfaces.clear(); }));
  BOOST_TEST(is_refused(RenderMode::iso, [](auto& o) { o.surfaces.resize(9); }));
  BOOST_TEST(is_refused(RenderMode::iso, [](auto& o) { o.surfaces[0].opacity = 1.5; }));
  BOOST_TEST(is_refused(RenderMode::iso, [](auto& o) { o.surfaces[0].value = NAN; }));
}
