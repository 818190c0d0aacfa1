// Typed kernel launches: argument order and types are checked by the C++ compiler against the functor's list,
// sizes against the device before launch, and a failing call is reported with kernel, ranges and code.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

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
      : state_(&state), name_(kernel_name) {
    throw_if_stopped();  // compiling takes seconds
    std::string key = program_name + ' ' + kernel_name;
    for (const auto& [name, value] : defines) key += ' ' + name + '=' + value;
    pace_ = &state.pace_of(key);
    const cl::Program& p = program(state, program_name, defines);
    try {
      kernel_ = cl::Kernel(p, kernel_name.c_str());
      max_group_ = kernel_.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(state.device);
      if (const auto n = kernel_.getInfo<CL_KERNEL_NUM_ARGS>(); n != sizeof...(Args))
        throw DeviceError(fmt::format("kernel {} takes {} arguments, its launcher passes {}", kernel_name, n,
                                      sizeof...(Args)));
    } catch (const cl::Error& e) {
      throw DeviceError(fmt::format("kernel {} of program {}: {} {}", kernel_name, program_name, e.what(),
                                    code_name(e.err())));
    }
  }

  /// Enqueues, in pieces where all at once would take long (pace.hpp). Waits only for launches that are well
  /// ahead of this one: what is enqueued cannot be taken back, so that a stop would wait for all of it.
  void operator()(const Range& range, const Args&... args) {
    std::array<std::uint64_t, 3> local = range.local;
    while (local[0] * local[1] * local[2] > max_group_) {  // a device smaller than the tuning assumed
      auto largest = std::max_element(local.begin(), local.end());
      if (*largest == 1) break;
      *largest = (*largest + 1) / 2;
    }
    const auto g = [&](std::size_t a) { return round_up(range.global[a], local[a]); };
    if (g(0) * g(1) * g(2) == 0) return;
    try {
      cl_uint index = 0;
      (kernel_.setArg(index++, args), ...);
      enqueue_in_pieces(*state_, kernel_, *pace_, {g(0), g(1), g(2)}, local);
    } catch (const cl::Error& e) {
      throw DeviceError(fmt::format("kernel {} on '{}', global {}x{}x{}, local {}x{}x{}: {} {}", name_,
                                    state_->info.name, g(0), g(1), g(2), local[0], local[1], local[2],
                                    e.what(), code_name(e.err())));
    }
  }

 private:
  State* state_;
  std::string name_;
  cl::Kernel kernel_;
  std::uint64_t max_group_ = 1;
  Pace* pace_ = nullptr;  // the state's
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
