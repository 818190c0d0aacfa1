// Launches that end soon. A display's watchdog ends those of some seconds, and a stop waits for what is
// enqueued: so what a kernel takes is measured, and a launch that would take longer than
// State::longest_launch becomes several. Kernels know nothing of it, since they ask for global places alone
// (tests/rooms/rooms.py).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "host/base/opencl/cl.hpp"

namespace vdvr::opencl {

struct State;

/// What one kernel took, for all that launch it.
class Pace {
 public:
  /// Measured last, by a launch of some size: a small one says little of a large one. 0: nothing yet.
  [[nodiscard]] double seconds_per_item() const { return seconds_per_item_; }
  void learn(double seconds, std::uint64_t items);
  [[nodiscard]] std::uint64_t launches() const { return launches_; }
  void count() { ++launches_; }

 private:
  std::atomic<double> seconds_per_item_{0};
  std::atomic<std::uint64_t> items_{0}, launches_{0};
};

/// How a launch is cut: along `axis`, at most `groups` work-groups a piece.
struct Cut {
  std::size_t axis = 0;
  std::uint64_t groups = 0;
};

/// The longest axis, the slowest of equals. As many groups as take `longest` seconds at the pace; of a kernel
/// that nobody measured all, or where a watchdog may wait a small part.
Cut cut_of(const std::array<std::uint64_t, 3>& groups, std::uint64_t items_per_group, const Pace& pace,
           double longest, bool watched);

/// Enqueues all of `global`, a multiple of `local`, in pieces. Throws cl::Error, and Stopped between two of
/// them.
void enqueue_in_pieces(State& state, const cl::Kernel& kernel, Pace& pace,
                       const std::array<std::uint64_t, 3>& global, const std::array<std::uint64_t, 3>& local);

}  // namespace vdvr::opencl
