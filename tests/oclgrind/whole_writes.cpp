// A layer between a program and the simulator Oclgrind, put there by scripts/under-oclgrind: host writes to a
// part of a buffer, and fills, become one write of the whole buffer. Oclgrind 21.10 remembers of what the
// host wrote only the latest piece, and that at a wrong offset, and takes the rest for never written;
// written_in_pieces.cpp shows it. The price: all of a buffer that the host wrote a part of counts as written.
#include <CL/cl.h>

#include <cstring>
#include <vector>

#include "tests/support/next_function.hpp"

namespace {

size_t size_of(cl_mem buffer) {
  size_t bytes = 0;
  clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof bytes, &bytes, nullptr);
  return bytes;
}

cl_int write_whole(cl_command_queue queue, cl_mem buffer, const void* bytes, size_t size, cl_uint waits,
                   const cl_event* wait, cl_event* event) {
  static const auto real = next<decltype(&clEnqueueWriteBuffer)>("clEnqueueWriteBuffer");
  return real(queue, buffer, CL_TRUE, 0, size, bytes, waits, wait, event);
}

/// All of the buffer, changed by `change`, in one write. Waits.
template <typename Change>
cl_int rewrite(cl_command_queue queue, cl_mem buffer, size_t first, size_t count, cl_uint waits,
               const cl_event* wait, cl_event* event, Change&& change) {
  const size_t size = size_of(buffer);
  if (first > size || count > size - first) return CL_INVALID_VALUE;
  std::vector<unsigned char> all(size);
  const cl_int rc = clEnqueueReadBuffer(queue, buffer, CL_TRUE, 0, size, all.data(), waits, wait, nullptr);
  if (rc != CL_SUCCESS) return rc;
  change(all.data() + first);
  return write_whole(queue, buffer, all.data(), size, 0, nullptr, event);
}

}  // namespace

extern "C" {

cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool, size_t first, size_t count,
                            const void* bytes, cl_uint waits, const cl_event* wait, cl_event* event) {
  if (first == 0 && count == size_of(buffer))
    return write_whole(queue, buffer, bytes, count, waits, wait, event);
  return rewrite(queue, buffer, first, count, waits, wait, event,
                 [&](unsigned char* to) { std::memcpy(to, bytes, count); });
}

cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void* pattern, size_t length,
                           size_t first, size_t count, cl_uint waits, const cl_event* wait, cl_event* event) {
  if (length == 0 || count % length != 0) return CL_INVALID_VALUE;
  return rewrite(queue, buffer, first, count, waits, wait, event, [&](unsigned char* to) {
    for (size_t i = 0; i < count; i += length) std::memcpy(to + i, pattern, length);
  });
}

}  // extern "C"
