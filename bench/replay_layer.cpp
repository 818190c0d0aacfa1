// A layer between the program and the OpenCL loader, put there with LD_PRELOAD: keeps what a command reads
// from its device, and plays it to the same command again, for which no kernel runs and nothing is copied.
// What that takes is the host's own time. Used by bench/host_stages.
//   VDVR_REPLAY_FILE=FILE   what is read; of each strand (in_strands) in FILE.strand N
//   VDVR_REPLAY=1           play it; else keep it
#include <CL/cl.h>
#include <pthread.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

#include "tests/support/next_function.hpp"

namespace {

// Each strand does the same in the same order, whatever the others do.
std::string strand_name() {
  char name[16] = "";
  pthread_getname_np(pthread_self(), name, sizeof name);
  return std::strncmp(name, "strand ", 7) == 0 ? std::string(".") + name : "";
}

class Tape {
 public:
  Tape() {
    if (const char* name = std::getenv("VDVR_REPLAY_FILE")) name_ = name;
    plays_ = std::getenv("VDVR_REPLAY") != nullptr;
  }
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;
  ~Tape() {
    for (const auto& [name, file] : files_) std::fclose(file);
  }

  [[nodiscard]] bool plays() const { return plays_; }
  // What a read brought, or brings.
  void pass(void* bytes, std::uint64_t size) {
    std::FILE* const file = file_of(strand_name());
    std::uint64_t kept = size;
    if (plays_) {
      if (std::fread(&kept, sizeof kept, 1, file) != 1 || kept != size ||
          std::fread(bytes, 1, size, file) != size)
        fail("the command reads from its device what it did not read before");
    } else if (std::fwrite(&kept, sizeof kept, 1, file) != 1 || std::fwrite(bytes, 1, size, file) != size) {
      fail("cannot write VDVR_REPLAY_FILE");
    }
  }

 private:
  [[noreturn]] static void fail(const char* what) {
    std::fprintf(stderr, "replay_layer: %s\n", what);
    std::_Exit(70);
  }
  std::FILE* file_of(const std::string& strand) {
    const std::lock_guard guard(lock_);
    std::FILE*& file = files_[strand];
    if (file == nullptr) file = std::fopen((name_ + strand).c_str(), plays_ ? "rb" : "wb");
    if (file == nullptr) fail("cannot open VDVR_REPLAY_FILE");
    return file;
  }

  std::string name_;
  std::map<std::string, std::FILE*> files_;
  bool plays_ = false;
  std::mutex lock_;
};

Tape& tape() {
  static Tape one;
  return one;
}

// In place of a command: its event.
cl_int nothing(cl_command_queue queue, cl_uint waits, const cl_event* wait, cl_event* event) {
  return event == nullptr ? CL_SUCCESS : clEnqueueMarkerWithWaitList(queue, waits, wait, event);
}

}  // namespace

extern "C" {

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint axes, const size_t* offset,
                              const size_t* global, const size_t* local, cl_uint waits, const cl_event* wait,
                              cl_event* event) {
  static const auto real = next<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
  if (tape().plays()) return nothing(queue, waits, wait, event);
  return real(queue, kernel, axes, offset, global, local, waits, wait, event);
}

cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocks, size_t offset, size_t size,
                            const void* bytes, cl_uint waits, const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueWriteBuffer)>("clEnqueueWriteBuffer");
  if (tape().plays()) return nothing(queue, waits, wait, event);
  return real(queue, buffer, blocks, offset, size, bytes, waits, wait, event);
}

cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void* pattern, size_t pattern_size,
                           size_t offset, size_t size, cl_uint waits, const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueFillBuffer)>("clEnqueueFillBuffer");
  if (tape().plays()) return nothing(queue, waits, wait, event);
  return real(queue, buffer, pattern, pattern_size, offset, size, waits, wait, event);
}

cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool, size_t offset, size_t size,
                           void* bytes, cl_uint waits, const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueReadBuffer)>("clEnqueueReadBuffer");
  const cl_int code = tape().plays() ? nothing(queue, waits, wait, event)
                                     : real(queue, buffer, CL_TRUE, offset, size, bytes, waits, wait, event);
  if (code == CL_SUCCESS) tape().pass(bytes, size);
  return code;
}

void* clEnqueueMapBuffer(cl_command_queue queue, cl_mem buffer, cl_bool, cl_map_flags flags, size_t offset,
                         size_t size, cl_uint waits, const cl_event* wait, cl_event* event, cl_int* code) {
  static const auto real = next<decltype(&clEnqueueMapBuffer)>("clEnqueueMapBuffer");
  void* const bytes = real(queue, buffer, CL_TRUE, flags, offset, size, waits, wait, event, code);
  if (bytes != nullptr && (flags & CL_MAP_READ) != 0) tape().pass(bytes, size);
  return bytes;
}

}  // extern "C"
