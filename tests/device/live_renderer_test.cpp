// Frames of views: still ones are the renderer's own to the bit, moving ones keep a budget.
#define BOOST_TEST_MODULE live_renderer
#include <boost/test/unit_test.hpp>

#include <cmath>

#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/live_renderer.hpp"
#include "vdvr/expert/safe_sampler.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels;

namespace {

double blob(double x, double y, double z) { return std::max(0.0, 1 - (x * x + 1.5 * y * y + z * z) / 90); }

const MixedVolume& volume() {
  static const MixedVolume v = fields::mixed(centred_grid({22, 19, 24}), 4, scattered_levels, blob);
  return v;
}

/// Bounds that differ from brick to brick.
const std::optional<Certificate>& certificate() {
  static const std::optional<Certificate> c = [] {
    Certificate made;
    made.epsilon_abs = made.total_buffer = 1;
    made.holds_buffer = true;
    for (std::size_t i = 0; i < volume().level.size(); ++i)
      made.brick_totals.push_back(static_cast<float>(1 + i * 37 % volume().level.size()) /
                                  static_cast<float>(volume().level.size()));
    return made;
  }();
  return c;
}

bool same(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height && a.rgb == b.rgb;
}

}  // namespace

BOOST_AUTO_TEST_CASE(still_frames_are_the_renderers_to_the_bit) {
  LiveRenderer live(device(), volume(), certificate());
  const ResidentVolume resident(device(), volume());
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice}) {
    LiveView view = first_view(live.scene(), 97, 81);
    view.mode = mode;
    view.azimuth_deg = -77.25;
    view.zoom = 1.5;
    view.pan = {0.1, -0.05};
    // A moving frame between two still ones changes nothing.
    const LiveFrame first = live.draw(view, 97, 81, false);
    static_cast<void>(live.draw(view, 97, 81, true));
    const LiveFrame again = live.draw(view, 97, 81, false);
    const Image truth = raycast(device(), resident, options_of(view, live.scene(), 97, 81)).image;
    BOOST_TEST(first.full);
    BOOST_TEST(same(first.image, truth));
    BOOST_TEST(same(again.image, truth));
  }
}

BOOST_AUTO_TEST_CASE(a_clip_box_cuts_the_volume) {
  LiveRenderer live(device(), volume());
  const ResidentVolume resident(device(), volume());
  LiveView view = first_view(live.scene(), 90, 80);
  const Image whole = live.draw(view, 90, 80, false).image;
  view.clip = {-20, -20, -20, 0, 20, 20};
  RenderOptions o = options_of(view, live.scene(), 90, 80);
  BOOST_TEST(o.clip->high[0] == 0);
  const Image half = live.draw(view, 90, 80, false).image;
  BOOST_TEST(same(half, raycast(device(), resident, o).image));
  BOOST_TEST(!same(half, whole));
  view.clip.reset();
  BOOST_TEST(same(live.draw(view, 90, 80, false).image, whole));
}

BOOST_AUTO_TEST_CASE(the_bounds_colours_are_mixed_in_where_something_is_seen) {
  LiveRenderer live(device(), volume(), certificate());
  const ResidentVolume resident(device(), volume());
  Renderer renderer(device(), resident);
  const SafeSampler safe = safe_sampler(device(), volume(), certificate());
  const bool image3d = renderer.sampler(safe.sampler) == SamplerKind::image3d;
  renderer.set_bounds(brick_bounds(*safe.certificate, image3d));
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::mip}) {
    LiveView view = first_view(live.scene(), 90, 80);
    view.mode = mode;
    RenderOptions o = options_of(view, live.scene(), 90, 80);
    o.sampler = safe.sampler;
    const Image plain = renderer.render(o).image;
    o.output = RenderOutput::error;
    const FloatImage bounds = renderer.render(o).values;
    const Image colours = bound_picture(bounds, 1);
    view.bound = true;
    const Image mixed = live.draw(view, 90, 80, false).image;
    std::size_t changed = 0;
    for (std::size_t i = 0; i < mixed.rgb.size(); ++i) {
      const bool seen = !std::isnan(bounds.values[i / 3]);
      const int wanted = seen ? (plain.rgb[i] + colours.rgb[i] + 1) / 2 : plain.rgb[i];
      BOOST_REQUIRE(mixed.rgb[i] == wanted);
      changed += mixed.rgb[i] != plain.rgb[i];
    }
    BOOST_TEST(changed > 1000u);
  }
}

