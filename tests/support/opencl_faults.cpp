// A layer between the program and the OpenCL loader, put there with LD_PRELOAD, that fails any call of any
// function, or makes arithmetic wrong. Used by tests/program/each_call_test.cpp and
// tests/program/trust_test.cpp.
//   VDVR_FAULTS_FAIL=clFunction:N   the N-th call of that function fails
//   VDVR_FAULTS_LOST=1              and every call of any function after it, as where a device is lost
//   VDVR_FAULTS_COUNT=FILE          writes how often each function was called, at exit: clFunction N
//   VDVR_FAULTS_OPTIONS=TEXT        more options for every program
//   VDVR_FAULTS_REPLACE=OLD=>NEW    that text in every program's source; several, one a line
#include <CL/cl.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/next_function.hpp"

namespace {

constexpr cl_int failure = CL_OUT_OF_RESOURCES;

std::string setting(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? "" : text;
}

// Never destroyed: calls may come as late as the program's statics end.
struct Calls {
  std::mutex lock;
  std::map<std::string, unsigned long> made;
  bool lost = false;
};
Calls& calls() {
  static auto* one = new Calls;
  return *one;
}

void write_counts() {
  std::FILE* file = std::fopen(setting("VDVR_FAULTS_COUNT").c_str(), "w");
  if (file == nullptr) return;
  const std::lock_guard guard(calls().lock);
  for (const auto& [name, count] : calls().made) std::fprintf(file, "%s %lu\n", name.c_str(), count);
  std::fclose(file);
}

bool fails(const char* name) {
  static const std::string wanted = setting("VDVR_FAULTS_FAIL");
  static const bool counted = !setting("VDVR_FAULTS_COUNT").empty() && std::atexit(write_counts) == 0;
  static const bool all_after = !setting("VDVR_FAULTS_LOST").empty();
  static_cast<void>(counted);
  const std::lock_guard guard(calls().lock);
  const unsigned long number = ++calls().made[name];
  const bool here = wanted == std::string(name) + ":" + std::to_string(number);
  calls().lost = calls().lost || (here && all_after);
  return here || calls().lost;
}

std::string replaced(std::string text) {
  const std::string wanted = setting("VDVR_FAULTS_REPLACE");
  for (std::size_t from = 0; from < wanted.size();) {
    const std::size_t end = std::min(wanted.find('\n', from), wanted.size());
    const std::string line = wanted.substr(from, end - from);
    const std::size_t arrow = line.find("=>");
    if (arrow != std::string::npos) {
      const std::string old = line.substr(0, arrow), now = line.substr(arrow + 2);
      for (std::size_t at = 0; (at = text.find(old, at)) != std::string::npos; at += now.size())
        text.replace(at, old.size(), now);
    }
    from = end + 1;
  }
  return text;
}

}  // namespace

