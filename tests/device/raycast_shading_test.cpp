// Normals and light against closed forms: both gradients, every level border, fixed lights.
#define BOOST_TEST_MODULE raycast_shading
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>
#include <set>

#include "host/picture/render/raycast.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels, support::u;

namespace {

RenderOptions normals_of(const Grid& grid, double azimuth, double elevation, double iso) {
  RenderOptions o;
  o.mode = RenderMode::iso;
  o.output = RenderOutput::normal;
  o.width = o.height = 101;
  o.camera = orbit_camera(grid, azimuth, elevation, 1);
  o.surfaces = {{iso}};
  o.sampler = SamplerKind::buffer;
  return o;
}

Vec3 cell_of(const Grid& g, const Vec3& p) {
  Vec3 c{};
  for (std::size_t a = 0; a < 3; ++a)
    c[a] = std::clamp((p[a] - g.origin[a]) / g.spacing[a], 0.0, static_cast<double>(g.cells[a]));
  return c;
}

/// The derivative of the trilinear cell that a point lies in, per base cell: along an axis it is the
/// difference between the cell's two faces.
Vec3 cell_gradient(const MixedVolume& v, const Vec3& cell) {
  const Index3 brick{reference::brick_of(v, 0, cell[0]), reference::brick_of(v, 1, cell[1]),
                     reference::brick_of(v, 2, cell[2])};
  const Index3 n = v.bricks();
  const LevelTriple level = v.level[static_cast<std::size_t>(brick[0] + n[0] * (brick[1] + n[1] * brick[2]))];
  Vec3 g{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double scale = std::ldexp(1.0, level[2 - a]);
    const double low =
        std::min(std::floor(cell[a] * scale), static_cast<double>(v.grid.cells[a]) * scale - 1);
    Vec3 from = cell, to = cell;
    from[a] = low / scale;
    to[a] = (low + 1) / scale;
    g[a] = (reference::field_of_brick(v, brick, to) - reference::field_of_brick(v, brick, from)) * scale;
  }
  return g;
}

}  // namespace

BOOST_AUTO_TEST_CASE(analytic_normals_are_the_derivative_of_the_cell) {
  const MixedVolume v =
      support::random_mixed(centred_grid({10, 9, 8}), 4, 8, {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 3, 0}}, 4);
  const MixedVolume uniform = support::random_mixed(centred_grid({10, 9, 8}), 4, 1, {{0, 0, 0}}, 7);
  const MixedVolume coarse = support::random_mixed(
      centred_grid({10, 9, 8}), 4, 8, {{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 3, 0}}, 4, {2, 0, 1});
  for (const MixedVolume* field : {&v, &uniform, &coarse}) {
    const ResidentVolume resident(device(), *field);
    RenderOptions o = normals_of(field->grid, 37, 21, 0.2);
    o.gradient = GradientKind::analytic;
    const auto normals = raycast(device(), resident, o).values.values;
    o.output = RenderOutput::depth;
    const auto depths = raycast(device(), resident, o).values.values;
    int hits = 0, wrong = 0;
    for (std::int64_t i = 0; i < 101 * 101; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (std::isnan(depths[k]) || std::isnan(normals[3 * k])) continue;
      const Vec3 hit =
          cell_of(field->grid, reference::along(reference::pixel_ray(o.camera, 101, 101, i % 101, i / 101),
                                                static_cast<double>(depths[k])));
      // On a cell's face either side's derivative is right; positions are known to 8 u of 60 cells.
      const double near = 8 * u * 60;
      double best = 2;
      double longest = 0;
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 p = hit;
        for (std::size_t a = 0; a < 3; ++a)
          p[a] = std::clamp(p[a] + ((corner >> a & 1) != 0 ? near : -near), 0.0,
                            static_cast<double>(field->grid.cells[a]));
        const Vec3 g = cell_gradient(*field, p), truth = reference::unit(g);
        double worst = 0;
        for (std::size_t a = 0; a < 3; ++a)
          worst = std::max(worst, std::abs(static_cast<double>(normals[3 * k + a]) + truth[a]));
        if (worst < best) {
          best = worst;
          longest = std::sqrt(reference::dot(g, g));
        }
      }
      if (longest < 0.5) continue;
      ++hits;
      // Second mixed derivatives are at most 4 per cell of samples squared, 2 axes, twice `near` off; 14 u
      // of values over cells of 1/8.
      const double error = 2 * near * 2 * 4 * 8 * 4 + 14 * u * 2 * 8;
      if (!(best <= std::sqrt(3.0) * error / longest)) ++wrong;
    }
    BOOST_TEST(hits > 1000);
    BOOST_TEST(wrong == 0);
  }
}

