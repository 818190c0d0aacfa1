// Renderers in several threads on one volume, and renderers that draw one thing after another. Under
// ThreadSanitizer this is the test of what threads share: the volume, the device's programs, memory and queue
// (docs/robustness.md).
#define BOOST_TEST_MODULE renderers
#include <boost/test/unit_test.hpp>

#include <bit>
#include <cmath>
#include <future>

#include "host/picture/render/raycast.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::scattered_levels;

namespace {

double blob(double x, double y, double z) {
  return std::max(0.0, 1 - (x * x + 1.5 * y * y + z * z) / 90) + 0.1 * std::sin(x + 2 * y);
}

const MixedVolume& volume() {
  static const MixedVolume v = fields::mixed(centred_grid({22, 19, 24}), 4, scattered_levels, blob);
  return v;
}

std::vector<float> some_bounds() {
  std::vector<float> bounds;
  for (std::size_t i = 0; i < volume().level.size(); ++i)
    bounds.push_back(static_cast<float>(1 + i % 7) / 64);
  return bounds;
}

/// Pictures that differ in all that a renderer keeps: size, tables, distances, gradients, sampler, bounds.
std::vector<RenderOptions> pictures(bool image3d) {
  RenderOptions o;
  o.width = 72;
  o.height = 56;
  o.camera = orbit_camera(volume().grid, 37, 21, 1);
  o.transfer = transfer_preset("default", 0, 1);
  o.surfaces = {{0.5}};
  o.sampler = SamplerKind::buffer;
  std::vector<RenderOptions> all;
  const auto add = [&](auto&& change) {
    all.push_back(o);
    change(all.back());
  };
  add([](RenderOptions&) {});
  add([](RenderOptions& p) {
    // Large enough for the pool of buffers.
    p.width = p.height = 264;
    p.gradient = GradientKind::stored;
    p.camera = orbit_camera(volume().grid, 120, -10, 2);
  });
  add([](RenderOptions& p) { p.mode = RenderMode::iso; });
  add([](RenderOptions& p) {
    p.mode = RenderMode::iso;
    p.output = RenderOutput::normal;
    p.surfaces = {{0.3, 0.5}, {0.8}};
  });
  add([](RenderOptions& p) { p.mode = RenderMode::mip; });
  add([](RenderOptions& p) { p.mode = RenderMode::slice; });
  add([](RenderOptions& p) { p.classification = Classification::preintegrated; });
  add([](RenderOptions& p) {
    p.step_mode = StepMode::level;
    p.transfer = transfer_preset("default", 0.2, 0.9);
  });
  add([](RenderOptions& p) { p.output = RenderOutput::error; });
  add([](RenderOptions& p) { p.mode = RenderMode::integral; });
  if (image3d) add([](RenderOptions& p) { p.sampler = SamplerKind::image3d; });
  return all;
}

bool same(const RenderResult& a, const RenderResult& b) {
  const auto same_bits = [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  };
  return a.image.rgb == b.image.rgb && std::ranges::equal(a.values.values, b.values.values, same_bits) &&
         a.samples == b.samples && a.sampler == b.sampler && a.gradient == b.gradient;
}

/// Each picture by a device, volume and renderer that have drawn nothing before.
std::vector<RenderResult> drawn_alone(const std::vector<RenderOptions>& options) {
  std::vector<RenderResult> results;
  Device device;
  for (const RenderOptions& o : options) {
    const ResidentVolume resident(device, volume());
    Renderer renderer(device, resident);
    renderer.set_bounds(some_bounds());
    results.push_back(renderer.render(o));
  }
  return results;
}

/// Pictures that differ from those drawn alone, of `rounds` renderers one after another that begin at
/// `first`.
int draw_and_compare(Device& device, const ResidentVolume& resident,
                     const std::vector<RenderOptions>& options, const std::vector<RenderResult>& alone,
                     std::size_t first, int rounds) {
  int wrong = 0;
  for (int round = 0; round < rounds; ++round) {
    Renderer renderer(device, resident);
    renderer.set_bounds(some_bounds());
    for (std::size_t i = 0; i < options.size(); ++i) {
      const std::size_t n = options.size(), k = (first + (round % 2 == 0 ? i : n - 1 - i)) % n;
      if (!same(renderer.render(options[k]), alone[k])) ++wrong;
    }
  }
  return wrong;
}

bool has_image3d() { return ResidentVolume(support::device(), volume()).has_image3d(); }

}  // namespace

