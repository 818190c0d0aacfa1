// Small arrays that are written without waiting, and small buffers that are used again.
#define BOOST_TEST_MODULE write_later
#include "host/base/opencl/write_later.hpp"

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

}  // namespace
}  // namespace vdvr
