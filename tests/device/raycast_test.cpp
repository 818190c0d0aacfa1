#define BOOST_TEST_MODULE raycast
#include <boost/test/unit_test.hpp>

#include <limits>

#include "host/picture/render/raycast.hpp"
#include "host/volume/sampler/resident_volume.hpp"
#include "shared/raycast_params.h"
#include "tests/reference/raycast.hpp"
#include "tests/support/blob_pictures.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::blob, support::coarse_blob, support::device, support::mixed_blob, support::options_for,
    support::same_bits, support::scattered_levels, support::u;

namespace {

TransferFunction constant_transfer(double opacity, const Vec3& rgb = {1, 0.5, 0.25}) {
  return {"constant", {{0, rgb, opacity}, {1, rgb, opacity}}};
}

double largest_difference(const std::vector<cl_float4>& a, const std::vector<cl_float4>& b,
                          std::size_t components = 4) {
  double worst = a.size() == b.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
    for (std::size_t c = 0; c < components; ++c) {
      if (a[i].s[c] == b[i].s[c] || (std::isnan(a[i].s[c]) && std::isnan(b[i].s[c]))) continue;
      const double d = std::abs(static_cast<double>(a[i].s[c]) - static_cast<double>(b[i].s[c]));
      if (!(d <= worst)) worst = std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
    }
  return worst;
}

// The brightest pixel of a picture.
std::pair<std::int64_t, std::int64_t> brightest(const Image& image) {
  std::int64_t at = 0, best = -1;
  for (std::int64_t i = 0; i < image.width * image.height; ++i) {
    const auto k = static_cast<std::size_t>(3 * i);
    const std::int64_t sum = image.rgb[k] + image.rgb[k + 1] + image.rgb[k + 2];
    if (sum > best) {
      best = sum;
      at = i;
    }
  }
  return {at % image.width, at / image.width};
}

}  // namespace

BOOST_AUTO_TEST_CASE(constant_slab_absorbs_by_the_closed_form) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 0.5; })));
  for (const double step : {1.0, 0.5, 0.25}) {
    RenderOptions o = options_for(grid, RenderMode::dvr, 33);
    o.camera = orbit_camera(grid, 0, 0, 1);
    o.transfer = constant_transfer(0.05);
    o.shading = false;
    o.termination = 1;
    o.step = step;
    const auto picture = raycast_float(device(), v, o);
    // The central ray runs along y through 24 base cells; rounding accumulates over the steps taken.
    const cl_float4 centre = picture.pixels[33 * 16 + 16];
    const double truth = 1 - std::pow(1 - 0.05, 24);
    const double allowed = tolerance::fp32_sum(4 * static_cast<std::int64_t>(24 / step), 1);
    BOOST_TEST(!(std::abs(static_cast<double>(centre.s[3]) - truth) > allowed));
    const double behind = (o.background_top[1] + o.background_bottom[1]) / 2;
    BOOST_TEST(
        !(std::abs(static_cast<double>(centre.s[1]) - (0.5 * truth + (1 - truth) * behind)) > allowed));
  }
}

BOOST_AUTO_TEST_CASE(picture_matches_the_double_precision_reference) {
  Grid grid = centred_grid({20, 16, 12}, {1, 1.25, 2});
  grid.origin = {100, -50, 7};
  // A linear field: trilinear interpolation is exact, so the reference evaluates the function itself.
  const auto linear = [&](double x, double y, double z) {
    return 0.02 * (x - 100) + 0.015 * (y + 50) + 0.01 * (z - 7);
  };
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, linear)));
  RenderOptions o = options_for(grid, RenderMode::dvr, 24);
  o.shading = false;
  o.termination = 1;
  o.step = 0.5;
  o.transfer = {"ramp", {{0, {0, 0.2, 1}, 0.0}, {1, {1, 0.8, 0}, 0.2}}};
  o.background_top = o.background_bottom = {0, 0, 0};
  const auto picture = raycast_float(device(), v, o);
  const auto emit = [&](const Vec3& p) {
    const double f = std::clamp(linear(p[0], p[1], p[2]), 0.0, 1.0);
    return reference::Emission{{f, 0.2 + 0.6 * f, 1 - f}, 1 - std::pow(1 - 0.2 * f, 0.5)};
  };
  // Opacity is tabulated at 1024 points: its curvature (0.2^2 / 4 at most) times h^2 / 8 per sample. A ray
  // that leaves within rounding of a sample may take one more or fewer: one step's opacity, for a few rays
  // only.
  const double table = 0.01 / (8.0 * 1023 * 1023), rounding = 64 * u * 100;
  int apart = 0;
  for (std::int64_t y = 0; y < 24; ++y)
    for (std::int64_t x = 0; x < 24; ++x) {
      const auto truth =
          reference::emission_absorption(reference::pixel_ray(o.camera, 24, 24, x, y), grid, 0.5, emit);
      const auto& p = picture.pixels[static_cast<std::size_t>(24 * y + x)];
      double worst = 0;
      for (std::size_t c = 0; c < 4; ++c)
        worst = std::max(worst, std::abs(static_cast<double>(p.s[c]) - truth[c]));
      if (!(worst <= 128 * (table + rounding * 0.02))) ++apart;
      BOOST_TEST(!(worst > 0.11));
    }
  BOOST_TEST(apart <= 6);
}

