#define BOOST_TEST_MODULE device
#include <boost/test/unit_test.hpp>

#include "host/base/opencl/kernel.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;

BOOST_AUTO_TEST_CASE(at_least_one_device_is_listed) { BOOST_TEST(!Device::list().empty()); }

BOOST_AUTO_TEST_CASE(unknown_device_is_refused_with_the_list) {
  try {
    Device device("no such device");
    BOOST_FAIL("accepted");
  } catch (const DeviceError& e) {
    BOOST_TEST(std::string(e.what()).find("there are:") != std::string::npos);
    BOOST_TEST((e.kind() == ErrorKind::device));
  }
}

BOOST_AUTO_TEST_CASE(memory_limit_is_honoured_before_allocation) {
  Device device("", 1 << 20);
  opencl::DeviceArray<float> fits(device.state(), 1 << 17, "half");
  BOOST_CHECK_THROW(opencl::DeviceArray<float>(device.state(), 1 << 18, "too much"), ResourceError);
  BOOST_TEST(device.memory_left() == (1u << 19));
}

BOOST_AUTO_TEST_CASE(array_round_trip_keeps_bits) {
  Device device;
  const std::vector<float> values{1.5f, -0.0f, 3e-42f};
  const opencl::DeviceArray<float> array(device.state(), std::span<const float>(values), "values");
  BOOST_TEST(array.to_host() == values);
}
