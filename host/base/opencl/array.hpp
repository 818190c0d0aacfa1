// A typed device buffer, counted against the memory account. Reads wait; writes and fills do not (in-order
// queue), except that a write copies the host data before it returns. Mapping saves that copy on CPUs.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/base/opencl/state.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr::opencl {

template <class T>
class DeviceArray {
 public:
  DeviceArray() = default;
  /// Throws ResourceError or DeviceError before anything is allocated when it cannot fit.
  DeviceArray(State& state, std::uint64_t count, const std::string& what)
      : state_(&state), count_(count), what_(what) {
    if (count > UINT64_MAX / sizeof(T))
      throw ResourceError(fmt::format("{}: {} elements pass 2^64 bytes", what, count));
    try {
      buffer_ = state.allocate(size_bytes(), what);
    } catch (...) {
      state_ = nullptr;
      throw;
    }
  }
  DeviceArray(State& state, std::span<const T> values, const std::string& what)
      : DeviceArray(state, values.size(), what) {
    write(values);
  }
  /// In scratch files, which kernels of a device that computes in the host's memory read where they lie;
  /// there alone. Zeros. Without `scratch` as above.
  DeviceArray(State& state, std::shared_ptr<Scratch> scratch, std::uint64_t count, const std::string& what)
      : DeviceArray() {
    if (!scratch) {
      *this = DeviceArray(state, count, what);
      return;
    }
    count_ = count;
    what_ = what;
    const std::span<T> mapped = scratch->map<T>(static_cast<std::size_t>(count), what);
    pages_ = {mapped.data(), [scratch](void* first) { scratch->unmap(first); }};
    state_ = &state;
    guard("map", [&] {
      buffer_ =
          cl::Buffer(state.context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size_bytes(), mapped.data());
    });
  }
  /// In memory of the host that `owner` keeps, where kernels of a device that computes there read and write
  /// it: what others see of it is the caller's to know. From a page's first byte on.
  DeviceArray(State& state, std::span<T> memory, std::shared_ptr<void> owner, const std::string& what)
      : state_(&state), count_(memory.size()), what_(what), pages_(std::move(owner)) {
    guard("map", [&] {
      buffer_ =
          cl::Buffer(state.context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size_bytes(), memory.data());
    });
  }
  ~DeviceArray() { release(); }
  DeviceArray(DeviceArray&& o) noexcept
      : state_(std::exchange(o.state_, nullptr)),
        count_(std::exchange(o.count_, 0)),
        what_(std::move(o.what_)),
        buffer_(std::move(o.buffer_)),
        pages_(std::move(o.pages_)) {}
  DeviceArray& operator=(DeviceArray&& o) noexcept {
    if (this != &o) {
      release();
      state_ = std::exchange(o.state_, nullptr);
      count_ = std::exchange(o.count_, 0);
      what_ = std::move(o.what_);
      buffer_ = std::move(o.buffer_);
      pages_ = std::move(o.pages_);
    }
    return *this;
  }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;

  [[nodiscard]] std::uint64_t size() const { return count_; }
  [[nodiscard]] const cl::Buffer& buffer() const { return buffer_; }

  void write(std::span<const T> values, std::uint64_t first = 0) {
    if (values.empty()) return;
    check(first, values.size());
    guard("write", [&] {
      state_->queue.enqueueWriteBuffer(buffer_, CL_TRUE, first * sizeof(T), values.size_bytes(),
                                       values.data());
    });
  }
  void read(std::span<T> values, std::uint64_t first = 0) const {
    if (values.empty()) return;
    check(first, values.size());
    guard("read", [&] {
      state_->queue.enqueueReadBuffer(buffer_, CL_TRUE, first * sizeof(T), values.size_bytes(),
                                      values.data());
    });
  }
  /// f(span<const T>) on the mapped contents: on devices that share the host's memory nothing is copied.
  /// Waits.
  template <class F>
  void read_mapped(F&& f) const {
    Mapping m(*this, CL_MAP_READ);
    f(std::span<const T>(m.data, count_));
    m.unmap();
  }
  /// f(span<T>) fills all of the mapped array; what it held before is lost. Waits for earlier work.
  template <class F>
  void write_mapped(F&& f) {
    Mapping m(*this, CL_MAP_WRITE_INVALIDATE_REGION);
    f(std::span<T>(m.data, count_));
    m.unmap();
  }
  [[nodiscard]] std::vector<T> to_host() const {
    std::vector<T> values(count_);
    read(values);
    return values;
  }
  /// In pieces: there are drivers that fill no more than 2 or 4 GiB of a buffer, and report no error.
  void fill(const T& value) {
    constexpr std::uint64_t most = (std::uint64_t{1} << 30) / sizeof(T) * sizeof(T);
    guard("fill", [&] {
      for (std::uint64_t done = 0, all = size_bytes(); done < all; done += most)
        state_->queue.enqueueFillBuffer(buffer_, value, done, std::min(most, all - done));
    });
  }

 private:
  // Maps the whole array, and unmaps it even when the work on it throws.
  struct Mapping {
    Mapping(const DeviceArray& of, cl_map_flags flags) : array(of) {
      array.guard("map", [&] {
        data = static_cast<T*>(
            array.state_->queue.enqueueMapBuffer(array.buffer_, CL_TRUE, flags, 0, array.size_bytes()));
      });
    }
    // What was written may arrive only now: a failure is one of the write's.
    void unmap() {
      T* mapped = std::exchange(data, nullptr);
      array.guard("unmap", [&] { array.state_->queue.enqueueUnmapMemObject(array.buffer_, mapped); });
    }
    ~Mapping() {
      if (data != nullptr)
        clEnqueueUnmapMemObject(array.state_->queue(), array.buffer_(), data, 0, nullptr, nullptr);
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    const DeviceArray& array;
    T* data = nullptr;
  };
  // OpenCL has no empty buffers: an empty array holds one element.
  [[nodiscard]] std::uint64_t size_bytes() const { return (count_ == 0 ? 1 : count_) * sizeof(T); }
  void check(std::uint64_t first, std::uint64_t n) const {
    if (first > count_ || n > count_ - first)
      throw DeviceError(fmt::format("{}: range {}+{} outside an array of {}", what_, first, n, count_));
  }
  template <class F>
  void guard(const char* call, F&& f) const {
    try {
      f();
    } catch (const cl::Error& e) {
      throw DeviceError(fmt::format("{} of {} ({} elements) on '{}': {}", call, what_, count_,
                                    state_->info.name, code_name(e.err())));
    }
  }

  void release() noexcept {
    if (!state_) return;
    if (!pages_) return state_->release(size_bytes(), std::move(buffer_));
    // Kernels may still read what is about to be unmapped.
    clFinish(state_->queue());
    buffer_ = {};
    pages_ = nullptr;
  }

  State* state_ = nullptr;
  std::uint64_t count_ = 0;
  std::string what_;
  cl::Buffer buffer_;
  std::shared_ptr<void> pages_;  // of scratch files
};

}  // namespace vdvr::opencl
