// Typed kernel launches: argument order and types are checked by the C++ compiler against the functor's list,
// sizes against the device before launch, and a failing call is reported with kernel, ranges and code.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>

#include "host/base/opencl/array.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::opencl {

/// Global and local work sizes; `global` is rounded up to a multiple of `local` here and nowhere else, so
/// every kernel guards its range by arguments.
struct Range {
  std::array<std::uint64_t, 3> global{1, 1, 1};
  std::array<std::uint64_t, 3> local{1, 1, 1};
};

/// Args are the device-side argument types: cl::Buffer, cl::Image3D, or plain values.
template <class... Args>
class Kernel {
 public:
  Kernel(State& state, const std::string& program_name, const std::string& kernel_name,
         const Defines& defines = {})
      : state_(&state), name_(kernel_name), pool_(state.kernels) {
    throw_if_stopped();  // compiling takes seconds
    key_ = program_name + ' ' + kernel_name;
    for (const auto& [name, value] : defines) key_ += ' ' + name + '=' + value;
    if (auto idle = pool_->take(key_)) {
      ready_ = std::move(*idle);
      return;
    }
    ready_.pace = &state.pace_of(key_);
    const cl::Program& p = program(state, program_name, defines);
    try {
      ready_.kernel = cl::Kernel(p, kernel_name.c_str());
      ready_.largest_group = ready_.kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(state.device);
      if (const auto n = ready_.kernel.getInfo<CL_KERNEL_NUM_ARGS>(); n != sizeof...(Args))
        throw DeviceError(fmt::format("kernel {} takes {} arguments, its launcher passes {}", kernel_name, n,
                                      sizeof...(Args)));
    } catch (const cl::Error& e) {
      throw DeviceError(fmt::format("kernel {} of program {}: {} {}", kernel_name, program_name, e.what(),
                                    code_name(e.err())));
    }
  }

  ~Kernel() {
    if (pool_ && ready_.kernel()) pool_->keep(key_, std::move(ready_));
  }
  Kernel(Kernel&&) noexcept = default;
  Kernel& operator=(Kernel&&) = delete;
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  /// Enqueues, in pieces where all at once would take long (pace.hpp). Waits only for launches that are well
  /// ahead of this one: what is enqueued cannot be taken back, so that a stop would wait for all of it.
  void operator()(const Range& range, const Args&... args) {
    std::array<std::uint64_t, 3> local = range.local;
    while (local[0] * local[1] * local[2] >
           ready_.largest_group) {  // a device smaller than the tuning assumed
      auto largest = std::max_element(local.begin(), local.end());
      if (*largest == 1) break;
      *largest = (*largest + 1) / 2;
    }
    const auto g = [&](std::size_t a) { return round_up(range.global[a], local[a]); };
    if (g(0) * g(1) * g(2) == 0) return;
    try {
      cl_uint index = 0;
      (ready_.kernel.setArg(index++, args), ...);
      enqueue_in_pieces(*state_, ready_.kernel, *ready_.pace, {g(0), g(1), g(2)}, local);
    } catch (const cl::Error& e) {
      throw DeviceError(fmt::format("kernel {} on '{}', global {}x{}x{}, local {}x{}x{}: {} {}", name_,
                                    state_->info.name, g(0), g(1), g(2), local[0], local[1], local[2],
                                    e.what(), code_name(e.err())));
    }
  }

 private:
  State* state_;
  std::string name_, key_;
  std::shared_ptr<KernelPool> pool_;
  ReadyKernel ready_;
};

/// Waits for everything enqueued; turns a failure into a DeviceError that names the stage.
inline void finish(State& state, const std::string& stage) {
  try {
    state.queue.finish();
  } catch (const cl::Error& e) {
    throw DeviceError(fmt::format("{} on '{}': {}", stage, state.info.name, code_name(e.err())));
  }
}

}  // namespace vdvr::opencl
