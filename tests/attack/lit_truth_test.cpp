// Ideal pictures under the light of F itself: every pixel of fields with an analytic F inside its interval,
// and what an adversary within the bounds makes too. VDVR_TRUTH_FIELDS asks for more fields than the few of
// every day (scripts/long pixel-truth).
#define BOOST_TEST_MODULE lit_truth
#include <boost/test/unit_test.hpp>

#include <iostream>
#include <numeric>

#include "host/base/system/parallel.hpp"
#include "tests/support/device.hpp"
#include "tests/support/lit_pictures.hpp"
#include "tests/support/pixel_attack.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify_picture.hpp"

using namespace vdvr;
using support::device;

namespace {

constexpr std::int64_t side = 64;
// Steps of the truth, in base cells.
constexpr double step = 1.0 / 64;

int wanted_fields() { return support::wanted_fields(3); }

struct Scene {
  support::AnalyticField field;
  MixedVolume volume;
  std::vector<float> bounds;
  RenderOptions options;
  double full = 0;  ///< from which gradient on light does not fade

  [[nodiscard]] std::pair<float, float> value_range() const { return {0, 32 * static_cast<float>(full)}; }
  [[nodiscard]] double f(const Vec3& p) const {
    const Vec3& low = volume.grid.origin;
    return field.at(p[0] - low[0], p[1] - low[1], p[2] - low[2]);
  }
  [[nodiscard]] double bound_at(const Vec3& p) const {
    const Index3 at = brick_at(volume, p), n = volume.bricks();
    return static_cast<double>(bounds[static_cast<std::size_t>((at[2] * n[1] + at[1]) * n[0] + at[0])]);
  }
};

Scene scene_of(int number) {
  std::mt19937 random(9100 + static_cast<unsigned>(number));
  std::uniform_real_distribution<double> unit(0, 1);
  const std::int64_t cells = 16 + 4 * static_cast<std::int64_t>(random() % 2);
  Scene s;
  s.field = number % 2 == 0 ? support::marschner_lobb(cells, 1 + unit(random)) : support::blobs(cells);
  // In turn: mixed levels, mixed ones over a coarse base, one fine level.
  const int kind = number % 3;
  const LevelTriple coarse = kind == 1 ? LevelTriple{1, 1, 0} : LevelTriple{0, 0, 0};
  const std::vector<LevelTriple> mixed{{0, 0, 0}, {1, 1, 1}, {2, 0, 1}, {0, 2, 2}};
  s.volume =
      support::volume_of(s.field, kind == 2 ? std::vector<LevelTriple>{{2, 2, 2}} : mixed, random(), coarse);
  s.bounds = support::proved_bounds(s.field, s.volume, 0, 6);
  s.full = number % 2 == 0 ? 1.0 / 32 : static_cast<double>(0.2f);
  RenderOptions& o = s.options;
  o.width = o.height = side;
  o.sampler = SamplerKind::buffer;
  o.clip = support::inner_clip(s.volume.grid);
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

reference::IdealRay ray_of(const Scene& s, std::size_t i) {
  const auto at = static_cast<std::int64_t>(i);
  return reference::ideal_ray(s.options, s.volume.grid, at % side, at / side);
}

std::vector<support::LitFieldOnRay> truth_of(const Scene& s) {
  std::vector<support::LitFieldOnRay> rays(static_cast<std::size_t>(side * side));
  parallel_for(side * side, {}, "truth", [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    rays[i] = support::along_lit_ray([&](const Vec3& p) { return s.f(p); }, ray_of(s, i), step);
  });
  return rays;
}

/// How much farther a rounded place of a face moves where a ray begins or ends: the more, the flatter it
/// meets it.
double slanted(const Scene& s, const reference::IdealRay& ray) {
  const Clip& clip = *s.options.clip;
  double most = 1;
  for (const double t : {ray.first, ray.last}) {
    const Vec3 p = ray.at(t);
    for (std::size_t a = 0; a < 3; ++a)
      if (std::min(std::abs(p[a] - clip.low[a]), std::abs(p[a] - clip.high[a])) < 1e-9)
        most = std::max(most, 1 / std::abs(ray.direction[a]));
  }
  return most;
}

// Of a few thousand parts: 256 roundings each (lit_emission.cpp), and as many of the sum here; ends are
// float.
constexpr double rounding = 0x1p-53 * 512 * 8192 + 0x1p-24;

/// Pixels of which a channel lies outside.
std::int64_t outside_of(const PixelBounds& b, const Scene& s, const std::vector<support::LitFieldOnRay>& rays,
                        double& nearest) {
  std::int64_t outside = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto behind = reference::background_of(s.options, static_cast<std::int64_t>(i) / side);
    const reference::Rgb3 colour =
        support::lit_colour_of(rays[i], s.options, ray_of(s, i).direction, s.full, behind);
    for (std::size_t c = 0; c < 3; ++c) {
      const double lo = static_cast<double>(b.lo.values[3 * i + c]),
                   hi = static_cast<double>(b.hi.values[3 * i + c]);
      if (!(std::max(lo - colour[c], colour[c] - hi) <= rounding)) ++outside;
      if (hi - lo > 0.01) nearest = std::max(nearest, std::abs(2 * colour[c] - hi - lo) / (hi - lo));
    }
  }
  return outside;
}

}  // namespace

