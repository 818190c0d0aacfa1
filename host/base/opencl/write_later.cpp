#include "host/base/opencl/write_later.hpp"

#include <fmt/format.h>

#include <cstring>
#include <memory>

namespace vdvr::opencl {

void enqueue_copy(State& state, const cl::Buffer& to, const void* bytes, std::size_t size,
                  const std::string& what) {
  auto copy = std::make_unique<std::byte[]>(size);
  std::memcpy(copy.get(), bytes, size);
  try {
    cl::Event written;
    state.queue.enqueueWriteBuffer(to, CL_FALSE, 0, size, copy.get(), nullptr, &written);
    std::byte* const owned = copy.release();
    const auto free_copy = [](cl_event, cl_int, void* held) { delete[] static_cast<std::byte*>(held); };
    if (clSetEventCallback(written(), CL_COMPLETE, free_copy, owned) == CL_SUCCESS) return;
    copy.reset(owned);
    written.wait();
  } catch (const cl::Error& e) {
    throw DeviceError(
        fmt::format("write of {} ({} bytes) on '{}': {}", what, size, state.info.name, code_name(e.err())));
  }
}

}  // namespace vdvr::opencl
