// Ideal pictures of fields with an analytic F, every pixel of them inside its interval, and how much of the
// interval an adversary within the bounds takes. VDVR_TRUTH_FIELDS asks for more fields than the few of every
// day (scripts/long pixel-truth).
#define BOOST_TEST_MODULE pixel_truth
#include <boost/test/unit_test.hpp>

#include <iostream>

#include "host/base/system/parallel.hpp"
#include "host/picture/rays/crossings.hpp"
#include "tests/support/analytic_pictures.hpp"
#include "tests/support/device.hpp"
#include "tests/support/pixel_attack.hpp"
#include "vdvr/expert/certify_picture.hpp"

using namespace vdvr;
using support::AnalyticField;
using support::device;

namespace {

constexpr std::int64_t side = 64;
// Steps of the truth, in base cells.
constexpr double step = 1.0 / 64;

int wanted_fields() { return support::wanted_fields(4); }

struct Scene {
  AnalyticField field;
  MixedVolume volume;
  std::vector<float> bounds;
  RenderOptions options;
};

Scene scene_of(int number) {
  std::mt19937 random(7000 + static_cast<unsigned>(number));
  std::uniform_real_distribution<double> unit(0, 1);
  const std::int64_t cells = 16 + 4 * static_cast<std::int64_t>(random() % 3);
  Scene s;
  s.field = number % 2 == 0 ? support::marschner_lobb(cells, 1.5 + unit(random)) : support::blobs(cells);
  const std::vector<LevelTriple> mixed{{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 2, 2}};
  // In turn: one level, mixed ones, mixed ones over a coarse base, integers.
  const int kind = number / 2 % 4;
  const LevelTriple coarse = kind == 2 ? LevelTriple{1, 1, 0} : LevelTriple{0, 0, 0};
  const auto levels = kind == 3 ? std::vector<LevelTriple>{{1, 1, 1}} : mixed;
  s.volume = support::volume_of(s.field, levels, random(), coarse);
  // Of 254 steps of 8 bits over a tile's range, which is at most 1.25 here, each up to twice as long as it
  // need be: half of one.
  double rounding = 0;
  if (kind == 1) {
    s.volume = support::in_types(s.volume, {SampleType::u8, SampleType::u16, SampleType::f32});
    rounding = 1.25 / 253;
  }
  s.bounds = support::proved_bounds(s.field, s.volume, rounding, 6);
  RenderOptions& o = s.options;
  o.width = o.height = side;
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  o.camera =
      orbit_camera(s.volume.grid, 360 * unit(random), 120 * unit(random) - 60, 0.9 + 0.6 * unit(random));
  if (number % 3 == 1) {  // inside
    const double reach = 0.2 * static_cast<double>(cells);
    for (double& x : o.camera.position) x = reach * (2 * unit(random) - 1);
    o.camera.focal_point = {reach, 2 * reach * unit(random), -reach};
    o.camera.view_angle_deg = 70;
  }
  for (double& x : o.background_top) x = unit(random);
  for (double& x : o.background_bottom) x = unit(random);
  return s;
}

Vec3 in_cells(const MixedVolume& v, const Vec3& p) {
  return {p[0] - v.grid.origin[0], p[1] - v.grid.origin[1], p[2] - v.grid.origin[2]};
}

std::vector<support::FieldOnRay> truth_of(const Scene& s) {
  std::vector<support::FieldOnRay> rays(static_cast<std::size_t>(side * side));
  parallel_for(side, {}, "truth", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < side; ++x)
      rays[static_cast<std::size_t>(y * side + x)] = support::along_ray(
          [&](const Vec3& p) {
            const Vec3 c = in_cells(s.volume, p);
            return s.field.at(c[0], c[1], c[2]);
          },
          reference::ideal_ray(s.options, s.volume.grid, x, y), step);
  });
  return rays;
}

}  // namespace

