#include "host/base/opencl/pace.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "host/base/opencl/state.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::opencl {
namespace {

// Of a kernel that was not measured yet, the part that is: 64 of them as long as may be are no harm.
constexpr std::uint64_t first_part = 64;

// As the device has it; where it tells nothing, since the launch was enqueued.
double seconds_of(const Launched& launched) {
  try {
    const auto begin = launched.event.getProfilingInfo<CL_PROFILING_COMMAND_START>(),
               end = launched.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    if (end > begin) return 1e-9 * static_cast<double>(end - begin);
  } catch (const cl::Error&) {
    // It is only slower to find out.
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - launched.at).count();
}

}  // namespace

void Pace::learn(double seconds, std::uint64_t items) {
  if (items == 0 || 4 * items < items_.load()) return;
  items_ = items;
  seconds_per_item_ = seconds / static_cast<double>(items);
}

Cut cut_of(const std::array<std::uint64_t, 3>& groups, std::uint64_t items_per_group, const Pace& pace,
           double longest, bool watched) {
  Cut cut;
  for (std::size_t a = 1; a < 3; ++a)
    if (groups[a] >= groups[cut.axis]) cut.axis = a;
  const std::uint64_t along = groups[cut.axis];
  const double all = static_cast<double>(groups[0]) * static_cast<double>(groups[1]) *
                     static_cast<double>(groups[2]),
               seconds = pace.seconds_per_item() * static_cast<double>(items_per_group) * all;
  cut.groups = along;
  if (pace.seconds_per_item() == 0 && watched) cut.groups = std::max<std::uint64_t>(1, along / first_part);
  else if (seconds > longest)
    cut.groups = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(longest / seconds * static_cast<double>(along)));
  return cut;
}

void enqueue_in_pieces(State& state, const cl::Kernel& kernel, Pace& pace,
                       const std::array<std::uint64_t, 3>& global,
                       const std::array<std::uint64_t, 3>& local) {
  const std::array<std::uint64_t, 3> groups{global[0] / local[0], global[1] / local[1], global[2] / local[2]};
  const std::uint64_t items_per_group = local[0] * local[1] * local[2];
  std::array<std::uint64_t, 3> offset{}, size = global;
  std::size_t axis = 0;
  for (std::uint64_t done = 0, all = 1; done < all;) {
    throw_if_stopped();
    const Cut cut = cut_of(groups, items_per_group, pace, state.longest_launch, !state.info.is_cpu);
    if (done == 0) {
      axis = cut.axis;
      all = groups[axis];
    }
    const std::uint64_t n = std::min(cut.groups, all - done);
    offset[axis] = done * local[axis];
    size[axis] = n * local[axis];
    cl::Event event;
    state.queue.enqueueNDRangeKernel(kernel, cl::NDRange(offset[0], offset[1], offset[2]),
                                     cl::NDRange(size[0], size[1], size[2]),
                                     cl::NDRange(local[0], local[1], local[2]), nullptr, &event);
    pace.count();
    const bool unknown = pace.seconds_per_item() == 0;
    done += n;
    state.keep_pace({std::move(event), &pace, size[0] * size[1] * size[2]}, unknown && done < all);
  }
}

void State::keep_pace(Launched latest, bool wait) {
  // A CPU is busy with one kernel. A GPU must not run dry while the host prepares the next: there half of the
  // launches are waited for, when as many more are enqueued, or when they would take long together.
  const std::size_t most = info.is_cpu ? 2 : 16, left = wait ? 0 : info.is_cpu ? 2 : 8;
  Launched ended;
  {
    const std::lock_guard guard(pace_lock_);
    const auto seconds = [](const Launched& l) {
      return l.pace->seconds_per_item() * static_cast<double>(l.items);
    };
    in_flight_seconds_ += latest.seconds = seconds(latest);
    in_flight_.push_back(std::move(latest));
    const auto pop = [&] {
      ended = std::move(in_flight_.front());
      in_flight_.pop_front();
      in_flight_seconds_ -= ended.seconds;
    };
    if (wait || in_flight_.size() > most)
      while (in_flight_.size() > left) pop();
    while (in_flight_.size() > 2 && in_flight_seconds_ > 2 * longest_launch) pop();
  }
  if (ended.event() == nullptr) return;
  // Outside the lock: another thread's launch need not wait for this one's.
  ended.event.wait();
  ended.pace->learn(seconds_of(ended), ended.items);
}

Pace& State::pace_of(const std::string& kernel) {
  const std::lock_guard guard(main_.pace_lock_);
  return main_.paces_[kernel];
}

std::uint64_t State::launches() {
  const std::lock_guard guard(main_.pace_lock_);
  std::uint64_t all = 0;
  for (const auto& [kernel, pace] : main_.paces_) all += pace.launches();
  return all;
}

}  // namespace vdvr::opencl
