// The large host arrays of a stage, counted against --max-memory beside the device's. What is not counted
// (docs/performance.md): scratch no larger than a batch of blocks, and libraries.
#pragma once

#include <cstdint>
#include <string>

#include "host/base/opencl/state.hpp"

namespace vdvr {

class HostMemory {
 public:
  explicit HostMemory(opencl::State& state) : state_(state) {}
  HostMemory(opencl::State& state, std::uint64_t bytes, const std::string& what) : state_(state) {
    count(bytes, what);
  }
  ~HostMemory() { state_.memory.give_host(bytes_); }
  HostMemory(const HostMemory&) = delete;
  HostMemory& operator=(const HostMemory&) = delete;

  /// Before they are allocated. Throws ResourceError naming `what` when they pass the limit.
  void count(std::uint64_t bytes, const std::string& what) {
    state_.take_host(bytes, what);
    bytes_ += bytes;
  }
  void uncount(std::uint64_t bytes) {
    state_.memory.give_host(bytes);
    bytes_ -= bytes;
  }

 private:
  opencl::State& state_;
  std::uint64_t bytes_ = 0;
};

}  // namespace vdvr
