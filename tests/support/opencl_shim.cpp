// A layer between the program and the OpenCL loader, put there with LD_PRELOAD: makes a device pass for
// another, refuses what lies beyond that one's limits, and fails chosen calls. Used by
// tests/program/faults_test.cpp, tests/program/any_device_test.cpp and the tests named ..._as_gpu. Numbers
// are decimal; what is not set, or 0 where that has no meaning below, is as the device has it.
//
// Another device. Each of these is also added to the driver's version, so that nothing is taken for, or kept
// for, the device below:
//   VDVR_SHIM_GPU=1               a GPU, whose memory is not the host's, and whose compiler takes what
//                                 OpenCL C has and no more
//   VDVR_SHIM_WORK_GROUP=N        work-items of a group: launches of larger groups are refused
//   VDVR_SHIM_COMPUTE_UNITS=N     any number
//   VDVR_SHIM_LOCAL_MEM=N         bytes of local memory, at most what there is
//   VDVR_SHIM_FP64=0              no double precision: programs with its types or constants do not build
//   VDVR_SHIM_DENORMALS=0         subnormal results are 0
//   VDVR_SHIM_IMAGES=0            no images
//   VDVR_SHIM_FILTER_BITS=N       read_imagef filters by weights of N bits, as texture units have (N = 8)
//   VDVR_SHIM_FILTER_CUT=1        these are cut, not rounded, to so many bits
//   VDVR_SHIM_FILTER_PRODUCTS=1   weights of corners are rounded to so many bits too, as those of NVIDIA's
//   units VDVR_SHIM_FILTER_U8=1         of 8-bit images each lerp is rounded to 8 bits too
//   VDVR_SHIM_BUILD_OPTIONS=TEXT  more options for every program
// What is built:
//   VDVR_SHIM_PROGRAMS=DIR        every program, as NAME.cl and its options as NAME.opt (scripts/offline-gpu)
// What is called:
//   VDVR_SHIM_CALLS=FILE          at the end, added to it: launches, writes that block, buffers
// Limits and faults:
//   VDVR_SHIM_MAX_ALLOC, VDVR_SHIM_GLOBAL_MEM   bytes
//   VDVR_SHIM_IMAGE3D=N                         largest extent of a 3D image
//   VDVR_SHIM_BUFFER_FAILS=N                    the N-th buffer and all after it are refused
//   VDVR_SHIM_LAUNCH_FAILS=N                    from the N-th kernel launch on the device is lost
//   VDVR_SHIM_BREAK_BUILD=1                     kernels are compiled with a define that breaks them
#include <CL/cl.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>

#include "tests/support/next_function.hpp"