// The field that is F in the middle of each step and constant on it lies within the bounds too, if they allow
// for what F moves in half a step. Its picture is a sum without error, whatever the transfer function does.
BOOST_AUTO_TEST_CASE(every_pixel_of_the_ideal_picture_is_in_its_interval) {
  std::int64_t pictures = 0, values = 0;
  double nearest = 0;
  for (int number = 0; number < wanted_fields(); ++number) {
    Scene s = scene_of(number);
    std::vector<float> bounds = s.bounds;
    for (float& e : bounds) e += static_cast<float>(s.field.slope * step / 2 * (1 + 0x1p-20));
    const std::vector<support::FieldOnRay> rays = truth_of(s);
    const ResidentVolume resident(device(), s.volume);
    std::vector<TransferFunction> transfers = support::table_transfers();
    std::mt19937 random(static_cast<unsigned>(number));
    transfers.push_back(support::random_transfer(random));
    for (const TransferFunction& transfer : transfers) {
      s.options.transfer = transfer;
      CertifyPictureOptions certify;
      certify.fast = pictures % 5 == 4;
      certify.box = pictures % 5 % 2 == 1;
      certify.kappa = pictures % 3 == 0 ? 0.125 : 0.5;
      const PixelBounds b = certify_pixels(device(), resident, bounds, s.options, certify);
      const double rounding = support::path_rounding(s.options, s.volume.grid);
      std::int64_t outside = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto behind = reference::background_of(s.options, static_cast<std::int64_t>(i) / side);
        const reference::Rgb3 colour = support::colour_of(rays[i], transfer.points, behind);
        for (std::size_t c = 0; c < 3; ++c, ++values) {
          const double lo = static_cast<double>(b.lo.values[3 * i + c]),
                       hi = static_cast<double>(b.hi.values[3 * i + c]);
          if (!(std::max(lo - colour[c], colour[c] - hi) <= rounding)) ++outside;
          if (hi - lo > 0.01) nearest = std::max(nearest, std::abs(2 * colour[c] - hi - lo) / (hi - lo));
        }
      }
      ++pictures;
      BOOST_TEST_INFO("field " << number << ", " << s.field.name << ", transfer function " << transfer.name
                               << (certify.fast  ? ", fast"
                                   : certify.box ? ", box"
                                                 : ""));
      BOOST_TEST(outside == 0);
    }
  }
  std::cout << pictures << " pictures, " << values << " values, of half an interval F takes at most "
            << nearest << "\n";
}

BOOST_AUTO_TEST_CASE(every_crossing_of_the_surface_is_in_its_band) {
  ParallelGeometry g;
  // A cylinder around the whole cube.
  g.columns = 64;
  g.rows = 64;
  g.center = 31.5;
  for (int k = 0; k < 60; ++k) g.theta_rad.push_back(std::numbers::pi * k / 60);
  const Coverage coverage(g);
  std::array<std::int64_t, 3> hits{};
  for (int number = 0; number < wanted_fields(); ++number) {
    const Scene s = scene_of(number);
    const RayField field(s.volume, s.bounds, coverage);
    for (const double value : {0.5, 0.3}) {
      std::int64_t outside = 0;
      for (std::int64_t y = 0; y < side; ++y)
        for (std::int64_t x = 0; x < side; ++x) {
          const WorldRay ray = pixel_ray(s.options.camera, side, side, x, y);
          const auto [begin, end] = field.clipped(ray);
          if (!(begin < end)) continue;
          const auto f = [&](double t) {
            const Vec3 c = in_cells(s.volume, ray.at(t));
            return s.field.at(c[0], c[1], c[2]);
          };
          const Crossing c = first_crossing(field, ray, value);
          ++hits[static_cast<std::size_t>(c.hit)];
          if (c.from_start) {
            if (c.hit == Hit::sure && !support::passes(f, begin, c.last, value, step, s.field.slope))
              ++outside;
            continue;
          }
          const double sign = f(begin) < value ? 1 : -1, before = c.hit == Hit::none ? end : c.first;
          for (double t = begin; t < before; t += step)
            if (!(sign * (f(t) - value) < 0)) ++outside;
          if (c.hit == Hit::sure && !(sign * (f(c.last) - value) >= 0 && c.last >= c.first)) ++outside;
        }
      BOOST_TEST_INFO("field " << number << ", " << s.field.name << ", value " << value);
      BOOST_TEST(outside == 0);
    }
  }
  for (const std::int64_t n : hits) BOOST_TEST(n > 100);
  std::cout << "surfaces: none " << hits[0] << ", possible " << hits[1] << ", sure " << hits[2] << "\n";
}

