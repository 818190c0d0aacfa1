#define BOOST_TEST_MODULE probe_sampler
#include <boost/test/unit_test.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "vdvr/raycast.hpp"

#include "host/base/opencl/state.hpp"
#include "host/base/system/cache_files.hpp"
#include "host/volume/sampler/remembered_probe.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace vdvr;

namespace {

// What these tests are about is measured.
struct NothingRemembered {
  NothingRemembered() { setenv("VDVR_CACHE", "off", 1); }
};
BOOST_TEST_GLOBAL_FIXTURE(NothingRemembered);

bool same(const FilterProbe& a, const FilterProbe& b) {
  return a.image3d == b.image3d && a.weight_error == b.weight_error && a.delta == b.delta &&
         a.by_steps == b.by_steps && a.constant_error == b.constant_error;
}

bool same_filters(const SamplerProbe& a, const SamplerProbe& b) {
  return same(a, b) && same(a.u16, b.u16) && same(a.u8, b.u8) && a.note == b.note;
}

// The only file that remembers a sampler.
std::filesystem::path only_file(const std::filesystem::path& cache) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(cache / "vdvr/samplers"))
    files.push_back(entry.path());
  BOOST_REQUIRE(files.size() == 1);
  return files.front();
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

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

BOOST_AUTO_TEST_CASE(what_is_remembered_is_what_was_measured_and_nothing_else_is_taken_for_it) {
  const support::TemporaryFolder folder;
  Device device;
  opencl::State& state = device.state();
  const SamplerProbe measured = probe_filters(device);
  remember_filters(state, measured);  // VDVR_CACHE is off
  BOOST_TEST(!std::filesystem::exists(folder.path() / "vdvr"));
  setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  setenv("VDVR_CACHE", "", 1);
  BOOST_TEST(!remembered_filters(state));
  remember_filters(state, measured);
  if (std::getenv("LD_PRELOAD") != nullptr) {  // as a GPU
    BOOST_TEST(!std::filesystem::exists(folder.path() / "vdvr"));
    return;
  }
  const auto known = remembered_filters(state);
  BOOST_REQUIRE(known.has_value());
  BOOST_TEST(same_filters(*known, measured));

  const std::filesystem::path file = only_file(folder.path());
  const std::string text = text_of(file);
  const auto holds = [&](const std::string& bytes) {
    std::ofstream(file) << bytes;
    return remembered_filters(state).has_value();
  };
  for (std::size_t size = 0; size < text.size(); size += 7) BOOST_TEST(!holds(text.substr(0, size)));
  for (std::size_t i = 0; i < text.size(); i += 3) {
    std::string another = text;
    another[i] ^= 1;
    BOOST_TEST(!holds(another), "byte " << i);
  }
  BOOST_TEST(!holds("x" + text));
  BOOST_TEST(!holds(text + "\n"));
  BOOST_TEST(holds(text));
  setenv("OPENCL_LAYERS", "some.so", 1);
  BOOST_TEST(!remembered_filters(state));
  unsetenv("OPENCL_LAYERS");

  SamplerProbe wrong = measured;
  wrong.u8.delta = HUGE_VAL;
  std::filesystem::remove(file);
  remember_filters(state, wrong);
  BOOST_TEST(!std::filesystem::exists(file));
  setenv("VDVR_CACHE", "off", 1);
}
