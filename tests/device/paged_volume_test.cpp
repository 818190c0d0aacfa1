// Pictures of volumes that come to the device by bricks: the bits of the whole volume's, whatever the mode,
// the types and the camera, on a device that has no room for the whole. Samples are random and
// bricks disagree on the faces they share, so that a ray which reads another brick's tile shows.
#define BOOST_TEST_MODULE paged_volume
#include <boost/test/unit_test.hpp>

#include "tests/support/paged_cases.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/render_crew.hpp"

using namespace vdvr;
using support::budget_for;
using support::from_within;
using support::kAside;
using support::PagedCase;
using support::same_bits;

namespace {

/// Every kernel, and what each of them can be asked for.
std::vector<RenderOptions> pictures(const MixedVolume& v) {
  RenderOptions o;
  o.width = 131;
  o.height = 98;
  o.camera = orbit_camera(v.grid, 37, 21, 1);
  // Translucent: what lies behind counts as well.
  o.transfer = {"haze",
                {{-1.5, {0.1, 0.2, 0.9}, 0.0}, {0, {0.2, 0.9, 0.3}, 0.02}, {1.5, {0.9, 0.2, 0.1}, 0.1}}};
  o.surfaces = {{0.3, 0.3}, {0.6, 0.4}};
  o.sampler = SamplerKind::buffer;
  std::vector<RenderOptions> all;
  const auto add = [&](auto&& change) {
    all.push_back(o);
    change(all.back());
  };
  add([](RenderOptions&) {});
  add([](RenderOptions& p) { p.gradient = GradientKind::stored; });
  add([](RenderOptions& p) { p.gradient = GradientKind::analytic; });
  add([](RenderOptions& p) { p.camera = from_within(); });
  add([](RenderOptions& p) {
    p.step_mode = StepMode::adaptive;
    p.gradient = GradientKind::stored;
    p.camera = from_within();
  });
  add([](RenderOptions& p) { p.step_mode = StepMode::adaptive; });
  add([](RenderOptions& p) { p.step_mode = StepMode::level; });
  add([](RenderOptions& p) { p.classification = Classification::preintegrated; });
  add([](RenderOptions& p) { p.output = RenderOutput::normal; });
  add([](RenderOptions& p) { p.output = RenderOutput::depth; });
  add([](RenderOptions& p) {
    p.clip = Clip{};
    p.clip->low = {-5, -30, -30};
    p.clip->axis = {1, 2};
    p.clip->radius = 9;
  });
  add([](RenderOptions& p) { p.mode = RenderMode::iso; });
  add([](RenderOptions& p) {
    p.mode = RenderMode::iso;
    p.camera = from_within();
    p.output = RenderOutput::normal;
  });
  add([](RenderOptions& p) { p.mode = RenderMode::mip; });
  add([](RenderOptions& p) { p.mode = RenderMode::integral; });
  add([](RenderOptions& p) { p.mode = RenderMode::slice; });
  add([&](RenderOptions& p) {
    p.mode = RenderMode::slice;
    p.slice_axis = 0;
    p.slice_position = v.grid.origin[0];
  });
  // From far away, where rounding moves rays most.
  add([](RenderOptions& p) {
    p.camera = look_at({4000, 9000, -3000}, {0, 0, 0}, std::nullopt, 0.4);
    p.skip_empty = false;
  });
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(pictures_by_bricks_are_those_of_the_whole_volume_to_the_bit) {
  for (const PagedCase& c : support::paged_cases())
    for (const bool lit : {false, true}) {
      const ResidentVolume whole(support::device(), c.volume);
      Renderer reference(support::device(), whole);
      const std::uint64_t budget = budget_for(c.volume, lit);
      // The account of this device refuses what the limit does not allow.
      Device small("", budget + kAside);
      const PagedVolume paged(small, c.volume, budget);
      RenderCrew by_bricks({{&small, nullptr, &paged}});
      std::uint64_t n = 0;
      for (const RenderOptions& o : pictures(c.volume)) {
        if ((o.gradient == GradientKind::stored) != lit) continue;
        // Compilers take longer than pictures: what does not depend on types is drawn of floats alone.
        if (&c != &support::paged_cases().front() &&
            (o.output != RenderOutput::colour || o.clip || o.mode == RenderMode::mip ||
             o.mode == RenderMode::integral || o.mode == RenderMode::slice ||
             o.gradient == GradientKind::analytic || o.step_mode == StepMode::level ||
             o.classification == Classification::preintegrated))
          continue;
        BOOST_TEST_CONTEXT(c.name << (lit ? ", lit" : "") << ", picture " << n) {
          const RenderResult expected = reference.render(o), found = by_bricks.render(o);
          BOOST_TEST((expected.image.rgb == found.image.rgb));
          BOOST_TEST(same_bits(expected.values.values, found.values.values));
          BOOST_TEST(expected.samples == found.samples);
        }
        ++n;
      }
      BOOST_TEST(paged.counts().parts > n);
      BOOST_TEST(paged.counts().largest_part > 0u);
      BOOST_TEST(paged.counts().largest_part <= paged.memory_bytes());
      BOOST_TEST(paged.memory_bytes() <= budget);
      // A card has a limit of its own beside the host's.
      BOOST_TEST(small.peak_memory() <= (small.info().is_cpu ? 1 : 2) * (budget + kAside));
    }
}

BOOST_AUTO_TEST_CASE(several_devices_draw_the_picture_of_one) {
  const MixedVolume& v = support::paged_cases().front().volume;
  Device first, second;
  const ResidentVolume whole(first, v), again(second, v);
  Renderer alone(first, whole);
  RenderCrew crew({{&first, &whole, nullptr}, {&second, &again, nullptr}});
  const std::uint64_t budget = budget_for(v, true);
  const PagedVolume paged(first, v, budget), paged_again(second, v, budget);
  RenderCrew by_bricks({{&first, nullptr, &paged}, {&second, nullptr, &paged_again}});
  const std::vector<RenderOptions> all = pictures(v);
  // Gradients where they are needed and stored ones, surfaces.
  for (const std::size_t i : {0u, 1u, 11u}) {
    RenderOptions o = all.at(i);
    o.height = 150;  // several bands, the last one cut
    const RenderResult expected = alone.render(o), found = crew.render(o), bricks = by_bricks.render(o);
    BOOST_TEST((expected.image.rgb == found.image.rgb));
    BOOST_TEST(same_bits(expected.values.values, found.values.values));
    BOOST_TEST(expected.samples == found.samples);
    BOOST_TEST((expected.image.rgb == bricks.image.rgb));
  }
  BOOST_CHECK_THROW(RenderCrew({}), InputError);
  BOOST_CHECK_THROW(RenderCrew({{&first, &whole, &paged}}), InputError);
}

BOOST_AUTO_TEST_CASE(automatic_takes_what_the_whole_volume_takes) {
  const MixedVolume& v = support::paged_cases().front().volume;
  const ResidentVolume whole(support::device(), v);
  Device small("", budget_for(v, true) + kAside);
  const PagedVolume paged(small, v, budget_for(v, true));
  RenderOptions o = pictures(v).front();
  o.gradient = GradientKind::automatic;
  const RenderResult expected = Renderer(support::device(), whole).render(o);
  const RenderResult found = RenderCrew({{&small, nullptr, &paged}}).render(o);
  BOOST_TEST((expected.gradient == found.gradient));
  BOOST_TEST((expected.image.rgb == found.image.rgb));
}

BOOST_AUTO_TEST_CASE(bounds_by_brick_are_those_of_the_whole_volume) {
  const MixedVolume& v = support::paged_cases().front().volume;
  std::vector<float> bounds;
  for (std::size_t i = 0; i < v.level.size(); ++i) bounds.push_back(static_cast<float>(1 + i % 7) / 64);
  const ResidentVolume whole(support::device(), v);
  Device small("", budget_for(v, false) + kAside);
  const PagedVolume paged(small, v, budget_for(v, false));
  Renderer reference(support::device(), whole);
  RenderCrew by_bricks({{&small, nullptr, &paged}});
  reference.set_bounds(bounds);
  by_bricks.set_bounds(bounds);
  RenderOptions o = pictures(v).front();
  o.output = RenderOutput::error;
  BOOST_TEST(same_bits(reference.render(o).values.values, by_bricks.render(o).values.values));
}

BOOST_AUTO_TEST_CASE(what_does_not_fit_is_refused_with_what_it_needs) {
  const MixedVolume& v = support::paged_cases().front().volume;
  Device device;
  const auto says = [](const char* text) {
    return [text](const ResourceError& e) { return std::string(e.what()).find(text) != std::string::npos; };
  };
  BOOST_CHECK_EXCEPTION(PagedVolume(device, v, 100'000), ResourceError, says("base and index"));
  const PagedVolume tight(device, v, 900'000);
  RenderCrew renderer({{&device, nullptr, &tight}});
  RenderOptions o = pictures(v).front();
  BOOST_CHECK_EXCEPTION(renderer.render(o), ResourceError, says("behind 8 x 8 pixels"));
  o.sampler = SamplerKind::image3d;
  BOOST_CHECK_EXCEPTION(renderer.render(o), ResourceError, says("`sampler` buffer"));
}
