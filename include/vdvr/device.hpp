// Choice of an OpenCL device. No OpenCL type is visible here; host/base/opencl holds them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "vdvr/api.hpp"

namespace vdvr {

namespace opencl {
struct State;  // host/base/opencl/state.hpp
}

struct DeviceInfo {
  int index = 0;  ///< what `--device INDEX` takes
  std::string platform, name, vendor, version, driver;
  bool is_gpu = false, is_cpu = false;
  bool subnormals = false;          ///< float32 below 2^-126 is not flushed to 0
  bool images = false;              ///< 3D images at all
  bool linear_float_image = false;  ///< CL_R / CL_FLOAT 3D image readable with the linear filter
  bool linear_u16_image = false;    ///< the same for CL_R / CL_UNORM_INT16
  bool linear_u8_image = false;     ///< the same for CL_R / CL_UNORM_INT8
  std::uint64_t global_memory = 0, max_allocation = 0, local_memory = 0;
  std::uint32_t compute_units = 0, max_work_group = 0;
  std::uint64_t image3d_max[3] = {0, 0, 0};
};

/// One device, its context, its in-order queue and its program cache. Move-only; create one per run.
class VDVR_API Device {
 public:
  /// All devices of all platforms, in a stable order. Empty where no OpenCL platform is installed.
  static std::vector<DeviceInfo> list();

  /// `selector`: "" (a GPU if there is one, else the first device), "cpu", "gpu", an index of list(), or part
  /// of a name. `max_memory_bytes` limits our host and device allocations together, of a card each of
  /// both; 0: no limit but the device's, of a card 90 % of its memory. Throws DeviceError when nothing
  /// matches, listing what exists.
  explicit Device(const std::string& selector = "", std::uint64_t max_memory_bytes = 0);
  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const DeviceInfo& info() const;
  /// Bytes that may still be allocated under --max-memory and the device's own limit.
  [[nodiscard]] std::uint64_t memory_left() const;
  /// The largest sum of our allocations so far, host and device.
  [[nodiscard]] std::uint64_t peak_memory() const;

  opencl::State& state() { return *state_; }

 private:
  std::shared_ptr<opencl::State> state_;
};

}  // namespace vdvr
