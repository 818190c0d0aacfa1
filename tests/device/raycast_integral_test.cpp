// Line integrals of the device against closed forms, and against the walk of rays in double precision on the
// host.
#define BOOST_TEST_MODULE raycast_integral
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <numbers>

#include "host/picture/rays/line_integral.hpp"
#include "host/picture/render/raycast.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/charged.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels, support::u;

namespace {

RenderOptions options_for(const Camera& camera, std::int64_t size = 33) {
  RenderOptions o;
  o.mode = RenderMode::integral;
  o.width = o.height = size;
  o.camera = camera;
  return o;
}

/// From outside, along an axis through faces of bricks, from within, from far away.
std::vector<Camera> cameras(const Grid& grid) {
  return {orbit_camera(grid, 37, 21, 1), orbit_camera(grid, 0, 0, 1),
          look_at({3, -2, 1}, {9, 4, 2}, std::nullopt, 90), look_at({0, 500, 0}, {0, 0, 0}, std::nullopt, 3)};
}

/// How far fp32 moves a place on a ray from `eye`, in cells: some units of the numbers that are added.
double moved(const Camera& camera, const Grid& grid) {
  double farthest = 0;
  for (std::size_t a = 0; a < 3; ++a)
    farthest += std::abs(camera.position[a]) + static_cast<double>(grid.cells[a]);
  return 8 * u * farthest;
}

double blob(double x, double y, double z) {
  const double r2 = (x - 3) * (x - 3) + (y + 2) * (y + 2) * 1.5 + (z - 1) * (z - 1) * 0.7;
  return std::max(0.0, 1 - r2 / 90);
}

/// All of the grid is covered.
Coverage wide_coverage(std::int64_t side) {
  ParallelGeometry g;
  g.columns = 4 * side;
  g.rows = 4 * side;
  g.center = 0.5 * static_cast<double>(g.columns - 1);
  for (int k = 0; k < 8; ++k) g.theta_rad.push_back(std::numbers::pi * k / 8);
  return Coverage(g);
}

std::vector<SamplerKind> samplers(const ResidentVolume& v) {
  std::vector<SamplerKind> all{SamplerKind::buffer};
  if (v.has_image3d()) all.push_back(SamplerKind::image3d);
  return all;
}

/// How far the field that a sampler reads lies from that of the host; along a ray it adds up to no more than
/// this times the path, for a cubic's integral is a mean of the values that it is made of.
double between(SamplerKind sampler, const MixedVolume& v) {
  return sampler == SamplerKind::buffer ? 0.0 : support::charged_between_samplers(v);
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_integral_of_a_linear_field_is_its_middle_times_the_path) {
  Grid grid = centred_grid({30, 27, 33});
  for (const double spacing : {1.0, 0.25}) {
    for (std::size_t a = 0; a < 3; ++a) {
      grid.origin[a] *= spacing / grid.spacing[a];
      grid.spacing[a] = spacing;
    }
    // In cells, so that both grids hold the same numbers.
    const auto f = [&](double x, double y, double z) {
      return 0.5 + (0.01 * x + 0.007 * y - 0.011 * z) / spacing;
    };
    const MixedVolume volume = fields::mixed(grid, 4, scattered_levels, f);
    const ResidentVolume v(device(), volume);
    for (const SamplerKind sampler : samplers(v)) {
      const double charged = between(sampler, volume);
      RenderOptions o = options_for(orbit_camera(grid, 37, 21, 1));
      o.sampler = sampler;
      const auto picture = raycast_float(device(), v, o);
      int hits = 0;
      for (std::int64_t y = 0; y < o.height; ++y)
        for (std::int64_t x = 0; x < o.width; ++x) {
          const auto ray = reference::pixel_ray(o.camera, o.width, o.height, x, y);
          const auto [in, out] = reference::clip(ray, grid);
          const Vec3 middle = reference::along(ray, 0.5 * (in + out));
          const double length = std::max(0.0, out - in),
                       truth = length > 0 ? length * f(middle[0], middle[1], middle[2]) : 0;
          hits += length > 0 ? 1 : 0;
          // Ends that moved, positions that moved, 16 roundings of values up to 1 and of their product.
          const double move = 8 * u * (3 * std::abs(o.camera.position[1]) / spacing + 100) * spacing,
                       allowed = 4 * move + 0.05 / spacing * length * move + (32 * u + charged) * length;
          BOOST_TEST(
              std::abs(static_cast<double>(picture.pixels[static_cast<std::size_t>(y * o.width + x)].s[3]) -
                       truth) <= allowed);
        }
      BOOST_TEST(hits > 300);
    }
  }
}

/// How far `found` lies from the integral along the ray, or along one that rounding may have made of it: of
/// rays in a face that two bricks of different levels share, the field is that of either.
double beside(const RayField& field, const WorldRay& ray, double found, double move, double allowed) {
  double least = std::abs(found - integral_along(field, ray).value);
  for (int k = 0; k < 27 && least > allowed; ++k) {
    WorldRay moved = ray;
    moved.origin[0] += (k % 3 - 1) * move;
    moved.origin[1] += (k / 3 % 3 - 1) * move;
    moved.origin[2] += (k / 9 - 1) * move;
    least = std::min(least, std::abs(found - integral_along(field, moved).value));
  }
  return least;
}

BOOST_AUTO_TEST_CASE(integrals_are_those_of_the_cubics_in_double_precision_at_every_level) {
  for (const LevelTriple& coarse : {LevelTriple{0, 0, 0}, LevelTriple{2, 2, 1}}) {
    const Grid grid = centred_grid({32, 28, 32});
    const MixedVolume volume = fields::mixed(grid, 4, scattered_levels, blob, coarse);
    const ResidentVolume v(device(), volume);
    const Coverage coverage = wide_coverage(33);
    const std::vector<float> none(volume.level.size(), 0.0f);
    const RayField field(volume, none, coverage);
    for (const Camera& camera : cameras(grid))
      for (const SamplerKind sampler : samplers(v)) {
        RenderOptions o = options_for(camera);
        o.sampler = sampler;
        const auto picture = raycast_float(device(), v, o);
        const double charged = between(sampler, volume);
        double most = 0, allowed_most = 0;
        for (std::int64_t y = 0; y < o.height; ++y)
          for (std::int64_t x = 0; x < o.width; ++x) {
            const WorldRay ray = pixel_ray(camera, o.width, o.height, x, y);
            const auto [in, out] = field.clipped(ray);
            // Values up to 1 and slopes up to 1 a cell along each axis.
            const double length = std::max(0.0, out - in), move = moved(camera, grid),
                         allowed = 4 * move + 3 * length * move + 32 * u * length;
            const double found =
                static_cast<double>(picture.pixels[static_cast<std::size_t>(y * o.width + x)].s[3]);
            const double off = beside(field, ray, found, move, allowed + charged * length);
            BOOST_TEST(off <= allowed + charged * length,
                       "pixel " << x << ", " << y << " seen from " << camera.position[0] << ", "
                                << camera.position[1] << ", " << camera.position[2] << ": " << found
                                << " is off by " << off << ", by more than " << allowed + charged * length);
            most = std::max(most, found);
            allowed_most = std::max(allowed_most, allowed);
          }
        BOOST_TEST(most > 5);
        // A tolerance that says something.
        BOOST_TEST(allowed_most < most / 100);
      }
  }
}

BOOST_AUTO_TEST_CASE(a_clip_cuts_integrals_and_what_is_missed_is_nothing) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 0.5; })));
  RenderOptions o = options_for(orbit_camera(grid, 0, 0, 1), 9);
  constexpr std::size_t centre = 9 * 4 + 4;
  const auto value = [&] { return static_cast<double>(raycast(device(), v, o).values.values[centre]); };
  const double move = 16 * u * (std::abs(o.camera.position[1]) + 24);
  BOOST_TEST(std::abs(value() - 12) <= move);
  o.clip = Clip{};
  o.clip->low[1] = -3;
  o.clip->high[1] = 5;
  // Rounded inward by 2^-20 of the distances.
  BOOST_TEST(std::abs(value() - 4) <= move + 0x1p-18 * (std::abs(o.camera.position[1]) + 24));
  // Beside the grid there is nothing, in any mode.
  for (const double low : {100.0, -100.0}) {
    o.clip->low[1] = low;
    o.clip->high[1] = low + 1;
    BOOST_TEST(value() == 0);
    RenderOptions others = o;
    others.transfer = transfer_preset("grey", 0, 1);
    others.surfaces = {{0.25}};
    for (const RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::iso}) {
      others.mode = mode;
      BOOST_TEST(raycast(device(), v, others).samples == 0);
    }
  }
}