BOOST_AUTO_TEST_CASE(skipping_empty_bricks_changes_no_bit) {
  for (const MixedVolume& field : {mixed_blob(), coarse_blob()}) {
    const ResidentVolume v(device(), field);
    for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::mip})
      for (const double azimuth : {0.0, 37.0, 90.0, 203.0})
        for (const double step : {1.0, 0.3, 7.5}) {
          RenderOptions o = options_for(v.grid(), mode);
          o.camera = orbit_camera(v.grid(), azimuth, azimuth / 5, 1.3);
          o.step = step;
          o.surfaces = {{0.6}};
          const auto with = raycast_float(device(), v, o);
          o.skip_empty = false;
          const auto without = raycast_float(device(), v, o);
          BOOST_TEST(same_bits(with.pixels, without.pixels));
          BOOST_TEST(with.samples < without.samples);
        }
  }
}

BOOST_AUTO_TEST_CASE(skipping_changes_no_bit_from_inside_the_volume) {
  for (const MixedVolume& field : {mixed_blob(), coarse_blob()}) {
    const ResidentVolume v(device(), field);
    for (const Vec3& eye : {Vec3{3, -2, 1}, Vec3{-10, 4, 2}})
      for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::mip}) {
        RenderOptions o = options_for(v.grid(), mode);
        o.camera.position = eye;
        o.camera.focal_point = {eye[0] + 1, eye[1], eye[2]};
        o.camera.view_angle_deg = 100;
        o.surfaces = {{0.6}};
        const auto with = raycast_float(device(), v, o);
        o.skip_empty = false;
        BOOST_TEST(same_bits(with.pixels, raycast_float(device(), v, o).pixels));
        for (const auto& p : with.pixels)
          for (const float c : p.s) BOOST_REQUIRE(std::isfinite(c));
      }
  }
}

BOOST_AUTO_TEST_CASE(work_group_shape_changes_no_bit) {
  const ResidentVolume v(device(), mixed_blob());
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::integral}) {
    RenderOptions o = options_for(v.grid(), mode, 37);
    o.surfaces = {{0.5}};
    const auto square = raycast_float(device(), v, o, {8, 8, {}});
    BOOST_TEST(same_bits(square.pixels, raycast_float(device(), v, o, {16, 2, {}}).pixels));
  }
}

BOOST_AUTO_TEST_CASE(the_number_of_rays_in_a_packet_changes_no_bit) {
  const auto levels_at_one_end = [](const Index3& b) {
    return b[0] < 2 ? scattered_levels(b) : LevelTriple{0, 0, 0};
  };
  const ResidentVolume mixed(device(), fields::mixed(centred_grid({30, 27, 33}), 4, levels_at_one_end, blob));
  const ResidentVolume scattered(device(), mixed_blob()), coarse(device(), coarse_blob());
  const ResidentVolume uniform(device(), as_mixed(fields::uniform(centred_grid({30, 27, 33}), blob)));
  for (const ResidentVolume* v : {&mixed, &scattered, &coarse, &uniform})
    for (const RenderMode mode :
         {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice, RenderMode::integral}) {
      RenderOptions o = options_for(v->grid(), mode, 37);
      o.sampler = SamplerKind::buffer;
      o.surfaces = {{0.5}};
      const auto one = raycast_float(device(), *v, o, {8, 8, 1});
      for (const int lanes : {4, 8, 16}) {
        const auto packets = raycast_float(device(), *v, o, {8, 8, lanes});
        BOOST_TEST(same_bits(one.pixels, packets.pixels));
      }
    }
}

