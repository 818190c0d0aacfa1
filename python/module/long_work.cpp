#include "long_work.hpp"

#include <nanobind/stl/string.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "vdvr/expert/stop.hpp"

namespace nb = nanobind;

namespace vdvr::python {
namespace {

constexpr auto kLook = std::chrono::milliseconds(50);
// Any number but 0.
constexpr int kReason = 2;

using Reports = std::vector<std::pair<std::string, double>>;

/// What the two threads share.
class Shared {
 public:
  /// Of each stage the last word alone waits to be fetched.
  void tell(const std::string& stage, double fraction) {
    const std::lock_guard guard(lock_);
    if (!reports_.empty() && reports_.back().first == stage) reports_.back().second = fraction;
    else reports_.emplace_back(stage, fraction);
  }
  void finish() {
    const std::lock_guard guard(lock_);
    done_ = true;
    wake_.notify_one();
  }
  /// Waits for the end, or for the next look. Returns whether it is the end.
  bool wait(Reports& reports) {
    std::unique_lock guard(lock_);
    wake_.wait_for(guard, kLook, [&] { return done_; });
    reports.swap(reports_);
    return done_;
  }

 private:
  std::mutex lock_;
  std::condition_variable wake_;
  Reports reports_;
  bool done_ = false;
};

/// Signal handlers of Python, and its progress. Throws what these raise.
void attend(nb::handle progress, const Reports& reports) {
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
  if (progress.is_none()) return;
  for (const auto& [stage, fraction] : reports) progress(stage, fraction);
}

}  // namespace

std::mutex& hdf5_turn() {
  static std::mutex turn;
  return turn;
}

void run_long(nb::handle progress, const std::function<void(const Progress&)>& work) {
  Shared shared;
  std::exception_ptr failure, raised;
  std::thread worker([&] {
    try {
      work([&](const std::string& stage, double fraction) { shared.tell(stage, fraction); });
    } catch (...) {
      failure = std::current_exception();
    }
    shared.finish();
  });
  for (bool done = false; !done;) {
    Reports reports;
    {
      const nb::gil_scoped_release others_run;
      done = shared.wait(reports);
    }
    if (raised) continue;
    try {
      attend(progress, reports);
    } catch (...) {
      raised = std::current_exception();
      if (!done) request_stop(kReason);
    }
  }
  {
    const nb::gil_scoped_release others_run;
    worker.join();
  }
  if (raised) {
    request_stop(0);
    std::rethrow_exception(raised);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace vdvr::python
