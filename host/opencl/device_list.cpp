#include "host/opencl/device_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "host/opencl/state.hpp"
#include "vdvr/devices.hpp"

namespace vdvr::opencl {
namespace {

std::string trimmed(std::string s) {
  while (!s.empty() && (s.back() == '\0' || std::isspace(static_cast<unsigned char>(s.back())))) s.pop_back();
  return s;
}

std::string trouble_of(const cl::Error& e) { return fmt::format("{}: {}", e.what(), code_name(e.err())); }

// What is known before a call fails stays.
void describe(const cl::Device& device, DeviceInfo& d) {
  d.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  d.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  d.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  d.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
  d.is_gpu = (type & CL_DEVICE_TYPE_GPU) != 0;
  d.is_cpu = (type & CL_DEVICE_TYPE_CPU) != 0;
  d.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  d.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  d.local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  d.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  d.max_work_group = static_cast<std::uint32_t>(device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>());
  d.subnormals = (device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_DENORM) != 0;
  d.images = device.getInfo<CL_DEVICE_IMAGE_SUPPORT>() == CL_TRUE;
  if (d.images) {
    d.image3d_max[0] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_WIDTH>();
    d.image3d_max[1] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_HEIGHT>();
    d.image3d_max[2] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_DEPTH>();
  }
}

std::vector<cl::Device> devices_of(const cl::Platform& platform) {
  std::vector<cl::Device> devices;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
  } catch (const cl::Error& e) {
    if (e.err() != CL_DEVICE_NOT_FOUND) throw;
  }
  return devices;
}

}  // namespace

std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return found;  // the loader reports "no platform" as an error
  }
  for (const auto& platform : platforms) {
    DeviceInfo info;
    info.index = static_cast<int>(found.size());
    std::vector<cl::Device> devices;
    try {
      info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
      devices = devices_of(platform);
    } catch (const cl::Error& e) {
      info.name = "a platform without devices";
      found.push_back({{}, info, trouble_of(e)});
      continue;
    }
    for (const auto& device : devices) {
      FoundDevice one{device, info, ""};
      DeviceInfo& d = one.info;
      d.index = static_cast<int>(found.size());
      try {
        if (device.getInfo<CL_DEVICE_AVAILABLE>() != CL_TRUE) continue;
        describe(device, d);
      } catch (const cl::Error& e) {
        one.trouble = trouble_of(e);
        if (d.name.empty()) d.name = "a device without a name";
      }
      found.push_back(std::move(one));
    }
  }
  return found;
}

void ask_image_formats(FoundDevice& found) {
  DeviceInfo& d = found.info;
  if (!d.images || !found.trouble.empty()) return;
  try {
    const cl::Context context(found.device);
    std::vector<cl::ImageFormat> formats;
    context.getSupportedImageFormats(CL_MEM_READ_ONLY, CL_MEM_OBJECT_IMAGE3D, &formats);
    const auto has = [&](cl_channel_type type) {
      return std::any_of(formats.begin(), formats.end(), [&](const cl::ImageFormat& f) {
        return f.image_channel_order == CL_R && f.image_channel_data_type == type;
      });
    };
    d.linear_float_image = has(CL_FLOAT);
    d.linear_u16_image = has(CL_UNORM_INT16);
    d.linear_u8_image = has(CL_UNORM_INT8);
  } catch (const cl::Error& e) {
    found.trouble = trouble_of(e);
  }
}

}  // namespace vdvr::opencl

namespace vdvr {

std::vector<ListedDevice> describe_devices() {
  std::vector<ListedDevice> listed;
  for (opencl::FoundDevice& found : opencl::find_devices()) {
    opencl::ask_image_formats(found);
    listed.push_back({found.info, found.trouble});
  }
  return listed;
}

}  // namespace vdvr