BOOST_AUTO_TEST_CASE(refined_bricks_of_a_linear_field_leave_no_seam) {
  const Grid grid = centred_grid({30, 27, 33});
  const auto linear = [](double x, double y, double z) { return 0.5 + 0.01 * x + 0.007 * y - 0.011 * z; };
  const ResidentVolume uniform(device(), as_mixed(fields::uniform(grid, linear)));
  const ResidentVolume mixed(device(), fields::mixed(grid, 4, scattered_levels, linear));
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::mip, RenderMode::slice, RenderMode::iso}) {
    RenderOptions o = options_for(grid, mode);
    o.surfaces = {{0.55}};
    // Of the texture unit weights may be coarser than this allows.
    o.sampler = SamplerKind::buffer;
    const auto a = raycast_float(device(), uniform, o), b = raycast_float(device(), mixed, o);
    // Values agree to 14 u each; a transfer function of slope 6 and a gradient over one cell (slope 0.01, so
    // an angle of 28 u / 0.01) with shading of slope 5 in the angle make of it what is allowed; alpha
    // accumulates over 60 samples.
    const double value = 2 * 14 * u;
    const double allowed = mode == RenderMode::iso   ? 64 * (value / 0.01)
                           : mode == RenderMode::dvr ? 60 * 6 * value + 5 * (value / 0.01)
                                                     : 8 * value;
    BOOST_TEST(!(largest_difference(a.pixels, b.pixels) > allowed));
  }
}

BOOST_AUTO_TEST_CASE(sphere_is_hit_where_geometry_says) {
  // Distance to the centre, negated: its trilinear error is d^2 f'' / 8 per axis, f'' = 1 / r, two axes.
  const Grid grid = centred_grid({40, 40, 40});
  const double radius = 12.3;
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, [](double x, double y, double z) {
                           return -std::sqrt(x * x + y * y + z * z);
                         })));
  RenderOptions o = options_for(grid, RenderMode::iso, 41);
  o.surfaces = {{-radius}};
  const auto picture = raycast_float(device(), v, o);
  const double surface = 2.0 / 8 / (radius - 1);
  int hits = 0;
  for (std::int64_t y = 0; y < 41; ++y)
    for (std::int64_t x = 0; x < 41; ++x) {
      const auto ray = reference::pixel_ray(o.camera, 41, 41, x, y);
      const double inner = reference::sphere_distance(ray, {0, 0, 0}, radius - surface);
      const double outer = reference::sphere_distance(ray, {0, 0, 0}, radius + surface);
      const double depth = static_cast<double>(picture.pixels[static_cast<std::size_t>(41 * y + x)].s[3]);
      if (outer < 0) {
        BOOST_TEST(depth == -1);
      } else if (inner >= 0) {
        // Near the rim a chord shorter than a step can fall between two samples; inside it a hit is certain.
        const double rim =
            std::abs(reference::dot(reference::unit(reference::along(ray, inner)), ray.direction));
        if (rim * radius < 1) continue;
        ++hits;
        // Bisection leaves 2^-13 of a step; distances of about 130 cells are fp32.
        const double rounding = 0x1p-13 + 4 * 130 * u;
        BOOST_TEST(depth >= outer - rounding);
        BOOST_TEST(depth <= inner + rounding);
      }
    }
  BOOST_TEST(hits > 100);
}

BOOST_AUTO_TEST_CASE(iso_surface_facing_the_eye_is_brighter_than_its_rim) {
  const Grid grid = centred_grid({40, 40, 40});
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, [](double x, double y, double z) {
                           return -std::sqrt(x * x + y * y + z * z);
                         })));
  RenderOptions o = options_for(grid, RenderMode::iso, 41);
  o.surfaces = {{-15}};
  const auto p = raycast_float(device(), v, o).pixels;
  std::size_t first = 41 * 20;
  while (p[first].s[3] < 0) ++first;
  BOOST_TEST(p[41 * 20 + 20].s[0] > 1.5f * p[first].s[0]);
}

