// What a Device holds: context, in-order queue, program cache, and the account of our allocations. Threads
// may share it: OpenCL's own calls are safe, whatever else changes stands behind locks. A cl::Kernel is not,
// so that each launcher has its own. Threads that should not wait for each other take a strand of it each.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "host/base/opencl/cl.hpp"
#include "host/base/opencl/pace.hpp"
#include "vdvr/device.hpp"

namespace vdvr::opencl {

/// Allocations of ours. A device that computes in the host's memory has one account with it, a card its own:
/// each is held to
/// --max-memory, the card's also to most of what it has.
class MemoryAccount {
 public:
  /// `of_device`: not of a `shared` account.
  void set_limits(std::uint64_t of_host, std::uint64_t of_device, bool shared);
  /// On the device. Throws ResourceError naming `what` and the remedy when the limit would be passed.
  /// `kept`: bytes of the pool, for the peak.
  void take(std::uint64_t bytes, const std::string& what, std::uint64_t kept = 0);
  void take_host(std::uint64_t bytes, const std::string& what, std::uint64_t kept);
  void give(std::uint64_t bytes) noexcept;
  void give_host(std::uint64_t bytes) noexcept;
  /// Of both together.
  [[nodiscard]] std::uint64_t peak() const;
  /// Of the one that came to more: what --max-memory limits.
  [[nodiscard]] std::uint64_t peak_of_one() const;
  /// For allocations on the device.
  [[nodiscard]] std::uint64_t left() const;
  [[nodiscard]] std::uint64_t host_left() const;
  /// The host's.
  [[nodiscard]] std::uint64_t limit() const;

 private:
  struct Side {
    std::uint64_t limit = UINT64_MAX, used = 0, peak = 0;
    [[nodiscard]] std::uint64_t room() const { return limit > used ? limit - used : 0; }
    void take(std::uint64_t bytes, const std::string& what, std::uint64_t kept, const char* where);
  };
  Side& device_side();
  [[nodiscard]] const Side& device_side() const;

  mutable std::mutex lock_;
  Side host_, device_;
  bool shared_ = true;
};

/// Freed buffers kept for the next allocation of the same size: fresh pages cost more than the kernels that
/// fill them. Without a lock of its own: a State has it under its.
class BufferPool {
 public:
  /// A kept buffer of exactly this size, or an empty one.
  cl::Buffer take(std::uint64_t bytes);
  void keep(std::uint64_t bytes, cl::Buffer buffer);
  void clear();
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  std::multimap<std::uint64_t, cl::Buffer> buffers_;
  std::uint64_t bytes_ = 0;
};

/// A define passed to the kernel compiler: meaning (no default in the kernel) or tuning (default in the
/// kernel).
using Defines = std::vector<std::pair<std::string, std::string>>;

/// A kernel with its arguments, of one launcher at a time.
struct ReadyKernel {
  cl::Kernel kernel;
  std::uint64_t largest_group = 1;
  Pace* pace = nullptr;  // the state's
};

/// Kernels that launchers are done with, for the next one: drivers of GPUs take long to make them.
class KernelPool {
 public:
  std::optional<ReadyKernel> take(const std::string& key);
  void keep(const std::string& key, ReadyKernel kernel) noexcept;

 private:
  std::mutex lock_;
  std::map<std::string, std::vector<ReadyKernel>> idle_;  // by program, kernel and defines
};

/// Copies of small arrays until the device has read them, page by page: an event of each write, and a thread
/// of the driver that is told of it, would cost more than the write.
class Staging {
 public:
  /// Enqueues a write of a copy of `bytes`. Throws cl::Error.
  void write(cl::CommandQueue& queue, const cl::Buffer& to, const void* bytes, std::size_t size);

 private:
  struct Page {
    std::unique_ptr<std::byte[]> bytes;
    std::size_t size = 0, used = 0;
    cl::Event read;  // once the page is full: when the last of its writes is over
  };
  Page page_for(std::size_t size);

