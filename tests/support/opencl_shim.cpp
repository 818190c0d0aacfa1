// A layer between the program and the OpenCL loader, put there with LD_PRELOAD: lowers the limits that
// devices report, refuses what lies beyond them, and fails chosen calls. Only for
// tests/program/faults_test.cpp.
//   VDVR_SHIM_MAX_ALLOC, VDVR_SHIM_GLOBAL_MEM   bytes
//   VDVR_SHIM_IMAGES=0, VDVR_SHIM_IMAGE3D=N     no images; largest extent of a 3D image
//   VDVR_SHIM_BUFFER_FAILS=N                    the N-th buffer and all after it are refused
//   VDVR_SHIM_LAUNCH_FAILS=N                    from the N-th kernel launch on the device is lost
//   VDVR_SHIM_BREAK_BUILD=1                     kernels are compiled with a define that breaks them
#include <CL/cl.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/support/next_function.hpp"

namespace {

// 0: not set.
cl_ulong setting(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

template <typename T>
void lower(void* value, size_t size, T limit) {
  if (value == nullptr || size < sizeof(T) || limit == 0) return;
  T now;
  std::memcpy(&now, value, sizeof now);
  now = std::min(now, limit);
  std::memcpy(value, &now, sizeof now);
}

bool refused(size_t bytes) {
  static std::atomic<cl_ulong> made{0};
  const cl_ulong last = setting("VDVR_SHIM_BUFFER_FAILS"), most = setting("VDVR_SHIM_MAX_ALLOC");
  return (last != 0 && ++made >= last) || (most != 0 && bytes > most);
}

}  // namespace

extern "C" {

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void* value, size_t* needed) {
  static const auto real = next<decltype(&clGetDeviceInfo)>("clGetDeviceInfo");
  const cl_int rc = real(device, what, size, value, needed);
  if (rc != CL_SUCCESS) return rc;
  const char* images = std::getenv("VDVR_SHIM_IMAGES");
  switch (what) {
    case CL_DEVICE_MAX_MEM_ALLOC_SIZE:
      lower<cl_ulong>(value, size, setting("VDVR_SHIM_MAX_ALLOC"));
      break;
    case CL_DEVICE_GLOBAL_MEM_SIZE:
      lower<cl_ulong>(value, size, setting("VDVR_SHIM_GLOBAL_MEM"));
      break;
    case CL_DEVICE_IMAGE3D_MAX_WIDTH:
    case CL_DEVICE_IMAGE3D_MAX_HEIGHT:
    case CL_DEVICE_IMAGE3D_MAX_DEPTH:
      lower<size_t>(value, size, setting("VDVR_SHIM_IMAGE3D"));
      break;
    case CL_DEVICE_IMAGE_SUPPORT:
      if (images != nullptr && images[0] == '0' && value != nullptr) std::memset(value, 0, sizeof(cl_bool));
      break;
    default:
      break;
  }
  return rc;
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  static const auto real = next<decltype(&clCreateBuffer)>("clCreateBuffer");
  if (!refused(size)) return real(context, flags, size, host, error);
  if (error != nullptr) *error = CL_MEM_OBJECT_ALLOCATION_FAILURE;
  return nullptr;
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t* offset, const size_t* global, const size_t* local, cl_uint waits,
                              const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
  static std::atomic<cl_ulong> launched{0};
  const cl_ulong last = setting("VDVR_SHIM_LAUNCH_FAILS");
  if (last != 0 && ++launched >= last) return CL_OUT_OF_RESOURCES;
  return real(queue, kernel, dimensions, offset, global, local, waits, wait, event);
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* done)(cl_program, void*), void* user) {
  static const auto real = next<decltype(&clBuildProgram)>("clBuildProgram");
  std::string all = options == nullptr ? "" : options;
  if (std::getenv("VDVR_SHIM_BREAK_BUILD") != nullptr) all += " -Dget_global_id=no_such_function";
  return real(program, count, devices, all.c_str(), done, user);
}

}  // extern "C"
