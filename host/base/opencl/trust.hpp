// Whether a device computes as certificates assume: asked when it is opened (docs/robustness.md).
#pragma once

#include <string>

#include "host/base/opencl/state.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr::opencl {

/// All that a device's answers can depend on, and that we know of: platform, device, driver, version of the
/// program and the text of the test's kernels, by lines.
std::string identity(const State& state);

/// Runs the test, or remembers that this device passed it: by its identity, in a file of the cache folder
/// (host/base/system/cache_files.hpp).
/// Only devices that pass are remembered. Throws as a launch does where the device cannot run it at all.
DeviceTest test_device(State& state);

/// Runs the test.
DeviceTest ask_device(State& state);

/// Until the device ends.
void keep_test(const State& state, DeviceTest test);
bool untrusted_are_opened();
/// To whoever listens (tell_of_devices).
void tell(const std::string& line);

/// Throws DeviceError, which names what failed, where the device did not pass its test.
void require_trusted(const State& state, const std::string& what);

}  // namespace vdvr::opencl