// F and its differences in the middle of each step, constant on it, lie within the bounds too, if these allow
// for what F moves in half a step.
BOOST_AUTO_TEST_CASE(every_pixel_of_the_ideal_picture_is_in_its_interval) {
  std::int64_t pictures = 0;
  double nearest = 0;
  for (int number = 0; number < wanted_fields(); ++number) {
    Scene s = scene_of(number);
    for (float& e : s.bounds) e += static_cast<float>(s.field.slope * step / 2 * (1 + 0x1p-20));
    const std::vector<support::LitFieldOnRay> rays = truth_of(s);
    std::vector<TransferFunction> transfers = support::table_transfers();
    std::mt19937 random(static_cast<unsigned>(number));
    transfers.push_back(support::random_transfer(random));
    for (const TransferFunction& transfer : transfers) {
      s.options.transfer = transfer;
      support::set_lights(s.options, static_cast<int>(pictures % 3));
      CertifyPictureOptions certify;
      certify.kappa = pictures % 2 == 0 ? 0.125 : 0.5;
      const PixelBounds b =
          certify_lit_pixels(s.volume, s.bounds, Clip{}, s.value_range(), s.options, certify);
      ++pictures;
      BOOST_TEST_INFO("field " << number << ", " << s.field.name << ", transfer function " << transfer.name
                               << ", lights " << (pictures - 1) % 3);
      BOOST_TEST(outside_of(b, s, rays, nearest) == 0);
      BOOST_TEST(std::count(b.untested.begin(), b.untested.end(), 1) == 0);
    }
  }
  std::cout << pictures << " pictures, " << pictures * side * side * 3
            << " values, of half an interval F takes at most " << nearest << "\n";
}

// The same of F under the light of V, step by step, as it is drawn. Bounds are small and V is another field
// than F, so that light from elsewhere would be seen.
BOOST_AUTO_TEST_CASE(every_pixel_under_the_light_that_is_drawn_is_in_its_interval) {
  double widest = 0, lights = 0;
  for (int number = 0; number < wanted_fields(); ++number) {
    Scene s = scene_of(number);
    for (float& e : s.bounds) e += static_cast<float>(s.field.slope * step / 2 * (1 + 0x1p-20));
    const ResidentVolume resident(device(), s.volume);
    s.options.transfer = transfer_preset("soft", 0, 1);
    s.options.step = number % 2 == 0 ? 0.5 : 1;
    support::set_lights(s.options, number % 3);
    const PixelBounds b = certify_pixels(device(), resident, s.bounds, s.options);
    const double fp32 = support::path_rounding(s.options, s.volume.grid);
    std::vector<int> outside(static_cast<std::size_t>(side));
    std::vector<double> light(static_cast<std::size_t>(side));
    parallel_for(side, {}, "truth", [&](std::int64_t y) {
      for (std::int64_t x = 0; x < side; ++x) {
        const IdealPixel ideal = ideal_drawn_pixel(
            [&](const std::vector<Vec3>& points) {
              std::vector<double> values;
              for (const Vec3& p : points) values.push_back(s.f(p));
              return values;
            },
            s.volume, resident.value_range(), s.options, x, y, step);
        light[static_cast<std::size_t>(y)] += ideal.light;
        const auto i = static_cast<std::size_t>(y * side + x);
        for (std::size_t c = 0; c < 3; ++c) {
          const double reach = ideal.light + fp32 * slanted(s, ray_of(s, i));
          if (!(ideal.rgb[c] >= static_cast<double>(b.lo.values[3 * i + c]) - reach &&
                ideal.rgb[c] <= static_cast<double>(b.hi.values[3 * i + c]) + reach))
            ++outside[static_cast<std::size_t>(y)];
        }
      }
    });
    for (std::size_t i = 0; i < b.lo.values.size(); ++i)
      widest +=
          static_cast<double>(b.hi.values[i] - b.lo.values[i]) / static_cast<double>(b.lo.values.size());
    for (const double l : light) lights += l / static_cast<double>(side * side);
    BOOST_TEST_INFO("field " << number << ", " << s.field.name);
    BOOST_TEST(std::accumulate(outside.begin(), outside.end(), 0) == 0);
  }
  std::cout << "as drawn: intervals are " << widest / wanted_fields() << " wide, light is known to "
            << lights / wanted_fields() << "\n";
}