BOOST_AUTO_TEST_CASE(what_a_renderer_drew_before_never_shows) {
  const auto options = pictures(has_image3d());
  const auto alone = drawn_alone(options);
  Device& device = support::device();
  const ResidentVolume resident(device, volume());
  for (const std::size_t first : {0, 2, 5})
    BOOST_TEST(draw_and_compare(device, resident, options, alone, first, 2) == 0);
}

// Bytes and values are made on the device, four pixels at a time; on the host where several devices share a
// picture. Of pixels that are no multiple of four, of colours beyond 0 and 1, and where nothing is met.
BOOST_AUTO_TEST_CASE(the_device_develops_as_the_host_does) {
  const ResidentVolume resident(support::device(), volume());
  for (const RenderMode mode : {RenderMode::dvr, RenderMode::iso, RenderMode::mip, RenderMode::slice})
    for (const auto& [width, height] : {std::pair{1, 1}, {33, 31}, {6, 5}, {64, 48}}) {
      RenderOptions o = pictures(false).front();
      o.mode = mode;
      o.width = width;
      o.height = height;
      o.camera = orbit_camera(volume().grid, 37, 21, 0.4);
      o.background_top = {1.25, -0.25, 0.5};
      RenderResult on_host;
      convert(raycast_float(support::device(), resident, o).pixels, o, on_host);
      const RenderResult on_device = raycast(support::device(), resident, o);
      BOOST_TEST((on_device.image.rgb == on_host.image.rgb));
      BOOST_TEST(std::ranges::equal(on_device.values.values, on_host.values.values, [](float x, float y) {
        return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
      }));
    }
}

BOOST_AUTO_TEST_CASE(renderers_in_two_threads_give_the_pictures_of_one) {
  const auto options = pictures(has_image3d());
  const auto alone = drawn_alone(options);
  // Nothing is made yet: programs, atlas and stored gradients are first wanted by both at once.
  Device device;
  const ResidentVolume resident(device, volume());
  const auto draw = [&](std::size_t first) {
    return std::async(std::launch::async,
                      [&, first] { return draw_and_compare(device, resident, options, alone, first, 4); });
  };
  auto one = draw(0), other = draw(2);
  BOOST_TEST(one.get() == 0);
  BOOST_TEST(other.get() == 0);
}

BOOST_AUTO_TEST_CASE(a_failed_picture_leaves_the_next_as_it_was) {
  Device& device = support::device();
  const ResidentVolume resident(device, volume());
  const auto options = pictures(false);
  Renderer renderer(device, resident);
  BOOST_CHECK_THROW(renderer.render(options[8]), InputError);  // no bounds yet
  const RenderResult first = renderer.render(options[0]);
  RenderOptions outside = options[5];
  outside.slice_position = 1000;
  BOOST_CHECK_THROW(renderer.render(outside), InputError);
  BOOST_CHECK_THROW(renderer.set_bounds({1, 2, 3}), InputError);
  BOOST_TEST(same(renderer.render(options[0]), first));
}

BOOST_AUTO_TEST_CASE(the_sampler_named_beforehand_is_the_one_taken) {
  Device& device = support::device();
  const ResidentVolume resident(device, volume());
  Renderer renderer(device, resident);
  RenderOptions o = pictures(false)[0];
  for (const SamplerKind asked : {SamplerKind::automatic, SamplerKind::buffer}) {
    o.sampler = asked;
    BOOST_TEST((renderer.sampler(asked) == renderer.render(o).sampler));
  }
  if (resident.has_image3d()) BOOST_TEST((renderer.sampler(SamplerKind::image3d) == SamplerKind::image3d));
  else BOOST_CHECK_THROW(static_cast<void>(renderer.sampler(SamplerKind::image3d)), ResourceError);
}