BOOST_AUTO_TEST_CASE(slices_of_the_bound_are_those_of_render) {
  LiveRenderer live(device(), volume(), certificate());
  LiveView view = first_view(live.scene(), 200, 180);
  view.mode = RenderMode::error;
  const SafeSampler safe = safe_sampler(device(), volume(), certificate());
  const bool image3d =
      Renderer(device(), ResidentVolume(device(), volume())).sampler(safe.sampler) == SamplerKind::image3d;
  const Image truth =
      bound_slice(volume(), *safe.certificate, image3d, {2, view.slice_position, 200, 180}).image;
  BOOST_TEST(same(live.draw(view, 200, 180, true).image, truth));
  view.mode = RenderMode::slice;
  const Image plain = live.draw(view, 200, 180, false).image;
  view.bound = true;
  BOOST_TEST(!same(live.draw(view, 200, 180, false).image, plain));
}

BOOST_AUTO_TEST_CASE(moving_frames_have_the_shape_asked_for_and_fewer_pixels_when_time_is_short) {
  LiveRenderer hurried(device(), volume(), {}, 1e-9), patient(device(), volume(), {}, 1e3);
  const LiveView view = first_view(hurried.scene(), 640, 320);
  LiveFrame coarse, fine;
  for (int i = 0; i < 3; ++i) {
    coarse = hurried.draw(view, 640, 320, true);
    fine = patient.draw(view, 640, 320, true);
  }
  BOOST_TEST(!coarse.full);
  BOOST_TEST(coarse.image.width == 40);
  BOOST_TEST(coarse.image.height == 32);  // no side below it
  BOOST_TEST(fine.image.width == 640);
  BOOST_TEST(patient.draw(view, 640, 320, false).full);
}

constexpr double seconds_a_frame = 0.02;

BOOST_AUTO_TEST_CASE(the_pace_keeps_its_budget_at_any_speed) {
  for (double per_pixel = 1e-9; per_pixel < 1e-5; per_pixel *= 1.7) {
    FramePace pace(seconds_a_frame);
    pace.observe(1000, 1000 * per_pixel);
    const auto [width, height] = pace.size(1920, 1080);
    const double seconds = static_cast<double>(width * height) * per_pixel;
    // Rounding of a side to whole pixels may add half a pixel to each.
    const double slack = (1 + 0.5 / static_cast<double>(width)) * (1 + 0.5 / static_cast<double>(height));
    const bool coarsest = width <= 1920 / 16;
    BOOST_TEST((coarsest || seconds <= seconds_a_frame * slack));
    // No coarser than it must be: a step of the side is 2^(1/4), of the pixels its square.
    BOOST_TEST((width == 1920 || seconds * std::sqrt(2.0) * slack * slack >= seconds_a_frame));
  }
}

BOOST_AUTO_TEST_CASE(what_got_slower_is_followed_at_once) {
  FramePace pace(seconds_a_frame);
  for (int i = 0; i < 10; ++i) pace.observe(100000, 0.01);
  const auto before = pace.size(512, 512);
  pace.observe(100000, 0.5);
  BOOST_TEST(pace.size(512, 512).first < before.first);
  pace.observe(0, 1);
  pace.observe(100, std::nan(""));
  BOOST_TEST(pace.size(512, 512).first < before.first);
}

BOOST_AUTO_TEST_CASE(views_out_of_range_are_refused) {
  LiveRenderer live(device(), volume());
  LiveView view = first_view(live.scene(), 64, 64);
  view.bound = true;
  BOOST_CHECK_THROW(live.draw(view, 64, 64, false), InputError);
  view.bound = false;
  BOOST_CHECK_THROW(live.draw(view, 64, 5000, false), InputError);
  view.slice_position = 1e9;
  BOOST_CHECK_THROW(live.draw(view, 64, 64, false), InputError);
}