namespace {

constexpr const char* character[] = {
    "VDVR_SHIM_GPU",        "VDVR_SHIM_WORK_GROUP", "VDVR_SHIM_COMPUTE_UNITS",   "VDVR_SHIM_LOCAL_MEM",
    "VDVR_SHIM_FP64",       "VDVR_SHIM_DENORMALS",  "VDVR_SHIM_IMAGES",          "VDVR_SHIM_FILTER_BITS",
    "VDVR_SHIM_FILTER_CUT", "VDVR_SHIM_FILTER_U8",  "VDVR_SHIM_FILTER_PRODUCTS", "VDVR_SHIM_BUILD_OPTIONS"};

// 0: not set.
cl_ulong setting(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

// Set to 0: the device is to lack it.
bool lacks(const char* name) {
  const char* text = std::getenv(name);
  return text != nullptr && std::strcmp(text, "0") == 0;
}

// --- what a device reports ---

template <typename T>
void put(void* value, size_t size, T answer) {
  if (value != nullptr && size >= sizeof(T)) std::memcpy(value, &answer, sizeof answer);
}

template <typename T>
void lower(void* value, size_t size, T limit, size_t count = 1) {
  if (value == nullptr || size < count * sizeof(T) || limit == 0) return;
  for (size_t i = 0; i < count; ++i) {
    T now;
    char* at = static_cast<char*>(value) + i * sizeof now;
    std::memcpy(&now, at, sizeof now);
    now = std::min(now, limit);
    std::memcpy(at, &now, sizeof now);
  }
}

cl_int real_info(cl_device_id device, cl_device_info what, size_t size, void* value, size_t* needed) {
  static const auto real = next<decltype(&clGetDeviceInfo)>("clGetDeviceInfo");
  return real(device, what, size, value, needed);
}

std::string real_text(cl_device_id device, cl_device_info what) {
  size_t size = 0;
  if (real_info(device, what, 0, nullptr, &size) != CL_SUCCESS || size == 0) return {};
  std::string text(size, '\0');
  if (real_info(device, what, size, text.data(), nullptr) != CL_SUCCESS) return {};
  text.resize(size - 1);
  return text;
}

cl_int put_text(const std::string& text, size_t size, void* value, size_t* needed) {
  if (needed != nullptr) *needed = text.size() + 1;
  if (value == nullptr) return CL_SUCCESS;
  if (size < text.size() + 1) return CL_INVALID_VALUE;
  std::memcpy(value, text.c_str(), text.size() + 1);
  return CL_SUCCESS;
}

std::string driver_version(cl_device_id device) {
  std::string text = real_text(device, CL_DRIVER_VERSION);
  for (const char* name : character)
    if (const char* value = std::getenv(name))
      text += std::string(" ") + (name + std::strlen("VDVR_SHIM_")) + "=" + value;
  return text;
}

std::string extensions(cl_device_id device) {
  std::string text = real_text(device, CL_DEVICE_EXTENSIONS);
  const std::string fp64 = "cl_khr_fp64";
  if (const auto at = text.find(fp64); lacks("VDVR_SHIM_FP64") && at != std::string::npos)
    text.erase(at, fp64.size());
  return text;
}

// --- programs ---

// The constants of double precision in `source`, each as an argument of NO_FP64, where it stands.
std::string with_marked_constants(const std::string& source) {
  const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::string out;
  for (size_t i = 0; i < source.size();) {
    size_t end = i;
    const bool number = is_digit(source[i]) || (source[i] == '.' && is_digit(source[i + 1]));
    if (!number) {
      do ++end;
      while (is_word(source[i]) && end < source.size() && is_word(source[end]));
      out.append(source, i, end - i);
      i = end;
      continue;
    }
    while (end < source.size() &&
           (is_word(source[end]) || source[end] == '.' ||
            ((source[end] == '+' || source[end] == '-') && std::strchr("eEpP", source[end - 1]) != nullptr)))
      ++end;
    const std::string word = source.substr(i, end - i);
    const bool hex = word.rfind("0x", 0) == 0;
    const bool floating = word.find_first_of(hex ? ".p" : ".eE") != std::string::npos;
    const bool suffixed = std::strchr("fFhH", word.back()) != nullptr;
    out += floating && !suffixed ? "NO_FP64(" + word + ")" : word;
    i = end;
  }
  return out;
}

// Compilers for devices without double precision warn of its constants and take them as single: an error in
// the programs of this project, and clFFT's live with it.
constexpr const char* without_fp64 = R"(
#undef cl_khr_fp64
#define double no_double_precision_here
#define double2 no_double_precision_here
#define double4 no_double_precision_here
#define double8 no_double_precision_here
#define double16 no_double_precision_here
#ifdef VDVR_DIALECT_OPENCL
#define NO_FP64(x) constant_of_double_precision
#else
#define NO_FP64(x) x##f
#endif
)";

// A texture unit: coordinates in 2^-FILTER_BITS texels, then lerps by these weights, exact or with products
// that have as many bits.
constexpr const char* texture_unit = R"(
#ifdef __IMAGE_SUPPORT__
float shim_lerp(float a, float b, float t, bool rounds) {
  const float v = a + t * (b - a);
  return rounds ? rint(v * 255.0f) / 255.0f : v;
}
float4 __attribute__((overloadable)) shim_read(__read_only image3d_t image, int4 at) {
  const sampler_t nearest = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_NEAREST;
  return read_imagef(image, nearest, at);
}
float shim_product(float a, float b) {
  const float unit = (float)(1 << FILTER_BITS), p = a * b;
  return rint(p * unit) / unit;
}
float shim_by_weights(__read_only image3d_t image, int4 first, float4 t) {
  float sum = 0.0f;
  for (int i = 0; i < 4; ++i) {
    const float both = shim_product(t.x, t.y);
    const float side = i == 3 ? both : i == 1 ? t.x - both : i == 2 ? t.y - both : 1.0f - t.x - t.y + both;
    const float far = shim_product(side, t.z);
    const int4 low = first + (int4)(i & 1, i >> 1, 0, 0);
    sum += (side - far) * shim_read(image, low).x + far * shim_read(image, low + (int4)(0, 0, 1, 0)).x;
  }
  return sum;
}
float4 __attribute__((overloadable)) shim_read(__read_only image3d_t image, float4 at) {
  const float unit = (float)(1 << FILTER_BITS);
  const int4 place = convert_int4(FILTER_TO_BITS((at - 0.5f) * unit)), first = place >> FILTER_BITS;
  const float4 t = convert_float4(place & ((1 << FILTER_BITS) - 1)) / unit;
  if (FILTER_PRODUCTS) return (float4)(shim_by_weights(image, first, t), 0.0f, 0.0f, 1.0f);
  const bool rounds = FILTER_U8 && get_image_channel_data_type(image) == CLK_UNORM_INT8;
  float along_x[4];
  for (int i = 0; i < 4; ++i) {
    const int4 low = first + (int4)(0, i & 1, i >> 1, 0);
    const float before = shim_read(image, low).x, after = shim_read(image, low + (int4)(1, 0, 0, 0)).x;
    along_x[i] = shim_lerp(before, after, t.x, rounds);
  }
  const float near = shim_lerp(along_x[0], along_x[1], t.y, rounds),
              far = shim_lerp(along_x[2], along_x[3], t.y, rounds);
  return (float4)(shim_lerp(near, far, t.z, rounds), 0.0f, 0.0f, 1.0f);
}
#undef read_imagef
#define read_imagef(image, sampler, at) shim_read(image, at)
#endif
)";

