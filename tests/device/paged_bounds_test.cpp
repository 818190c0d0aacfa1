// Intervals of pixels of volumes that come to the device by bricks: the bits of the whole volume's, whatever
// the steps, the light, the types and the camera, on a device that has no room for the whole.
#define BOOST_TEST_MODULE paged_bounds
#include <boost/test/unit_test.hpp>

#include <string>

#include "tests/support/paged_cases.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/stop.hpp"

using namespace vdvr;
using support::budget_for;
using support::PagedCase;
using support::same_bits;

namespace {

// Intervals, tables and a list of pieces beside the volume.
constexpr std::uint64_t kAside = 20'000'000;

/// Bricks differ in their bounds, and one was not tested.
std::vector<float> bounds_of(const MixedVolume& v) {
  std::vector<float> bounds;
  for (std::size_t i = 0; i < v.level.size(); ++i) bounds.push_back(static_cast<float>(1 + i % 7) / 256);
  bounds[bounds.size() / 2] = std::numeric_limits<float>::infinity();
  return bounds;
}

struct Asked {
  const char* name;
  RenderOptions picture;
  CertifyPictureOptions certify;
};

std::vector<Asked> pictures(const MixedVolume& v) {
  Asked plain{"unlit", {}, {}};
  RenderOptions& o = plain.picture;
  o.width = 131;
  o.height = 98;
  o.camera = orbit_camera(v.grid, 37, 21, 1);
  o.transfer = {"haze",
                {{-1.5, {0.1, 0.2, 0.9}, 0.0}, {0, {0.2, 0.9, 0.3}, 0.02}, {1.5, {0.9, 0.2, 0.1}, 0.1}}};
  o.sampler = SamplerKind::buffer;
  o.gradient = GradientKind::central;
  o.shading = false;
  std::vector<Asked> all;
  const auto add = [&](const char* name, auto&& change) {
    all.push_back(plain);
    all.back().name = name;
    change(all.back());
  };
  add("unlit", [](Asked&) {});
  add("box", [](Asked& a) { a.certify.box = true; });
  add("fast", [](Asked& a) { a.certify.fast = true; });
  // Parallel to faces of bricks, of which one lies .25 cells beside the middle of the picture, where it is
  // cut, and with pixels of .3 cells: light of the rays there, .15 cells from the middle, is of samples
  // beyond that face.
  add("lit", [](Asked& a) {
    a.picture.shading = true;
    a.picture.width = 128;
    a.picture.camera = look_at({-2.25, -9000, 1}, {-2.25, 0, 1}, std::nullopt, 0.1872);
  });
  add("lit by the cell", [](Asked& a) {
    a.picture.shading = true;
    a.picture.gradient = GradientKind::analytic;
  });
  add("from within", [](Asked& a) { a.picture.camera = support::from_within(); });
  add("clipped, with a jump", [](Asked& a) {
    a.picture.transfer = {"jump", {{0.6, {0, 0, 1}, 0}, {0.6, {1, 0.5, 0}, 0.7}, {1, {1, 1, 0}, 0.9}}};
    a.picture.clip = Clip{};
    a.picture.clip->low = {-5, -30, -30};
    a.picture.clip->axis = {1, 2};
    a.picture.clip->radius = 9;
  });
  // From far away, where rounding moves rays most.
  add("far", [](Asked& a) { a.picture.camera = look_at({4000, 9000, -3000}, {0, 0, 0}, std::nullopt, 0.4); });
  return all;
}

void check_same(const PixelBounds& a, const PixelBounds& b) {
  BOOST_TEST(same_bits(a.lo.values, b.lo.values));
  BOOST_TEST(same_bits(a.hi.values, b.hi.values));
  BOOST_TEST((a.parts == b.parts));
  BOOST_TEST((a.untested == b.untested));
  BOOST_TEST(a.ray_offset_pixels == b.ray_offset_pixels);
  BOOST_TEST((a.light == b.light));
}

}  // namespace