BOOST_AUTO_TEST_CASE(the_default_gradient_has_no_seam_at_any_level_border) {
  const Grid grid = centred_grid({32, 28, 32});
  // f = -(x^2 + y^2 + z^2) / 2: second derivatives are 1, gradients are positions. Spheres one cell apart
  // cross every border near the middle; from six sides all of each is seen.
  const auto f = [](double x, double y, double z) { return -(x * x + y * y + z * z) / 2; };
  const MixedVolume mixed = fields::mixed(grid, 4, scattered_levels, f);
  const ResidentVolume v(device(), mixed);
  const Index3 n = mixed.bricks();
  std::set<std::array<std::int64_t, 4>> met;  // axis, brick above the border
  double worst_excess = 0;
  for (double radius = 4.25; radius < 14; radius += 1)
    for (const auto& [azimuth, elevation] :
         {std::pair{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 89}, {0, -89}}) {
      RenderOptions o = normals_of(grid, azimuth, elevation, -radius * radius / 2);
      const auto normals = raycast(device(), v, o).values.values;
      o.output = RenderOutput::depth;
      const auto depths = raycast(device(), v, o).values.values;
      for (std::int64_t i = 0; i < 101 * 101; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (std::isnan(depths[k])) continue;
        const Vec3 p = reference::along(reference::pixel_ray(o.camera, 101, 101, i % 101, i / 101),
                                        static_cast<double>(depths[k]));
        const Vec3 truth = reference::unit(p), cell = cell_of(grid, p);
        const double error = std::sqrt(3.0) * 3 / 8;  // as in raycast_truth_test: 3/8 per axis
        const double allowed = error / (radius - 0.5 - error);
        for (std::size_t a = 0; a < 3; ++a) {
          worst_excess =
              std::max(worst_excess, std::abs(static_cast<double>(normals[3 * k + a]) - truth[a]) - allowed);
          const std::int64_t border = std::llround(cell[a] / 4);
          if (!(std::abs(cell[a] - 4.0 * static_cast<double>(border)) < 0.5)) continue;
          Index3 b{};
          for (std::size_t c = 0; c < 3; ++c) b[c] = reference::brick_of(mixed, c, cell[c]);
          b[a] = border;
          met.insert({static_cast<std::int64_t>(a), b[0], b[1], b[2]});
        }
      }
    }
  BOOST_TEST(!(worst_excess > 0));
  int borders = 0, unmet = 0;
  for (std::int64_t axis = 0; axis < 3; ++axis)
    for (std::int64_t z = 1; z < n[2]; ++z)
      for (std::int64_t y = 1; y < n[1]; ++y)
        for (std::int64_t x = 1; x < n[0]; ++x) {
          const auto a = static_cast<std::size_t>(axis);
          const Index3 high{x, y, z};
          Index3 low = high;
          --low[a];
          Vec3 middle{};
          for (std::size_t c = 0; c < 3; ++c)
            middle[c] = grid.origin[c] + 4.0 * static_cast<double>(high[c]) + (c == a ? 0 : 2);
          const double distance = std::sqrt(reference::dot(middle, middle));
          if (scattered_levels(high) == scattered_levels(low) || distance < 5 || distance > 12) continue;
          ++borders;
          if (met.count({axis, x, y, z}) == 0) ++unmet;
        }
  BOOST_TEST(borders > 100);
  BOOST_TEST(unmet == 0);
}

BOOST_AUTO_TEST_CASE(fixed_lights_follow_the_closed_form) {
  const Grid grid = centred_grid({8, 8, 8});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double y, double) { return -y; })));
  RenderOptions o;
  o.mode = RenderMode::iso;
  o.width = o.height = 9;
  o.camera = orbit_camera(grid, 0, 0, 1);
  o.sampler = SamplerKind::buffer;
  o.surfaces = {{-2, 1, {0.4, 0.2, 0.1}}};
  // Seen along -y: the surface faces the eye, whichever way density grows.
  const Vec3 towards_eye{0, 1, 0};
  for (const bool head : {true, false})
    for (const std::vector<Vec3>& lights :
         {std::vector<Vec3>{{0, 3, 0}}, {{1, 1, 0}}, {{0, -1, 0}}, {{0, 1, 2}, {-1, 0.5, 0}}, {}}) {
      o.head_light = head;
      o.lights = lights;
      double diffuse = head ? 1 : 0, highlight = head ? 1 : 0;
      for (const Vec3& l : lights) {
        const Vec3 to = reference::unit(l);
        diffuse += std::max(0.0, reference::dot(to, towards_eye));
        const Vec3 half_way{to[0], to[1] + 1, to[2]};
        const double length = std::sqrt(reference::dot(half_way, half_way));
        if (reference::dot(to, towards_eye) > 0) highlight += std::pow(half_way[1] / length, 24);
      }
      const double all = static_cast<double>(lights.size()) + (head ? 1 : 0);
      const auto p = raycast_float(device(), v, o).pixels[9 * 4 + 4];
      for (std::size_t c = 0; c < 3; ++c) {
        const double truth =
            o.surfaces[0].rgb[c] * (0.25 + 0.75 / std::max(1.0, all) * diffuse) + 0.2 * highlight;
        // A power of 24 carries the error of its base, a dozen operations, 24 times.
        BOOST_TEST(!(std::abs(static_cast<double>(p.s[c]) - truth) > 24 * 16 * u * (1 + all)));
      }
    }
}

BOOST_AUTO_TEST_CASE(lights_without_direction_and_too_many_are_refused) {
  const Grid grid = centred_grid({4, 4, 4});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double x, double, double) { return x; })));
  for (const std::vector<Vec3>& lights :
       {std::vector<Vec3>{{0, 0, 0}}, {{NAN, 0, 1}}, std::vector<Vec3>(9, Vec3{1, 0, 0})}) {
    RenderOptions o = normals_of(grid, 0, 0, 0.5);
    o.lights = lights;
    BOOST_CHECK_THROW(raycast(device(), v, o), InputError);
  }
}