BOOST_AUTO_TEST_CASE(slice_of_a_linear_field_is_exact_and_oriented) {
  Grid grid = centred_grid({16, 8, 12}, {1, 2, 1});
  const auto linear = [](double x, double y, double z) { return 1 + 0.25 * x + 0.5 * y + 0.125 * z; };
  const ResidentVolume v(device(), fields::mixed(grid, 4, scattered_levels, linear));
  const std::array<std::pair<std::size_t, std::size_t>, 3> axes{{{1, 2}, {0, 2}, {0, 1}}};  // across, down
  for (int axis = 0; axis < 3; ++axis) {
    RenderOptions o;
    o.mode = RenderMode::slice;
    o.slice_axis = axis;
    o.slice_position = 1.5;
    o.width = o.height = 16;
    o.slice_range = std::pair<double, double>(-8, 10);
    const auto p = raycast_float(device(), v, o).pixels;
    const auto [across, down] = axes[static_cast<std::size_t>(axis)];
    for (std::int64_t y = 0; y < 16; ++y)
      for (std::int64_t x = 0; x < 16; ++x) {
        // Sixteen world units fit sixteen pixels: pixel centres lie half a unit from the grid's symmetry
        // planes.
        Vec3 at{1.5, 1.5, 1.5};
        at[across] = static_cast<double>(x) - 7.5;
        at[down] = static_cast<double>(y) - 7.5;
        const auto& pixel = p[static_cast<std::size_t>(16 * y + x)];
        const bool outside =
            std::abs(at[across]) * 2 > static_cast<double>(grid.cells[across]) * grid.spacing[across] ||
            std::abs(at[down]) * 2 > static_cast<double>(grid.cells[down]) * grid.spacing[down];
        const double truth = linear(at[0], at[1], at[2]);
        if (outside) {
          BOOST_TEST(pixel.s[0] == VDVR_GREY_OUTSIDE);
          BOOST_TEST(std::isnan(pixel.s[3]));
        } else {
          BOOST_TEST(!(std::abs(static_cast<double>(pixel.s[3]) - truth) > 14 * u * 8));
          BOOST_TEST(
              !(std::abs(static_cast<double>(pixel.s[0]) - std::clamp((truth + 8) / 18, 0.0, 1.0)) > 20 * u));
        }
      }
  }
}

BOOST_AUTO_TEST_CASE(bright_spot_appears_where_the_camera_puts_it) {
  // One bright sample at +x, +y, +z of the centre.
  const Grid grid = centred_grid({16, 16, 16});
  Volume volume = fields::uniform(
      grid, [](double x, double y, double z) { return x == 4 && y == 2 && z == 5 ? 1.0 : 0.0; });
  const ResidentVolume v(device(), as_mixed(volume));
  const auto at = [&](double azimuth, double elevation, RenderMode mode) {
    RenderOptions o = options_for(grid, mode, 64);
    o.camera = orbit_camera(grid, azimuth, elevation, 1);
    o.transfer = mode == RenderMode::mip ? transfer_preset("mip", 0, 1)
                                         : TransferFunction{"white", {{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, 1}}};
    o.step = 0.25;
    return brightest(raycast(device(), v, o).image);
  };
  for (const RenderMode mode : {RenderMode::mip, RenderMode::dvr}) {
    const auto front = at(0, 0, mode);  // looking along -y: x right, z down
    BOOST_TEST(front.first > 36);
    BOOST_TEST(front.second > 36);
    const auto side = at(90, 0, mode);  // from +x, looking along -x: right is -y
    BOOST_TEST(side.first < 32);
    BOOST_TEST(side.second > 36);
    const auto back = at(180, 0, mode);
    BOOST_TEST(back.first < 28);
    const auto above = at(0, 90, mode);  // from -z: the picture's up is -y, so +y is down
    BOOST_TEST(above.first > 36);
    BOOST_TEST(above.second > 32);
  }
}

BOOST_AUTO_TEST_CASE(one_cell_volume_renders_in_every_mode) {
  for (const Index3& cells : {Index3{1, 1, 1}, Index3{1, 9, 1}, Index3{5, 1, 3}}) {
    const Grid grid = centred_grid(cells);
    const ResidentVolume v(device(),
                           as_mixed(fields::uniform(grid, [](double x, double, double) { return x; })));
    for (const RenderMode mode :
         {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice, RenderMode::integral})
      for (const double azimuth : {0.0, 90.0, 45.0}) {
        RenderOptions o = options_for(grid, mode, 17);
        o.camera = orbit_camera(grid, azimuth, 0, 1);
        o.transfer = transfer_preset("grey", -1, 1);
        const auto picture = raycast_float(device(), v, o);
        for (const auto& p : picture.pixels)
          for (std::size_t c = 0; c < 3; ++c) BOOST_REQUIRE(std::isfinite(p.s[c]));
        if (mode == RenderMode::dvr) BOOST_TEST(picture.pixels[17 * 8 + 8].s[3] > 0);
      }
  }
}