BOOST_AUTO_TEST_CASE(intervals_by_bricks_are_those_of_the_whole_volume_to_the_bit) {
  for (const PagedCase& c : support::paged_cases()) {
    const bool first = &c == &support::paged_cases().front();
    const auto bounds = bounds_of(c.volume);
    const ResidentVolume whole(support::device(), c.volume);
    const std::uint64_t budget = budget_for(c.volume, false);
    Device small("", budget + kAside);
    const PagedVolume paged(small, c.volume, budget);
    std::uint64_t n = 0;
    for (const Asked& a : pictures(c.volume)) {
      // Compilers take longer than pictures: what does not depend on types is certified of floats alone.
      if (!first && (a.certify.box || a.certify.fast || a.picture.gradient == GradientKind::analytic))
        continue;
      BOOST_TEST_CONTEXT(c.name << ", " << a.name) {
        const PixelBounds expected = certify_pixels(support::device(), whole, bounds, a.picture, a.certify);
        double last = 0;
        const PixelBounds found = certify_pixels(small, paged, bounds, a.picture, a.certify,
                                                 [&](const std::string&, double fraction) {
                                                   BOOST_TEST(fraction > last);
                                                   last = fraction;
                                                 });
        BOOST_TEST(last == 1);
        BOOST_TEST((std::ranges::count(expected.parts, 0u) < std::ssize(expected.parts)));
        check_same(expected, found);
      }
      ++n;
    }
    BOOST_TEST(paged.counts().parts > n);
    BOOST_TEST(paged.counts().largest_part <= paged.memory_bytes());
    BOOST_TEST(small.peak_memory() <= budget + kAside);
  }
}

BOOST_AUTO_TEST_CASE(the_list_of_pieces_keeps_to_the_memory_that_is_left) {
  const MixedVolume& v = support::paged_cases().front().volume;
  const auto bounds = bounds_of(v);
  RenderOptions o = pictures(v).front().picture;
  o.width = o.height = 320;
  const ResidentVolume whole(support::device(), v);
  const PixelBounds expected = certify_pixels(support::device(), whole, bounds, o);
  // Intervals take 3.3 MB and tables 8: of what is left an eighth is the list's.
  Device small("", budget_for(v, false) + kAside);
  const PagedVolume paged(small, v, budget_for(v, false));
  check_same(expected, certify_pixels(small, paged, bounds, o));
  BOOST_TEST(small.peak_memory() <= budget_for(v, false) + kAside);
}

BOOST_AUTO_TEST_CASE(what_does_not_fit_is_refused_with_what_would_do) {
  const MixedVolume& v = support::paged_cases().front().volume;
  const auto bounds = bounds_of(v);
  const RenderOptions o = pictures(v).front().picture;
  Device device;
  const PagedVolume tight(device, v, 900'000);
  std::uint64_t enough = 0;
  BOOST_CHECK_EXCEPTION((void)certify_pixels(device, tight, bounds, o), ResourceError, [&](const auto& e) {
    const std::string text = e.what();
    const auto end = text.find("M a device would do");
    BOOST_REQUIRE_MESSAGE(end != std::string::npos, text);
    enough = std::stoull(text.substr(text.rfind(' ', end) + 1));
    return text.find("behind 8 x 8 pixels") != std::string::npos;
  });
  BOOST_TEST(tight.counts().parts == 0u);
  const PagedVolume roomy(device, v, enough << 20);
  BOOST_TEST(certify_pixels(device, roomy, bounds, o).parts.size() == 131u * 98u);
  RenderOptions image = o;
  image.sampler = SamplerKind::image3d;
  BOOST_CHECK_EXCEPTION((void)certify_pixels(device, roomy, bounds, image), ResourceError, [](const auto& e) {
    return std::string(e.what()).find("`sampler` buffer") != std::string::npos;
  });
}

BOOST_AUTO_TEST_CASE(a_stop_is_heard_between_parts) {
  const MixedVolume& v = support::paged_cases().front().volume;
  const PagedVolume paged(support::device(), v, budget_for(v, false));
  std::uint64_t reports = 0;
  const auto stop = [&](const std::string&, double) {
    ++reports;
    request_stop(2);
  };
  BOOST_CHECK_THROW(
      (void)certify_pixels(support::device(), paged, bounds_of(v), pictures(v).front().picture, {}, stop),
      Interrupted);
  request_stop(0);
  BOOST_TEST(reports == 1u);
}