// F and its differences are chosen anew on every step, against each channel.
BOOST_AUTO_TEST_CASE(an_adversary_within_the_bounds_stays_inside) {
  for (int number = 0; number < wanted_fields(); ++number) {
    Scene s = scene_of(number);
    std::mt19937 random(static_cast<unsigned>(number));
    double reached = 0, width = 0;
    std::int64_t outside = 0, rays = 0, tried = 0;
    const std::vector<TransferFunction> all = support::table_transfers();
    for (const std::size_t t : {0u, 2u, 4u, 6u}) {
      s.options.transfer = all[t];
      support::set_lights(s.options, static_cast<int>(t / 2 + static_cast<std::size_t>(number)) % 3);
      const PixelBounds b = certify_lit_pixels(s.volume, s.bounds, Clip{}, s.value_range(), s.options);
      for (std::size_t i = side / 2 + 8 * side; i < static_cast<std::size_t>(side * side); i += side + 7) {
        const reference::IdealRay ray = ray_of(s, i);
        const auto behind = reference::background_of(s.options, static_cast<std::int64_t>(i) / side);
        const auto v = [&](const Vec3& p) { return static_cast<double>(sample_at(s.volume, p)); };
        const support::LitRoom room =
            support::room_on_ray([&](const Vec3& p) { return v(p) - s.bound_at(p); },
                                 [&](const Vec3& p) { return v(p) + s.bound_at(p); }, ray, step);
        ++tried;
        if (!room.enough) continue;
        ++rays;
        for (std::size_t c = 0; c < 3; ++c) {
          const double lo = static_cast<double>(b.lo.values[3 * i + c]),
                       hi = static_cast<double>(b.hi.values[3 * i + c]);
          width += hi - lo;
          for (const bool up : {false, true}) {
            const double seen =
                support::lit_adversary_of(room.middle, room.value, room.differences, s.options, ray.direction,
                                          s.full, behind[c], c, up, random);
            reached += up ? seen : -seen;
            if (!(seen >= lo - rounding && seen <= hi + rounding)) ++outside;
          }
        }
      }
    }
    std::cout << "field " << number << ", " << s.field.name << ": an adversary reaches " << reached / width
              << " on " << rays << " of " << tried << " rays\n";
    BOOST_TEST_INFO("field " << number);
    BOOST_TEST(outside == 0);
    BOOST_TEST(rays > 20);
  }
}

