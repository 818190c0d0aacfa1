#include "vdvr/expert/stop.hpp"

#include <atomic>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

std::atomic<int> wanted{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler writes it");

}  // namespace

void request_stop(int reason) noexcept { wanted.store(reason, std::memory_order_relaxed); }

int stop_requested() noexcept { return wanted.load(std::memory_order_relaxed); }

void throw_if_stopped() {
  if (const int code = stop_requested(); code != 0) throw Interrupted(code);
}

}  // namespace vdvr