// What NVIDIA's compiler refuses, as the standard does, and PoCL's warns of or takes. `#line`: messages name
// lines of the source itself.
constexpr const char* as_the_standard_has_it = R"(
#pragma clang diagnostic error "-Wincompatible-pointer-types"
#pragma clang diagnostic error "-Wincompatible-pointer-types-discards-qualifiers"
#line 1
)";

std::string joined(cl_uint count, const char** texts, const size_t* lengths) {
  std::string source;
  for (cl_uint i = 0; i < count; ++i)
    source +=
        lengths != nullptr && lengths[i] != 0 ? std::string(texts[i], lengths[i]) : std::string(texts[i]);
  return source;
}

std::string as_the_device_compiles(std::string source) {
  const cl_ulong bits = setting("VDVR_SHIM_FILTER_BITS");
  if (setting("VDVR_SHIM_GPU") != 0) source = as_the_standard_has_it + source;
  if (lacks("VDVR_SHIM_FP64")) source = without_fp64 + with_marked_constants(source);
  if (bits != 0 && source.find("read_imagef") != std::string::npos)
    source = "#define FILTER_BITS " + std::to_string(bits) + "\n#define FILTER_TO_BITS " +
             (setting("VDVR_SHIM_FILTER_CUT") != 0 ? "floor" : "rint") + "\n#define FILTER_U8 " +
             std::to_string(setting("VDVR_SHIM_FILTER_U8")) + "\n#define FILTER_PRODUCTS " +
             std::to_string(setting("VDVR_SHIM_FILTER_PRODUCTS")) + texture_unit + source;
  return source;
}

// --- what is built ---

void write_down(cl_program program, const char* options) {
  const char* folder = std::getenv("VDVR_SHIM_PROGRAMS");
  size_t size = 0;
  if (folder == nullptr || clGetProgramInfo(program, CL_PROGRAM_SOURCE, 0, nullptr, &size) != CL_SUCCESS ||
      size <= 1)
    return;
  std::string source(size, '\0');
  if (clGetProgramInfo(program, CL_PROGRAM_SOURCE, size, source.data(), nullptr) != CL_SUCCESS) return;
  source.pop_back();
  const std::string all = options == nullptr ? "" : options;
  const std::string name = std::string(folder) + "/" + std::to_string(std::hash<std::string>{}(source + all));
  std::ofstream(name + ".cl") << source;
  std::ofstream(name + ".opt") << all;
}

// --- what is called ---

struct Calls {
  std::atomic<cl_ulong> launches{0}, blocking_writes{0}, buffers{0};
  ~Calls() {
    if (const char* file = std::getenv("VDVR_SHIM_CALLS"))
      std::ofstream(file, std::ios::app) << launches << ' ' << blocking_writes << ' ' << buffers << '\n';
  }
} calls;

// --- what is refused ---

bool refused(size_t bytes) {
  static std::atomic<cl_ulong> made{0};
  const cl_ulong last = setting("VDVR_SHIM_BUFFER_FAILS"), most = setting("VDVR_SHIM_MAX_ALLOC");
  return (last != 0 && ++made >= last) || (most != 0 && bytes > most);
}

}  // namespace

