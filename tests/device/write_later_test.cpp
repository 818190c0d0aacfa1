// Small arrays that are written without waiting, and buffers and kernels that are used again.
#define BOOST_TEST_MODULE write_later
#include "host/base/opencl/write_later.hpp"
#include "host/base/opencl/kernel.hpp"

#include <boost/test/unit_test.hpp>
#include <numeric>
#include <optional>

namespace vdvr {
namespace {

BOOST_AUTO_TEST_CASE(values_may_change_as_soon_as_they_are_written) {
  Device device;
  opencl::State& state = device.state();
  std::vector<opencl::DeviceArray<int>> arrays;
  std::vector<int> values(1000);
  for (int i = 0; i < 50; ++i) {
    std::iota(values.begin(), values.end(), 1000 * i);
    arrays.push_back(opencl::copied<int>(state, values, "numbers"));
    std::fill(values.begin(), values.end(), -1);
  }
  for (int i = 0; i < 50; ++i) {
    std::iota(values.begin(), values.end(), 1000 * i);
    BOOST_TEST(arrays[static_cast<std::size_t>(i)].to_host() == values);
  }
}

BOOST_AUTO_TEST_CASE(an_array_is_not_written_beyond_its_end) {
  Device device;
  opencl::DeviceArray<int> array(device.state(), 3, "numbers");
  const std::vector<int> values(4, 0);
  BOOST_CHECK_THROW(opencl::write_later<int>(device.state(), array, values), DeviceError);
}

// A buffer that is given back while a write to it is under way goes to the next array of its size, after it.
BOOST_AUTO_TEST_CASE(buffers_of_all_sizes_are_used_again_in_order) {
  Device device;
  opencl::State& state = device.state();
  for (const std::size_t size : {1, 63, 64, 65, 5000, 300000}) {
    std::optional<opencl::DeviceArray<int>> held;
    for (int i = 0; i < 20; ++i) {
      const std::vector<int> values(size, i);
      opencl::DeviceArray<int> array = opencl::copied<int>(state, values, "numbers");
      if (held) BOOST_TEST((held->to_host() == std::vector<int>(size, i - 2 + i % 2)));
      if (i % 2 == 0) held = std::move(array);
    }
  }
}

// More than may wait at once, in pieces that fit a page of copies and in pieces that do not.
BOOST_AUTO_TEST_CASE(what_is_written_goes_out_from_pages_that_are_used_again) {
  Device device;
  opencl::State& state = device.state();
  std::vector<opencl::DeviceArray<int>> arrays;
  const auto values = [](std::size_t i) {
    return std::vector<int>(i % 3 == 0 ? 700'000 : 1 + 977 * (i % 7), static_cast<int>(i));
  };
  for (std::size_t i = 0; i < 100; ++i) arrays.push_back(opencl::copied<int>(state, values(i), "numbers"));
  for (std::size_t i = 0; i < 100; ++i) BOOST_TEST((arrays[i].to_host() == values(i)));
}

// Of a square of 16 x 16 numbers, rows become columns.
BOOST_AUTO_TEST_CASE(launchers_have_their_own_arguments) {
  Device device;
  opencl::State& state = device.state();
  using Turn = opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int>;
  const auto launcher = [&] { return Turn(state, "field/fbp/turn", "turn"); };
  const auto square = [](int first) {
    std::vector<float> out(256);
    std::iota(out.begin(), out.end(), static_cast<float>(first));
    return out;
  };
  const auto is_turned = [](const opencl::DeviceArray<float>& of, int first) {
    const std::vector<float> got = of.to_host();
    for (std::size_t i = 0; i < 256; ++i)
      if (got[i] != static_cast<float>(first) + static_cast<float>(i % 16 * 16 + i / 16)) return false;
    return true;
  };
  const auto turn = [&](Turn& by, const opencl::DeviceArray<float>& to,
                        const opencl::DeviceArray<float>& from) {
    by({{16, 1, 1}, {1, 1, 1}}, to.buffer(), from.buffer(), 1, 16, 16);
  };
  const auto one = opencl::copied<float>(state, square(0), "one"),
             two = opencl::copied<float>(state, square(500), "two");
  const opencl::DeviceArray<float> of_one(state, 256, "out"), of_two(state, 256, "out"),
      later(state, 256, "out");
  {
    Turn a = launcher(), b = launcher();
    turn(a, of_one, one);
    turn(b, of_two, two);
    turn(a, later, one);
    BOOST_TEST(is_turned(of_one, 0));
    BOOST_TEST(is_turned(of_two, 500));
    BOOST_TEST(is_turned(later, 0));
  }
  Turn again = launcher();  // one of those
  turn(again, later, two);
  BOOST_TEST(is_turned(later, 500));
}

}  // namespace
}  // namespace vdvr