// docs/pixel-bounds.md, theorem 2: what is wider than what an adversary reaches is slack of parts, of bins
// and of tau and c taken apart.
BOOST_AUTO_TEST_CASE(an_adversary_within_the_bounds_reaches_most_of_the_interval) {
  // Bounds of 1 to 4 % of the range, as they are asked for; with larger ones tau and c taken apart cost more.
  std::vector<Scene> scenes(3);
  scenes[0].field = scenes[1].field = support::marschner_lobb(32, 3);
  scenes[2].field = support::blobs(32);
  const std::vector<std::vector<LevelTriple>> levels{
      {{0, 0, 0}}, {{0, 0, 0}, {1, 1, 1}, {0, 0, 1}}, {{1, 1, 1}}};
  for (std::size_t number = 0; number < scenes.size(); ++number) {
    Scene& s = scenes[number];
    s.volume = support::volume_of(s.field, levels[number], 5);
    s.bounds = support::proved_bounds(s.field, s.volume, 0, number == 2 ? 4 : 8);
    s.options.width = s.options.height = side;
    s.options.shading = false;
    s.options.sampler = SamplerKind::buffer;
    s.options.camera = orbit_camera(s.volume.grid, 30, 20, 1.35);
    const ResidentVolume resident(device(), s.volume);
    const Index3 n = s.volume.bricks();
    std::array<double, 2> width{};
    double reached = 0;
    for (const TransferFunction& transfer : support::table_transfers()) {
      s.options.transfer = transfer;
      std::array<PixelBounds, 2> b;
      for (std::size_t k = 0; k < 2; ++k) {
        CertifyPictureOptions certify;
        certify.kappa = k == 0 ? 0.5 : 0.125;
        b[k] = certify_pixels(device(), resident, s.bounds, s.options, certify);
      }
      for (std::int64_t y = 2; y < side; y += 8)
        for (std::int64_t x = 2; x < side; x += 8) {
          const reference::IdealRay ray = reference::ideal_ray(s.options, s.volume.grid, x, y);
          std::vector<double> e;
          const support::FieldOnRay v = support::along_ray(
              [&](const Vec3& p) {
                const Index3 at = brick_at(s.volume, p);
                e.push_back(static_cast<double>(
                    s.bounds[static_cast<std::size_t>((at[2] * n[1] + at[1]) * n[0] + at[0])]));
                return static_cast<double>(sample_at(s.volume, p));
              },
              ray, 1.0 / 16);
          const auto behind = reference::background_of(s.options, y);
          const auto i = static_cast<std::size_t>(y * side + x);
          for (std::size_t c = 0; c < 3; ++c) {
            reached += support::adversary_of(v, e, transfer.points, behind, c, true) -
                       support::adversary_of(v, e, transfer.points, behind, c, false);
            for (std::size_t k = 0; k < 2; ++k)
              width[k] += static_cast<double>(b[k].hi.values[3 * i + c]) -
                          static_cast<double>(b[k].lo.values[3 * i + c]);
          }
        }
    }
    std::cout << "field " << number << ", " << s.field.name << ": an adversary reaches " << reached / width[0]
              << " at kappa 1/2, " << reached / width[1] << " at 1/8\n";
    // The issue's own figures: the reference reached 70 to 75 % of the cheap form.
    constexpr double at_half = 0.65, at_eighth = 0.80;
    BOOST_TEST(reached / width[0] >= at_half);
    BOOST_TEST(reached / width[1] >= at_eighth);
    BOOST_TEST(reached / width[1] <= 1.0);
  }
}