BOOST_AUTO_TEST_CASE(intervals_close_with_their_bounds_around_the_picture_that_is_drawn) {
  Scene s = scene_of(2);
  s.options.transfer = transfer_preset("soft", 0, 1);
  const ResidentVolume resident(device(), s.volume);
  s.full = static_cast<double>((resident.value_range().second - resident.value_range().first) / 32);
  for (const int lights : {0, 1, 2}) {
    support::set_lights(s.options, lights);
    std::array<double, 3> mean{};
    PixelBounds narrow;
    CertifyPictureOptions certify;
    certify.kappa = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::vector<float> bounds(s.bounds.size(), std::ldexp(0.0128f, -2 * static_cast<int>(k)));
      narrow = certify_lit_pixels(s.volume, bounds, Clip{}, s.value_range(), s.options, certify);
      for (std::size_t i = 0; i < narrow.lo.values.size(); ++i)
        mean[k] += static_cast<double>(narrow.hi.values[i] - narrow.lo.values[i]) /
                   static_cast<double>(narrow.lo.values.size());
    }
    // A quarter each time; where gradients are small light is steep, and its range is whole for longer.
    BOOST_TEST(mean[1] < mean[0] / 2);
    BOOST_TEST(mean[2] < mean[1] / 2);
    // Drawn in short steps, and twice as short ones: what is left is at most as much again as they differ by,
    // and bytes round by a half each.
    s.options.classification = Classification::post;
    s.options.step_mode = StepMode::fixed;
    s.options.termination = 1 - 0x1p-12;
    s.options.step = 1.0 / 16;
    const Image coarse = raycast(device(), resident, s.options).image;
    s.options.step = 1.0 / 32;
    const Image fine = raycast(device(), resident, s.options).image;
    for (std::size_t i = 0; i < fine.rgb.size(); ++i) {
      const double drawn = fine.rgb[i], reach = std::abs(drawn - coarse.rgb[i]) + 1 + 0.5 + 255 * 0x1p-12,
                   lo = 255 * std::clamp(static_cast<double>(narrow.lo.values[i]), 0.0, 1.0),
                   hi = 255 * std::clamp(static_cast<double>(narrow.hi.values[i]), 0.0, 1.0);
      BOOST_TEST((drawn >= lo - reach && drawn <= hi + reach), "channel " << i << " of lights " << lights
                                                                          << ": " << drawn << " for " << lo
                                                                          << " to " << hi);
    }
  }
}

BOOST_AUTO_TEST_CASE(where_a_difference_is_unknown_any_light_may_fall) {
  Scene s = scene_of(2);
  for (float& e : s.bounds) e += static_cast<float>(s.field.slope * step / 2 * (1 + 0x1p-20));
  s.options.transfer = transfer_preset("soft", 0, 1);
  support::set_lights(s.options, 0);
  Clip half;
  half.high[0] = 0;
  const PixelBounds b = certify_lit_pixels(s.volume, s.bounds, half, s.value_range(), s.options);
  BOOST_TEST(std::count(b.untested.begin(), b.untested.end(), 1) > 100);
  const std::vector<support::LitFieldOnRay> known = truth_of(s);
  // Beside it gradients may turn towards the eye or across, and be as steep as one likes.
  for (const bool facing : {false, true}) {
    std::vector<support::LitFieldOnRay> rays = known;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const reference::IdealRay ray = ray_of(s, i);
      const Vec3 &v = ray.direction, across{v[1], -v[0], 0};
      for (std::size_t k = 0; k < rays[i].around.size(); ++k)
        if (ray.at(ray.first + (static_cast<double>(k) + 0.5) * rays[i].length)[0] + 0.5 > step)
          for (std::size_t a = 0; a < 3; ++a) rays[i].around[k][a] = {0, 100 * (facing ? v[a] : across[a])};
    }
    double nearest = 0;
    BOOST_TEST(outside_of(b, s, rays, nearest) == 0);
  }
}

BOOST_AUTO_TEST_CASE(what_has_no_light_to_certify_is_refused) {
  Scene s = scene_of(2);
  s.options.transfer = transfer_preset("soft", 0, 1);
  support::set_lights(s.options, 0);
  const auto refused = [&](const RenderOptions& o, const CertifyPictureOptions& c, const std::string& named) {
    BOOST_CHECK_EXCEPTION(
        certify_lit_pixels(s.volume, s.bounds, Clip{}, s.value_range(), o, c), InputError,
        [&](const InputError& e) { return std::string(e.what()).find(named) != std::string::npos; });
  };
  RenderOptions o = s.options;
  CertifyPictureOptions c;
  o.shading = false;
  refused(o, c, "without light");
  o = s.options;
  o.gradient = GradientKind::analytic;
  refused(o, c, "central");
  o = s.options;
  o.mode = RenderMode::iso;
  o.surfaces = {{0.5, 1, {1, 1, 1}}};
  refused(o, c, "dvr");
  c.fast = true;
  refused(s.options, c, "fast");
  c = {};
  c.window = std::pair{0.1, 0.9};
  refused(s.options, c, "window");
}
