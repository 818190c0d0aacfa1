#include "host/base/system/parallel.hpp"

#include <pthread.h>

#include <condition_variable>
#include <map>
#include <utility>

namespace vdvr {
namespace {

using Compute = std::function<Take(std::size_t strand, std::int64_t i)>;

class Strands {
 public:
  Strands(std::int64_t n, std::int64_t strands, const Compute& compute)
      : n_(n), strands_(strands), compute_(compute) {
    try {
      threads_.reserve(static_cast<std::size_t>(strands));
      for (std::int64_t l = 0; l < strands; ++l) threads_.emplace_back([this, l] { work(l); });
    } catch (const std::exception&) {  // no thread or memory to be had: the caller computes all of it
      end();
      ready_.clear();
      strands_ = 0;
    }
  }
  Strands(const Strands&) = delete;
  Strands& operator=(const Strands&) = delete;
  ~Strands() { end(); }

  void take_all() {
    while (taken_ < n_) {
      next()();
      {
        const std::lock_guard guard(lock_);
        ++taken_;
      }
      changed_.notify_all();
    }
  }

 private:
  // Parts that a strand has computed and nobody took.
  static constexpr std::int64_t ahead = 2;

  Take next() {
    throw_if_stopped();
    if (strands_ == 0) return compute_(0, taken_);
    std::unique_lock guard(lock_);
    changed_.wait(guard, [&] { return failure_ || ready_.contains(taken_); });
    if (failure_) std::rethrow_exception(failure_);
    return std::move(ready_.extract(taken_).mapped());
  }

  void work(std::int64_t strand) {
    // For those who look at threads: profilers, bench/replay_layer.cpp.
    pthread_setname_np(pthread_self(), ("strand " + std::to_string(strand)).c_str());
    try {
      for (std::int64_t i = strand; i < n_; i += strands_) {
        {
          std::unique_lock guard(lock_);
          changed_.wait(guard, [&] { return stop_ || i < taken_ + ahead * strands_; });
          if (stop_) return;
        }
        throw_if_stopped();
        Take take = compute_(static_cast<std::size_t>(strand), i);
        const std::lock_guard guard(lock_);
        ready_.emplace(i, std::move(take));
        changed_.notify_all();
      }
    } catch (...) {
      const std::lock_guard guard(lock_);
      if (!failure_) failure_ = std::current_exception();
      stop_ = true;
      changed_.notify_all();
    }
  }

  void end() {
    {
      const std::lock_guard guard(lock_);
      stop_ = true;
    }
    changed_.notify_all();
    for (std::thread& t : threads_) t.join();
    threads_.clear();
  }

  std::int64_t n_, strands_;
  const Compute& compute_;
  std::mutex lock_;
  std::condition_variable changed_;
  std::map<std::int64_t, Take> ready_;  // by part
  std::int64_t taken_ = 0;
  bool stop_ = false;
  std::exception_ptr failure_;
  std::vector<std::thread> threads_;
};

}  // namespace

void in_strands(std::int64_t n, std::int64_t strands, const Compute& compute) {
  const std::int64_t useful = std::min(strands, n);
  Strands(n, useful > 1 ? useful : 0, compute).take_all();
}

}  // namespace vdvr
