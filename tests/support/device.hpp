// The one device of a test program.
#pragma once

#include <boost/test/unit_test.hpp>
#include <optional>

#include "vdvr/device.hpp"

namespace vdvr::support {

/// Opened by the first test that asks. Given back while main still runs: a destructor of a static would run
/// after those of thread-local objects, which an OpenCL implementation may still need (Oclgrind does).
class SharedDevice {
 public:
  static Device& get() {
    if (!opened()) opened().emplace();
    return *opened();
  }
  ~SharedDevice() { opened().reset(); }

 private:
  static std::optional<Device>& opened() {
    static std::optional<Device> device;
    return device;
  }
};

inline Device& device() { return SharedDevice::get(); }

BOOST_GLOBAL_FIXTURE(SharedDevice);

}  // namespace vdvr::support
