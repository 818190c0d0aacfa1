#include "apps/common/progress.hpp"

#include <fmt/format.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <system_error>
#include <thread>
#include <utility>

#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::cli {
namespace {

// A child of ours that still has the handlers must not end us.
pid_t handler_owner = 0;
int wake_pipe = -1;

extern "C" void note_signal(int number) {
  const int kept = errno;
  request_stop(128 + number);
  const char wake = 0;
  if (::getpid() == handler_owner) static_cast<void>(!::write(wake_pipe, &wake, 1));
  errno = kept;
}

// Long enough for work that looks for the wish to unwind, short enough to answer within a second.
constexpr std::chrono::milliseconds patience{600};

std::mutex explanation_lock;
std::function<std::string()> explanation;

void end_when_asked(int pipe, const std::string& who) {
  char woken = 0;
  while (::read(pipe, &woken, 1) != 1)
    if (errno != EINTR) return;
  std::this_thread::sleep_for(patience);
  const int code = stop_requested();
  io::remove_temporaries();
  const std::lock_guard guard(explanation_lock);
  say(fmt::format("{}: {}\n", who, explanation ? explanation() : Interrupted(code).what()));
  ::_exit(code);
}

std::string time_text(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

void catch_signals(const std::string& who) {
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) == 0) {
    handler_owner = ::getpid();
    wake_pipe = ends[1];
    try {
      std::thread(end_when_asked, ends[0], who).detach();
    } catch (
        const std::system_error&) {  // no thread to be had: work that looks for the wish stops all the same
    }
  }
  struct sigaction action {};
  action.sa_handler = note_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;  // reads and writes go on; the next report stops the work
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

void explain_interruption(std::function<std::string()> message) {
  const std::lock_guard guard(explanation_lock);
  explanation = std::move(message);
}

void say(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

ProgressLine::ProgressLine(std::string who, bool quiet)
    : who_(std::move(who)), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress ProgressLine::callback() {
  return [this](const std::string& stage, double fraction) { report(stage, fraction); };
}

void ProgressLine::clear() {
  const std::scoped_lock lock(mutex_);
  if (drawn_) say("\r\033[K");
  drawn_ = false;
}

std::map<std::string, double> ProgressLine::seconds() {
  const std::scoped_lock lock(mutex_);
  end_latest(Clock::now());
  std::map<std::string, double> result;
  for (const auto& [name, stage] : stages_)
    result[name] = std::chrono::duration<double>(stage.last - stage.first).count();
  return result;
}

// A stage reports as it begins a piece of work, so that its last piece ends when something else begins.
void ProgressLine::end_latest(Clock::time_point now) {
  if (const auto latest = stages_.find(latest_); latest != stages_.end()) latest->second.last = now;
}

void ProgressLine::report(const std::string& stage, double fraction) {
  throw_if_stopped();
  const std::scoped_lock lock(mutex_);
  const auto now = Clock::now();
  end_latest(now);
  const auto [entry, is_new] = stages_.try_emplace(stage, Stage{now, now});
  latest_ = stage;
  if (quiet_) return;
  if (terminal_) {
    draw(stage, std::clamp(fraction, 0.0, 1.0), now);
  } else if (is_new) {
    say(fmt::format("{}: {}\n", who_, stage));
  }
}

void ProgressLine::draw(const std::string& stage, double fraction, Clock::time_point now) {
  // Ten pictures a second are enough for the eye and cost nothing.
  if (drawn_ && fraction < 1 && now - drawn_at_ < std::chrono::milliseconds(100)) return;
  constexpr int width = 30;
  const int full = static_cast<int>(fraction * width);
  const double elapsed = std::chrono::duration<double>(now - stages_.at(stage).first).count();
  std::string rate;
  if (elapsed > 0.5 && fraction > 0) {
    rate = fmt::format("  {:.3g} %/s  {} left", 100 * fraction / elapsed,
                       time_text(elapsed * (1 - fraction) / fraction));
  }
  say(fmt::format("\r\033[K{} {:<14} [{}{}] {:3.0f} %{}", who_, stage, std::string(full, '#'),
                  std::string(width - full, '.'), 100 * fraction, rate));
  drawn_ = true;
  drawn_at_ = now;
}

}  // namespace vdvr::cli
