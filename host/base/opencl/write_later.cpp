#include "host/base/opencl/write_later.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

namespace vdvr::opencl {
namespace {

constexpr std::size_t page_bytes = std::size_t{1} << 20;
// Of pages that the device has not read yet; then the oldest is waited for.
constexpr std::size_t most_bytes = std::size_t{64} << 20;

bool is_over(const cl::Event& event) {
  return event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() <= CL_COMPLETE;  // below it: failed
}

}  // namespace

// The oldest full page, where the device is done with it or must be, else a new one.
Staging::Page Staging::page_for(std::size_t size) {
  Page out;
  while (!full_.empty() && (full_bytes_ > most_bytes || is_over(full_.front().read))) {
    if (full_bytes_ > most_bytes) full_.front().read.wait();
    full_bytes_ -= full_.front().size;
    if (full_.front().size >= size && full_.front().size > out.size) out = std::move(full_.front());
    full_.pop_front();
  }
  if (out.size < size) {
    out.size = std::max(size, page_bytes);
    out.bytes = std::make_unique_for_overwrite<std::byte[]>(out.size);
  }
  out.used = 0;
  return out;
}

void Staging::write(cl::CommandQueue& queue, const cl::Buffer& to, const void* bytes, std::size_t size) {
  const std::lock_guard guard(lock_);  // a page's writes are enqueued before its end is
  if (filling_.used + size > filling_.size) {
    if (filling_.used > 0) {
      queue.enqueueMarkerWithWaitList(nullptr, &filling_.read);
      full_bytes_ += filling_.size;
      full_.push_back(std::move(filling_));
      filling_ = {};
    }
    filling_ = page_for(size);
  }
  std::byte* const copy = filling_.bytes.get() + filling_.used;
  std::memcpy(copy, bytes, size);
  queue.enqueueWriteBuffer(to, CL_FALSE, 0, size, copy);
  filling_.used += (size + 15) / 16 * 16;
}

void enqueue_copy(State& state, const cl::Buffer& to, const void* bytes, std::size_t size,
                  const std::string& what) {
  try {
    state.staging.write(state.queue, to, bytes, size);
  } catch (const cl::Error& e) {
    throw DeviceError(
        fmt::format("write of {} ({} bytes) on '{}': {}", what, size, state.info.name, code_name(e.err())));
  }
}

}  // namespace vdvr::opencl
