#define BOOST_TEST_MODULE probe_sampler
#include <boost/test/unit_test.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "vdvr/raycast.hpp"

using namespace vdvr;

BOOST_AUTO_TEST_CASE(charged_delta_is_never_below_what_was_measured) {
  for (const auto& info : Device::list()) {
    Device device(std::to_string(info.index));
    const SamplerProbe p = probe_sampler(device);
    BOOST_TEST_CONTEXT(info.name) {
      BOOST_TEST(p.buffer_rate > 0);
      BOOST_TEST(p.image3d == info.linear_float_image);
      BOOST_TEST(!p.note.empty());
      if (!p.image3d) {
        BOOST_TEST(p.chosen == "buffer");
        continue;
      }
      BOOST_TEST(p.delta >= p.weight_error);
      // fp32, rounding, truncation, or what was measured: never anything in between.
      BOOST_TEST((p.delta == 0x1p-22 || p.delta >= 0x1p-9));
      BOOST_TEST(p.constant_error >= 0);
      BOOST_TEST(p.image3d_rate > 0);
      BOOST_TEST(p.chosen == (p.image3d_rate > p.buffer_rate ? "image3d" : "buffer"));
    }
  }
}

// A unit that is known, because tests/support/opencl_shim.cpp is it.
BOOST_AUTO_TEST_CASE(weights_of_so_many_bits_are_charged_for_all_that_they_may_err) {
  const char *bits = std::getenv("VDVR_SHIM_FILTER_BITS"), *cut = std::getenv("VDVR_SHIM_FILTER_CUT"),
             *products = std::getenv("VDVR_SHIM_FILTER_PRODUCTS");
  if (bits == nullptr) return;
  Device device;
  const SamplerProbe p = probe_filters(device);
  const double unit = std::ldexp(1, -std::atoi(bits));
  for (const SampleType type : {SampleType::f32, SampleType::u16, SampleType::u8}) {
    const FilterProbe& filter = p.of(type);
    BOOST_TEST(filter.image3d);
    BOOST_TEST(filter.delta >= (cut != nullptr ? unit : 0.5 * unit));
    // Nothing is left that a constant shows.
    BOOST_TEST(filter.constant_error <= 0x1p-22);
    // What it errs by, in half units. Where its fractions are rounded by 1 along each axis, 2 if they are
    // cut. Where products of 8 bits are rounded too, what all 2^24 triples of fractions show, each half a
    // unit off either way: where samples differ alike less than 9, for the fractions by 3, for the product
    // along x and y by 2, since that moves weight on either side, for those along z by 1 at each of four
    // edges.
    constexpr std::array<double, 8> of_products{0, 4.857, 4.857, 6.215, 6.857, 7.357, 7.357, 8.715};
    for (std::size_t k = 1; k < 8; ++k) {
      const double steps = 0.5 * (3 + std::popcount(k)), most = (products != nullptr ? of_products[k]
                                                                 : cut != nullptr    ? 2 * steps
                                                                                     : steps) *
                                                                0.5 * unit;
      BOOST_TEST(filter.by_steps[k] >= most);
      BOOST_TEST(filter.by_steps[k] <= 1.12 * most);
    }
  }
}

BOOST_AUTO_TEST_CASE(filters_are_the_same_with_and_without_rates) {
  Device device;
  const SamplerProbe filters = probe_filters(device), all = probe_sampler(device);
  for (const SampleType type : {SampleType::f32, SampleType::u16, SampleType::u8}) {
    BOOST_TEST(filters.of(type).image3d == all.of(type).image3d);
    BOOST_TEST(filters.of(type).delta == all.of(type).delta);
    BOOST_TEST(filters.of(type).constant_error == all.of(type).constant_error);
  }
  BOOST_TEST(filters.note == all.note);
  BOOST_TEST(!all.chosen.empty());
}

BOOST_AUTO_TEST_CASE(probe_is_measured_once_per_device) {
  Device device;
  const SamplerProbe first = probe_sampler(device), second = probe_sampler(device);
  BOOST_TEST(first.buffer_rate == second.buffer_rate);
  Device again(std::to_string(device.info().index));
  BOOST_TEST(probe_sampler(again).buffer_rate == first.buffer_rate);
}
