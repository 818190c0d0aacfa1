// Progress on stderr and the user's wish to stop. A bar with rate and time left on a terminal, one line per
// stage otherwise. Every command makes one ProgressLine and hands its callback to the library.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/stop.hpp"  // for every report of progress, and before every output

namespace vdvr::cli {

/// Installs the handlers of SIGINT and SIGTERM, which ask the library to stop; see vdvr/expert/stop.hpp. Work
/// that has not unwound 0.6 s later is in a call that cannot be left, such as the compilation of a kernel:
/// the process then ends without unwinding, its temporary files removed. A pipe that nobody reads any more is
/// a failing write, not the end of the process. `who`: for the message, "vdvr build".
void catch_signals(const std::string& who);
/// What to say instead of "interrupted" when the process ends without unwinding; called by another thread.
/// None: take it back.
void explain_interruption(std::function<std::string()> message);
/// Writes to stderr. That nobody reads it is no reason to stop.
void say(const std::string& text);

/// Times a step under a name.
template <class Step>
auto timed(std::map<std::string, double>& seconds, const std::string& name, Step&& step) {
  const auto start = std::chrono::steady_clock::now();
  auto result = step();
  seconds[name] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

class ProgressLine {
 public:
  ProgressLine(std::string who, bool quiet);
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// May be called from any thread; valid as long as this object lives.
  Progress callback();
  /// Takes the bar off the terminal, so that other text may follow.
  void clear();
  /// Seconds of each stage so far: a stage lasts until another one reports, the latest until now.
  [[nodiscard]] std::map<std::string, double> seconds();

 private:
  using Clock = std::chrono::steady_clock;
  struct Stage {
    Clock::time_point first, last;
  };
  void end_latest(Clock::time_point now);

  void report(const std::string& stage, double fraction);
  void draw(const std::string& stage, double fraction, Clock::time_point now);

  std::string who_;
  bool quiet_, terminal_, drawn_ = false;
  std::mutex mutex_;
  std::map<std::string, Stage> stages_;
  std::string latest_;
  Clock::time_point drawn_at_{};
};

}  // namespace vdvr::cli