  std::mutex lock_;
  Page filling_;
  std::deque<Page> full_;  // as they were filled
  std::size_t full_bytes_ = 0;
};

/// A launch that nobody waited for yet.
struct Launched {
  cl::Event event;
  Pace* pace = nullptr;
  std::uint64_t items = 0;
  double seconds = 0;  // that it will take, as far as is known
  std::chrono::steady_clock::time_point at = std::chrono::steady_clock::now();
};

/// Some of what follows is for its faults.
inline constexpr const char* pocl_platform = "Portable Computing Language";

/// Shared by the Device and by what may outlive it.
struct State : std::enable_shared_from_this<State> {
  State();
  /// strand() alone makes them.
  explicit State(State* main);
  ~State();  // waits for what is enqueued
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  DeviceInfo info;
  cl::Device device;
  cl::Context context;
  cl::CommandQueue queue;
  MemoryAccount& memory;
  Staging staging;
  /// Shared with launchers, which may outlive the state.
  std::shared_ptr<KernelPool> kernels = std::make_shared<KernelPool>();

  /// A queue beside this one, with arrays of its own in the pool, so that none is used again before its
  /// kernels are over; all else is this one's. The same for the same number, and it lives as long as this.
  State& strand(std::size_t number);
  /// How many of them are of use, and safe, beside each other; 1: none but this. It may change when another
  /// device is opened.
  [[nodiscard]] int most_strands() const;
  /// What is enqueued here from now on begins when all that is enqueued there has ended.
  void wait_for(State& other);

  /// An allocation of `bytes`, from the pool or new, counted. Throws ResourceError before anything is
  /// allocated.
  cl::Buffer allocate(std::uint64_t bytes, const std::string& what);
  void release(std::uint64_t bytes, cl::Buffer buffer) noexcept;
  /// Counts memory of the host, for which the pool makes room. Throws ResourceError. memory.give_host()
  /// returns it.
  void take_host(std::uint64_t bytes, const std::string& what);
  /// Seconds. Set before kernels are launched. A CPU has no watchdog, and PoCL compiles a kernel once more
  /// for a place other than the first to begin at: there it is more.
  double longest_launch = 0.25;
  /// Waits for earlier launches where many are unfinished: on a CPU all but two. With `wait` for all.
  void keep_pace(Launched latest, bool wait);
  /// Lives as long as the state.
  Pace& pace_of(const std::string& kernel);
  /// So far, each piece counted.
  [[nodiscard]] std::uint64_t launches();

  /// Told of each program when it is asked for first, by the thread that asks, which holds a lock. Set before
  /// kernels are made, and by the thread that makes them.
  std::function<void(const std::string& name, const Defines&)> on_program;

  /// How many programs came from the cache folder.
  [[nodiscard]] std::size_t programs_remembered();

 private:
  friend const cl::Program& program(State&, const std::string&, const Defines&);
  const cl::Program& built(const std::string& name, const Defines& defines);
  // Of the pools of all strands.
  [[nodiscard]] std::uint64_t kept_bytes() const;
  void clear_pools();

  MemoryAccount own_memory_;
  State& main_;
  std::vector<std::unique_ptr<State>> strands_;
  std::mutex pool_lock_;  // of the strands and of their pools too; the account's own may be taken under it
  BufferPool pool_;
  std::mutex pace_lock_;
  std::deque<Launched> in_flight_;
  double in_flight_seconds_ = 0;
  std::map<std::string, Pace> paces_;  // by program, kernel and defines
  std::mutex building_lock_;           // one program at a time, and not of programs_, for which others wait
  std::mutex programs_lock_;
  std::map<std::string, cl::Program> programs_;  // by name and defines
  std::set<const cl::Program*> told_;            // of these on_program was told
  std::size_t programs_remembered_ = 0;
};

/// "CL_OUT_OF_RESOURCES (-5)".
std::string code_name(int code);

/// Builds kernels/<name>.cl for the state's device, or returns the program that it has, which lives as long
/// as the state. One program is built at a time. On PoCL, and on Intel's runtime for CPUs, binaries of the
/// cache folder are taken where source, options, device and driver are theirs, which takes a millisecond.
/// `#include "shared/x.h"` is resolved from the embedded sources with #line directives. Throws BuildError
/// with device, options and the compiler's log.
const cl::Program& program(State& state, const std::string& name, const Defines& defines = {});

/// Full source text after resolving includes; what the compiler sees.
std::string resolve_source(const std::string& name);

/// Rounds up to a multiple.
constexpr std::uint64_t round_up(std::uint64_t n, std::uint64_t multiple) {
  return (n + multiple - 1) / multiple * multiple;
}

}  // namespace vdvr::opencl