// A function that returns its code, and one that returns a handle and has its code as the last argument.
#define CODE(NAME, PARAMETERS, ARGUMENTS)                    \
  cl_int NAME PARAMETERS {                                   \
    static const auto real = next<decltype(&(NAME))>(#NAME); \
    return fails(#NAME) ? failure : real ARGUMENTS;          \
  }
#define HANDLE(TYPE, NAME, PARAMETERS, ARGUMENTS)            \
  TYPE NAME PARAMETERS {                                     \
    static const auto real = next<decltype(&(NAME))>(#NAME); \
    if (!fails(#NAME)) return real ARGUMENTS;                \
    if (error != nullptr) *error = failure;                  \
    return nullptr;                                          \
  }
#define WAITS cl_uint waits, const cl_event *wait, cl_event *event

extern "C" {

CODE(clGetPlatformIDs, (cl_uint n, cl_platform_id* out, cl_uint* count), (n, out, count))
CODE(clGetPlatformInfo, (cl_platform_id p, cl_platform_info what, size_t size, void* value, size_t* needed),
     (p, what, size, value, needed))
CODE(clGetDeviceIDs, (cl_platform_id p, cl_device_type type, cl_uint n, cl_device_id* out, cl_uint* count),
     (p, type, n, out, count))
CODE(clGetDeviceInfo, (cl_device_id d, cl_device_info what, size_t size, void* value, size_t* needed),
     (d, what, size, value, needed))
CODE(clGetKernelInfo, (cl_kernel k, cl_kernel_info what, size_t size, void* value, size_t* needed),
     (k, what, size, value, needed))
CODE(clGetKernelWorkGroupInfo,
     (cl_kernel k, cl_device_id d, cl_kernel_work_group_info what, size_t size, void* value, size_t* needed),
     (k, d, what, size, value, needed))
CODE(clGetProgramInfo, (cl_program p, cl_program_info what, size_t size, void* value, size_t* needed),
     (p, what, size, value, needed))
CODE(clGetProgramBuildInfo,
     (cl_program p, cl_device_id d, cl_program_build_info what, size_t size, void* value, size_t* needed),
     (p, d, what, size, value, needed))
CODE(clGetEventProfilingInfo, (cl_event e, cl_profiling_info what, size_t size, void* value, size_t* needed),
     (e, what, size, value, needed))
CODE(clGetSupportedImageFormats,
     (cl_context c, cl_mem_flags flags, cl_mem_object_type type, cl_uint n, cl_image_format* out,
      cl_uint* count),
     (c, flags, type, n, out, count))
CODE(clRetainContext, (cl_context c), (c))
CODE(clRetainDevice, (cl_device_id d), (d))
CODE(clRetainMemObject, (cl_mem m), (m))
CODE(clReleaseCommandQueue, (cl_command_queue q), (q))
CODE(clReleaseContext, (cl_context c), (c))
CODE(clReleaseDevice, (cl_device_id d), (d))
CODE(clReleaseEvent, (cl_event e), (e))
CODE(clReleaseKernel, (cl_kernel k), (k))
CODE(clReleaseMemObject, (cl_mem m), (m))
CODE(clReleaseProgram, (cl_program p), (p))
CODE(clSetKernelArg, (cl_kernel k, cl_uint index, size_t size, const void* value), (k, index, size, value))
CODE(clWaitForEvents, (cl_uint n, const cl_event* events), (n, events))
CODE(clFinish, (cl_command_queue q), (q))
CODE(clEnqueueNDRangeKernel,
     (cl_command_queue q, cl_kernel k, cl_uint dimensions, const size_t* offset, const size_t* global,
      const size_t* local, WAITS),
     (q, k, dimensions, offset, global, local, waits, wait, event))
CODE(clEnqueueReadBuffer, (cl_command_queue q, cl_mem m, cl_bool blocks, size_t at, size_t n, void* p, WAITS),
     (q, m, blocks, at, n, p, waits, wait, event))
CODE(clEnqueueWriteBuffer,
     (cl_command_queue q, cl_mem m, cl_bool blocks, size_t at, size_t n, const void* p, WAITS),
     (q, m, blocks, at, n, p, waits, wait, event))
CODE(clEnqueueFillBuffer,
     (cl_command_queue q, cl_mem m, const void* pattern, size_t size, size_t at, size_t n, WAITS),
     (q, m, pattern, size, at, n, waits, wait, event))
CODE(clEnqueueFillImage,
     (cl_command_queue q, cl_mem m, const void* colour, const size_t* at, const size_t* n, WAITS),
     (q, m, colour, at, n, waits, wait, event))
CODE(clEnqueueCopyBufferToImage,
     (cl_command_queue q, cl_mem from, cl_mem to, size_t first, const size_t* at, const size_t* n, WAITS),
     (q, from, to, first, at, n, waits, wait, event))
CODE(clEnqueueUnmapMemObject, (cl_command_queue q, cl_mem m, void* p, WAITS), (q, m, p, waits, wait, event))
HANDLE(void*, clEnqueueMapBuffer,
       (cl_command_queue q, cl_mem m, cl_bool blocks, cl_map_flags flags, size_t at, size_t n, WAITS,
        cl_int* error),
       (q, m, blocks, flags, at, n, waits, wait, event, error))
HANDLE(cl_context, clCreateContext,
       (const cl_context_properties* properties, cl_uint n, const cl_device_id* devices,
        void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* user, cl_int* error),
       (properties, n, devices, notify, user, error))
HANDLE(cl_command_queue, clCreateCommandQueue,
       (cl_context c, cl_device_id d, cl_command_queue_properties properties, cl_int* error),
       (c, d, properties, error))
HANDLE(cl_mem, clCreateBuffer, (cl_context c, cl_mem_flags flags, size_t size, void* host, cl_int* error),
       (c, flags, size, host, error))
HANDLE(cl_mem, clCreateImage,
       (cl_context c, cl_mem_flags flags, const cl_image_format* format, const cl_image_desc* shape,
        void* host, cl_int* error),
       (c, flags, format, shape, host, error))
HANDLE(cl_kernel, clCreateKernel, (cl_program p, const char* name, cl_int* error), (p, name, error))
HANDLE(cl_program, clCreateProgramWithBinary,
       (cl_context c, cl_uint n, const cl_device_id* devices, const size_t* sizes,
        const unsigned char** binaries, cl_int* status, cl_int* error),
       (c, n, devices, sizes, binaries, status, error))

cl_program clCreateProgramWithSource(cl_context c, cl_uint n, const char** texts, const size_t* sizes,
                                     cl_int* error) {
  static const auto real = next<decltype(&clCreateProgramWithSource)>("clCreateProgramWithSource");
  if (fails("clCreateProgramWithSource")) {
    if (error != nullptr) *error = failure;
    return nullptr;
  }
  std::string all;
  for (cl_uint i = 0; i < n; ++i)
    all += sizes != nullptr && sizes[i] != 0 ? std::string(texts[i], sizes[i]) : std::string(texts[i]);
  all = replaced(all);
  const char* text = all.c_str();
  return real(c, 1, &text, nullptr, error);
}

cl_int clBuildProgram(cl_program p, cl_uint n, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* done)(cl_program, void*), void* user) {
  static const auto real = next<decltype(&clBuildProgram)>("clBuildProgram");
  if (fails("clBuildProgram")) return failure;
  const std::string all =
      std::string(options == nullptr ? "" : options) + " " + setting("VDVR_FAULTS_OPTIONS");
  return real(p, n, devices, all.c_str(), done, user);
}

}  // extern "C"
