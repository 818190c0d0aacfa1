// What devices there are, and what they say of themselves. A platform or a device that fails a call is listed
// with its trouble, and ends nobody's work. Called by device.cpp.
#pragma once

#include <string>
#include <vector>

#include "host/opencl/cl.hpp"
#include "vdvr/device.hpp"

namespace vdvr::opencl {

struct FoundDevice {
  cl::Device device;
  DeviceInfo info;
  std::string trouble;  // a call that failed; empty where none did
};

/// All devices of all platforms, in a stable order: places are `--device` numbers, so that whoever cannot be
/// used keeps one. A platform whose devices cannot be asked for has one place, with its trouble.
std::vector<FoundDevice> find_devices();

/// Fills in which 3D images can be read with the linear filter. Opens a context of its own. What fails is
/// trouble.
void ask_image_formats(FoundDevice& found);

}  // namespace vdvr::opencl
