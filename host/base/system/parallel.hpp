// Loops over host threads whose progress and exceptions reach the caller, and which end when a stop is
// requested.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {

/// Runs body(i) for 0 <= i < n on all cores. `progress` is called from the calling thread only, and may throw
/// to stop.
template <class Body>
void parallel_for(std::int64_t n, const Progress& progress, const std::string& stage, Body&& body) {
  std::atomic<std::int64_t> next{0}, done{0};
  std::atomic<bool> stop{false};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto fail = [&] {
    const std::lock_guard guard(failure_lock);
    if (!failure) failure = std::current_exception();
    stop = true;
  };
  const auto work = [&](bool reports) {
    try {
      for (std::int64_t i = next++; i < n && !stop; i = next++) {
        throw_if_stopped();
        body(i);
        ++done;
        if (reports) report(progress, stage, static_cast<double>(done) / static_cast<double>(n));
      }
    } catch (...) {
      fail();
    }
  };
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  const std::int64_t threads = std::min<std::int64_t>(cores, n);
  std::vector<std::thread> pool;
  try {
    for (std::int64_t t = 1; t < threads; ++t) pool.emplace_back(work, false);
  } catch (const std::exception&) {  // no thread or memory to be had: those that run, and this one, do it all
  }
  work(true);
  for (auto& t : pool) t.join();
  if (failure) std::rethrow_exception(failure);
}

/// What is left to do of one part of a loop once it is computed.
using Take = std::function<void()>;

/// compute(strand, i) for 0 <= i < n, in so many threads of their own at once: strand l computes l, l +
/// strands and so on, one after another. What each returns the calling thread calls, in the order of i; no
/// strand is more than two parts ahead of it. Of one strand the calling thread does all.
void in_strands(std::int64_t n, std::int64_t strands,
                const std::function<Take(std::size_t strand, std::int64_t i)>& compute);

}  // namespace vdvr