BOOST_AUTO_TEST_CASE(greys_run_over_the_window_and_by_default_over_the_picture) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, blob)));
  RenderOptions o = options_for(orbit_camera(grid, 20, 10, 1));
  const RenderResult automatic = raycast(device(), v, o);
  const auto range = range_of_values(automatic.values);
  BOOST_TEST(range.first == 0);
  BOOST_TEST(*std::max_element(automatic.image.rgb.begin(), automatic.image.rgb.end()) == 255);
  o.slice_range = range;
  BOOST_TEST((raycast(device(), v, o).image.rgb == automatic.image.rgb));
  o.slice_range = std::pair{0.25 * range.second, 0.5 * range.second};
  const RenderResult cut = raycast(device(), v, o);
  for (std::size_t i = 0; i < cut.values.values.size(); ++i) {
    const double part =
        std::clamp((static_cast<double>(cut.values.values[i]) / range.second - 0.25) / 0.25, 0.0, 1.0);
    // Half a byte, and rounding.
    BOOST_TEST(std::abs(255 * part - cut.image.rgb[3 * i]) <= 0.5 + 0x1p-10);
  }
}

BOOST_AUTO_TEST_CASE(what_an_integral_has_not_is_refused) {
  const Grid grid = centred_grid({8, 8, 8});
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, blob)));
  const RenderOptions plain = options_for(orbit_camera(grid, 0, 0, 1), 5);
  for (const RenderOutput output : {RenderOutput::depth, RenderOutput::normal}) {
    RenderOptions o = plain;
    o.output = output;
    BOOST_CHECK_THROW(raycast(device(), v, o), InputError);
  }
  RenderOptions o = plain;
  o.slice_range = std::pair{2.0, 1.0};
  BOOST_CHECK_THROW(raycast(device(), v, o), InputError);
}