extern "C" {

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void* value, size_t* needed) {
  if (what == CL_DRIVER_VERSION) return put_text(driver_version(device), size, value, needed);
  if (what == CL_DEVICE_EXTENSIONS) return put_text(extensions(device), size, value, needed);
  const cl_int rc = real_info(device, what, size, value, needed);
  if (rc != CL_SUCCESS || value == nullptr) return rc;
  const size_t group = setting("VDVR_SHIM_WORK_GROUP");
  const cl_ulong gpu = setting("VDVR_SHIM_GPU"), units = setting("VDVR_SHIM_COMPUTE_UNITS");
  switch (what) {
    case CL_DEVICE_TYPE:
      if (gpu != 0) put<cl_device_type>(value, size, CL_DEVICE_TYPE_GPU);
      break;
    case CL_DEVICE_HOST_UNIFIED_MEMORY:
      if (gpu != 0) put<cl_bool>(value, size, CL_FALSE);
      break;
    case CL_DEVICE_MAX_COMPUTE_UNITS:
      if (units != 0) put(value, size, static_cast<cl_uint>(units));
      break;
    case CL_DEVICE_MAX_WORK_GROUP_SIZE:
      lower<size_t>(value, size, group);
      break;
    case CL_DEVICE_MAX_WORK_ITEM_SIZES:
      lower<size_t>(value, size, group, 3);
      break;
    case CL_DEVICE_LOCAL_MEM_SIZE:
      lower<cl_ulong>(value, size, setting("VDVR_SHIM_LOCAL_MEM"));
      break;
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
      if (lacks("VDVR_SHIM_IMAGES")) put<cl_bool>(value, size, CL_FALSE);
      break;
    case CL_DEVICE_DOUBLE_FP_CONFIG:
      if (lacks("VDVR_SHIM_FP64")) put<cl_device_fp_config>(value, size, 0);
      break;
    case CL_DEVICE_SINGLE_FP_CONFIG:
      if (cl_device_fp_config config = 0; lacks("VDVR_SHIM_DENORMALS") && size >= sizeof config) {
        std::memcpy(&config, value, sizeof config);
        put(value, size, config & ~static_cast<cl_device_fp_config>(CL_FP_DENORM));
      }
      break;
    default:
      break;
  }
  return rc;
}

cl_int clGetKernelWorkGroupInfo(cl_kernel kernel, cl_device_id device, cl_kernel_work_group_info what,
                                size_t size, void* value, size_t* needed) {
  static const auto real = next<decltype(&clGetKernelWorkGroupInfo)>("clGetKernelWorkGroupInfo");
  const cl_int rc = real(kernel, device, what, size, value, needed);
  if (rc == CL_SUCCESS && what == CL_KERNEL_WORK_GROUP_SIZE)
    lower<size_t>(value, size, setting("VDVR_SHIM_WORK_GROUP"));
  return rc;
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  static const auto real = next<decltype(&clCreateBuffer)>("clCreateBuffer");
  ++calls.buffers;
  if (!refused(size)) return real(context, flags, size, host, error);
  if (error != nullptr) *error = CL_MEM_OBJECT_ALLOCATION_FAILURE;
  return nullptr;
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t* offset, const size_t* global, const size_t* local, cl_uint waits,
                              const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
  ++calls.launches;
  static std::atomic<cl_ulong> launched{0};
  const cl_ulong last = setting("VDVR_SHIM_LAUNCH_FAILS"), most = setting("VDVR_SHIM_WORK_GROUP");
  if (last != 0 && ++launched >= last) return CL_OUT_OF_RESOURCES;
  size_t items = 1;
  for (cl_uint i = 0; local != nullptr && i < dimensions; ++i) items *= local[i];
  if (most != 0 && items > most) return CL_INVALID_WORK_GROUP_SIZE;
  return real(queue, kernel, dimensions, offset, global, local, waits, wait, event);
}

cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset,
                            size_t size, const void* from, cl_uint waits, const cl_event* wait,
                            cl_event* event) {
  static const auto real = next<decltype(&clEnqueueWriteBuffer)>("clEnqueueWriteBuffer");
  if (blocking == CL_TRUE) ++calls.blocking_writes;
  return real(queue, buffer, blocking, offset, size, from, waits, wait, event);
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** texts,
                                     const size_t* lengths, cl_int* error) {
  static const auto real = next<decltype(&clCreateProgramWithSource)>("clCreateProgramWithSource");
  const std::string source = as_the_device_compiles(joined(count, texts, lengths));
  const char* text = source.c_str();
  return real(context, 1, &text, nullptr, error);
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* done)(cl_program, void*), void* user) {
  static const auto real = next<decltype(&clBuildProgram)>("clBuildProgram");
  std::string all = options == nullptr ? "" : options;
  if (std::getenv("VDVR_SHIM_BREAK_BUILD") != nullptr) all += " -Dget_global_id=no_such_function";
  if (lacks("VDVR_SHIM_DENORMALS")) all += " -cl-denorms-are-zero";
  if (const char* more = std::getenv("VDVR_SHIM_BUILD_OPTIONS")) all += std::string(" ") + more;
  write_down(program, all.c_str());
  return real(program, count, devices, all.c_str(), done, user);
}

}  // extern "C"