BOOST_AUTO_TEST_CASE(rays_parallel_to_axes_and_on_faces_are_finite) {
  const Grid grid = centred_grid({8, 8, 8});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 1.0; })));
  RenderOptions o = options_for(grid, RenderMode::dvr, 9);
  o.transfer = constant_transfer(0.1);
  // In the plane of a face, on a corner, and at the centre of the grid.
  for (const Vec3& eye : {Vec3{4, 20, 0}, Vec3{4, 4, 4}, Vec3{0, 0, 0}, Vec3{-4, 20, -4}}) {
    o.camera.position = eye;
    o.camera.focal_point = {eye[0], eye[1] - 1, eye[2]};
    for (const auto& p : raycast_float(device(), v, o).pixels)
      for (const float c : p.s) BOOST_REQUIRE(std::isfinite(c));
  }
}

BOOST_AUTO_TEST_CASE(early_termination_costs_at_most_what_it_leaves) {
  const ResidentVolume v(device(), mixed_blob());
  RenderOptions o = options_for(v.grid(), RenderMode::dvr);
  o.transfer = transfer_preset("bone", 0, 0.6);
  o.shading = false;
  const auto early = raycast_float(device(), v, o);
  o.termination = 1;
  const auto full = raycast_float(device(), v, o);
  BOOST_TEST(early.samples < full.samples);
  BOOST_TEST(!(largest_difference(early.pixels, full.pixels) > (1 - 0.99) + 64 * u));
}

BOOST_AUTO_TEST_CASE(changing_the_transfer_function_changes_what_is_skipped) {
  const ResidentVolume v(device(), mixed_blob());
  RenderOptions o = options_for(v.grid(), RenderMode::dvr);
  o.transfer = {"dense only", {{0.8, {1, 1, 1}, 0}, {1, {1, 1, 1}, 0.5}}};
  raycast_float(device(), v, o);
  o.transfer = transfer_preset("soft", 0, 1);
  const auto after = raycast_float(device(), v, o);
  o.skip_empty = false;
  BOOST_TEST(same_bits(after.pixels, raycast_float(device(), v, o).pixels));
}

BOOST_AUTO_TEST_CASE(useless_options_are_refused) {
  const Grid grid = centred_grid({4, 4, 4});
  const ResidentVolume v(device(),
                         as_mixed(fields::uniform(grid, [](double, double, double) { return 1.0; })));
  const auto is_refused = [&](auto&& change) {
    RenderOptions o = options_for(grid, RenderMode::dvr, 4);
    change(o);
    try {
      raycast(device(), v, o);
    } catch (const InputError&) {
      return true;
    }
    return false;
  };
  BOOST_TEST(is_refused([](auto& o) { o.width = 0; }));
  BOOST_TEST(is_refused([](auto& o) { o.height = 100000; }));
  BOOST_TEST(is_refused([](auto& o) { o.step = 0; }));
  BOOST_TEST(is_refused([](auto& o) { o.step = NAN; }));
  BOOST_TEST(is_refused([](auto& o) { o.termination = 0; }));
  BOOST_TEST(is_refused([](auto& o) { o.transfer.points.clear(); }));
  BOOST_TEST(is_refused([](auto& o) { o.camera.position = o.camera.focal_point; }));
  BOOST_TEST(is_refused([](auto& o) { o.camera.view_angle_deg = 180; }));
  BOOST_TEST(is_refused([](auto& o) {
    for (std::size_t a = 0; a < 3; ++a) o.camera.view_up[a] = o.camera.position[a] - o.camera.focal_point[a];
  }));
  BOOST_TEST(is_refused([](auto& o) { o.mode = RenderMode::error; }));
  BOOST_TEST(is_refused([](auto& o) {
    o.mode = RenderMode::slice;
    o.slice_position = 3;
  }));
}

BOOST_AUTO_TEST_CASE(png_is_whole_or_not_at_all) {
  const auto path = std::filesystem::temp_directory_path() / "vdvr_raycast_test.png";
  Image image{3, 2, std::vector<std::uint8_t>(18, 200)};
  write_png(path, image);
  BOOST_TEST(std::filesystem::file_size(path) > 50);
  std::filesystem::remove(path);
  image.rgb.pop_back();
  BOOST_CHECK_THROW(write_png(path, image), InputError);
  BOOST_TEST(!std::filesystem::exists(path));
  BOOST_CHECK_THROW(write_png("no such folder/x.png", Image{1, 1, {0, 0, 0}}), FileError);
}
