// What a certificate says of the texture unit of the device that draws, whatever its file says of another's.
#define BOOST_TEST_MODULE safe_sampler
#include <boost/test/unit_test.hpp>

#include <algorithm>

#include "host/volume/sampler/sampler_terms.hpp"
#include "tests/support/device.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/live_renderer.hpp"
#include "vdvr/expert/safe_sampler.hpp"

using namespace vdvr;
using support::device;

namespace {

constexpr double kEpsilon = 0.5;

const MixedVolume& volume() {
  static const MixedVolume v =
      support::random_mixed({{12, 8, 8}, {0, 0, 0}, {1, 1, 1}, "pixel"}, 4, 4, {{0, 0, 0}, {1, 1, 1}}, 5);
  return v;
}

/// Of a device whose texture unit is said to err by nothing.
Certificate stored() {
  Certificate c;
  c.epsilon = c.epsilon_abs = kEpsilon;
  c.measured_total = c.total_buffer = 0.25;
  c.brick_totals.assign(volume().level.size(), 0.25f);
  c.holds_buffer = true;
  c.budget.sampler.image3d = ErrorTerm{0, "a device without error"};
  c.total_image3d = c.total_buffer;
  c.holds_image3d = true;
  return c;
}

double own_term(const Certificate& c) {
  return sampler_terms(field_slopes(volume()), volume().grid, probe_filters(device()),
                       atlas_length(device().info(), volume()), c.epsilon_abs, volume().rate,
                       sampler_underflow(device().info()))
      .image3d->value;
}

// Just less than what this device needs.
Certificate too_close(Certificate c) {
  const auto total = static_cast<float>(kEpsilon - 0.5 * own_term(c));
  c.brick_totals.assign(volume().level.size(), total);
  c.measured_total = c.total_buffer = static_cast<double>(total);
  c.total_image3d = c.total_buffer;
  return c;
}

bool has_image3d() { return atlas_length(device().info(), volume()) > 0 && probe_filters(device()).image3d; }

}  // namespace

BOOST_AUTO_TEST_CASE(the_term_of_another_device_is_replaced_by_this_one_s) {
  if (!has_image3d()) return;
  const Certificate c = certificate_on(device(), volume(), stored());
  const double own = own_term(c);
  BOOST_REQUIRE(own > 0);
  BOOST_TEST(c.budget.sampler.image3d->value == own);
  BOOST_TEST(*c.total_image3d == c.measured_total + own);
  BOOST_TEST(*c.holds_image3d);
  BOOST_TEST(c.total_buffer == stored().total_buffer);
  BOOST_TEST(contradiction(c) == contradiction(stored()));
  // And bounds by brick with each one's own.
  const std::vector<float> bounds = brick_bounds(c, true);
  BOOST_TEST(static_cast<double>(*std::max_element(bounds.begin(), bounds.end())) >= 0.25 + own);
  BOOST_TEST(static_cast<double>(*std::min_element(bounds.begin(), bounds.end())) < 0.25 + 0.9 * own);
}

BOOST_AUTO_TEST_CASE(a_sampler_that_does_not_hold_here_gives_way_to_the_buffer_or_is_refused) {
  using enum SamplerKind;
  if (!has_image3d()) return;
  Certificate c = stored();
  BOOST_CHECK(safe_sampler(device(), volume(), c, image3d).sampler == image3d);
  c = too_close(c);
  BOOST_TEST(contradiction(c).empty());  // the file looks right
  BOOST_CHECK_EXCEPTION(safe_sampler(device(), volume(), c, image3d), ToleranceError, [](const Error& e) {
    return std::string(e.what()).find("use `sampler` buffer") != std::string::npos;
  });
  const SafeSampler unverified = safe_sampler(device(), volume(), c, image3d, true);
  BOOST_CHECK(unverified.sampler == image3d);
  BOOST_TEST(!*unverified.certificate->holds_image3d);
  const SafeSampler automatic_one = safe_sampler(device(), volume(), c);
  const bool faster = probe_sampler(device()).chosen == "image3d";
  BOOST_CHECK(automatic_one.sampler == (faster ? buffer : automatic));
  BOOST_TEST(automatic_one.reason.empty() == !faster);
  // Nothing that was not found on this device can be asked of it.
  BOOST_CHECK_THROW(brick_bounds(*automatic_one.certificate, true), InputError);
  BOOST_CHECK(safe_sampler(device(), volume(), c, buffer).sampler == buffer);
  c.comparison = true;
  c.holds_buffer = false;
  c.holds_image3d = false;
  BOOST_CHECK(safe_sampler(device(), volume(), c, image3d).sampler == image3d);
}

BOOST_AUTO_TEST_CASE(without_a_certificate_any_sampler_is_taken) {
  using enum SamplerKind;
  for (const SamplerKind kind : {automatic, image3d, buffer}) {
    const SafeSampler safe = safe_sampler(device(), volume(), {}, kind);
    BOOST_CHECK(safe.sampler == kind);
    BOOST_TEST(!safe.certificate);
  }
}

BOOST_AUTO_TEST_CASE(a_live_picture_is_not_drawn_by_a_sampler_that_does_not_hold_here) {
  if (!has_image3d()) return;
  const LiveRenderer renderer(device(), volume(), too_close(stored()));
  const bool faster = probe_sampler(device()).chosen == "image3d";
  BOOST_CHECK(renderer.scene().sampler == (faster ? SamplerKind::buffer : SamplerKind::automatic));
}
