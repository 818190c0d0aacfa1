// Intervals of pixels under attack: random fields, levels, bases, integers, transfer functions, cameras,
// bounds and clips, and fields f that keep the bounds. VDVR_PIXEL_PICTURES asks for more pictures than the
// few of every day (scripts/long pixel-attacks).
#define BOOST_TEST_MODULE pixel_attack
#include <boost/test/unit_test.hpp>

#include <cstdlib>
#include <iostream>

#include "tests/support/device.hpp"
#include "tests/support/fields.hpp"
#include "tests/support/pixel_attack.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using support::device;

namespace {

int wanted_pictures() {
  const char* text = std::getenv("VDVR_PIXEL_PICTURES");
  return text ? std::atoi(text) : 24;
}

int first_picture() {
  const char* text = std::getenv("VDVR_PIXEL_FIRST");
  return text ? std::atoi(text) : 0;
}

MixedVolume random_volume(std::mt19937& random) {
  const std::vector<LevelTriple> scattered{{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 2, 0}};
  std::uniform_real_distribution<double> unit(0, 1);
  const Grid grid =
      fields::centred_grid({24, 20, 28}, unit(random) < 0.5 ? Vec3{1, 1, 1} : Vec3{1, 1.25, 0.8});
  const LevelTriple coarse = random() % 3 == 0 ? LevelTriple{1, 2, 1} : LevelTriple{0, 0, 0};
  const unsigned seed = random();
  const auto levels = random() % 3 == 0 ? std::vector<LevelTriple>{{0, 0, 0}} : scattered;
  MixedVolume v;
  if (random() % 4 == 0) {
    v = support::random_mixed(grid, 4, 4, levels, seed, coarse);  // jumps at every face
  } else {
    const double a = 0.1 + 0.4 * unit(random), b = 0.1 + 0.4 * unit(random), c = 0.1 + 0.4 * unit(random);
    v = support::sampled_mixed(
        grid, 4, 4, levels, seed,
        [=](double x, double y, double z) {
          return 0.5 + 0.25 * std::sin(a * x + b * z) * std::cos(c * y) + 0.25 * std::sin(b * y - a * z);
        },
        coarse);
  }
  if (random() % 3 == 0) v = support::in_types(v, {SampleType::u8, SampleType::u16, SampleType::f32});
  return v;
}

RenderOptions random_options(const MixedVolume& v, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  RenderOptions o;
  o.width = 20;
  o.height = 16;
  o.shading = false;
  o.sampler = SamplerKind::buffer;
  o.transfer = support::random_transfer(random);
  o.camera = orbit_camera(v.grid, 360 * unit(random), 160 * unit(random) - 80, 0.7 + unit(random));
  if (random() % 4 == 0) {  // inside
    o.camera.position = {4 * unit(random), 4 * unit(random) - 2, 4 * unit(random)};
    o.camera.focal_point = {10 * unit(random) + 5, 10 * unit(random) - 5, 3 * unit(random)};
    o.camera.view_angle_deg = 70;
  }
  for (double& x : o.background_top) x = unit(random);
  for (double& x : o.background_bottom) x = unit(random);
  if (random() % 2 == 0) {
    o.clip = Clip{};
    o.clip->radius = 6 + 4 * unit(random);
    o.clip->low[2] = -8.3 * unit(random);
  }
  return o;
}

std::vector<float> random_bounds(const MixedVolume& v, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double most = std::exp2(-7 + 5 * unit(random));
  std::vector<float> bounds;
  for (std::int64_t i = 0; i < v.brick_count(); ++i)
    bounds.push_back(random() % 40 == 0 ? std::numeric_limits<float>::infinity()
                                        : static_cast<float>(most * (0.3 + 0.7 * unit(random))));
  return bounds;
}

struct Tally {
  std::int64_t pictures = 0, rays = 0, values = 0, outside = 0;
  double worst = 0, rounding = 0;
  void compare(const PixelBounds& b, std::size_t pixel, const reference::Rgb3& colour) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double lo = static_cast<double>(b.lo.values[3 * pixel + c]),
                   hi = static_cast<double>(b.hi.values[3 * pixel + c]);
      ++values;
      const double excess = std::max(lo - colour[c], colour[c] - hi);
      if (!(excess <= rounding)) ++outside;
      if (!(excess <= worst)) worst = excess;
    }
  }
};

void attack(const MixedVolume& v, const std::vector<float>& bounds, const RenderOptions& o,
            const PixelBounds& b, std::mt19937& random, Tally& tally) {
  std::uniform_real_distribution<double> unit(0, 1);
  const RenderOptions entered = support::as_entered(o, v.grid);
  tally.rounding = support::path_rounding(o, v.grid);
  for (std::int64_t y = 0; y < o.height; y += 3)
    for (std::int64_t x = 0; x < o.width; x += 3) {
      const auto steps = support::steps_of(v, bounds, entered, x, y, 12);
      if (steps.empty()) continue;
      ++tally.rays;
      const auto behind = reference::background_of(o, y);
      const auto pixel = static_cast<std::size_t>(y * o.width + x);
      const auto& points = o.transfer.points;
      const auto at = [&](double value) { return reference::shown_at(points, value, unit(random) < 0.5); };
      using Step = const support::AttackStep&;
      using Rgb = const reference::Rgb3&;
      tally.compare(b, pixel, support::picture_of(steps, behind, [&](Step s, Rgb) { return at(s.lo); }));
      tally.compare(b, pixel, support::picture_of(steps, behind, [&](Step s, Rgb) { return at(s.hi); }));
      tally.compare(b, pixel, support::picture_of(steps, behind, [&](Step s, Rgb) {
                      return at(s.lo + unit(random) * (s.hi - s.lo));
                    }));
      tally.compare(b, pixel, support::picture_of(steps, behind, [&](Step s, Rgb) {
                      return at(unit(random) < 0.5 ? s.lo : s.hi);
                    }));
      for (std::size_t c = 0; c < 3; ++c)
        for (const bool up : {false, true})
          tally.compare(b, pixel, support::adversary(steps, points, behind, c, up));
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(no_field_within_the_bounds_shows_a_colour_outside_the_interval) {
  Tally tally;
  for (int i = first_picture(); i < first_picture() + wanted_pictures(); ++i) {
    std::mt19937 random(1000 + static_cast<unsigned>(i));
    const MixedVolume v = random_volume(random);
    const RenderOptions o = random_options(v, random);
    const std::vector<float> bounds = random_bounds(v, random);
    const ResidentVolume resident(device(), v);
    CertifyPictureOptions certify;
    certify.kappa = std::array{0.125, 0.5, 2.0}[random() % 3];
    certify.fast = random() % 4 == 0;
    certify.box = !certify.fast && random() % 3 == 0;
    const PixelBounds b = certify_pixels(device(), resident, bounds, o, certify);
    const std::int64_t before = tally.outside;
    attack(v, bounds, o, b, random, tally);
    ++tally.pictures;
    BOOST_TEST_INFO("picture " << i
                               << (certify.fast  ? ", fast"
                                   : certify.box ? ", box"
                                                 : "")
                               << ", the worst so far by " << tally.worst << ", rounding of the path "
                               << tally.rounding);
    BOOST_TEST(tally.outside == before);
  }
  std::cout << tally.pictures << " pictures, " << tally.rays << " rays, " << tally.values << " values, "
            << tally.outside << " outside, the worst by " << tally.worst << "\n";
  BOOST_TEST(tally.values > 100 * tally.pictures);  // the attack reaches pixels
}
