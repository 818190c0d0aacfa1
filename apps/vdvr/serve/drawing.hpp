// Frames in turn: one thread draws, and of what one client asks only the newest counts. Called by server.cpp.
#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <string>
#include <thread>

#include "vdvr/expert/live_events.hpp"
#include "vdvr/expert/live_renderer.hpp"

namespace vdvr::cli {

class Drawing {
 public:
  enum class Outcome { drawn, replaced, busy, failed, ending };
  struct Answer {
    Outcome outcome = Outcome::ending;
    LiveFrame frame;
    std::string error;  ///< of failed
  };
  /// Clients whose requests wait at a time.
  static constexpr std::size_t kMostWaiting = 8;

  /// `renderer` belongs to the drawing thread from now on.
  explicit Drawing(LiveRenderer& renderer);
  ~Drawing();
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  /// The frame, in time. One of the same client that still waits is answered by `replaced`, and gives its
  /// place in the row.
  std::future<Answer> ask(const std::string& client, const LiveState& state, bool moving);
  /// All that wait, and all that ask from now on, are answered by `ending`.
  void end();

 private:
  struct Job {
    std::string client;
    LiveState state;
    bool moving = false;
    std::promise<Answer> answer;
  };
  void work();
  [[nodiscard]] Answer drawn(const Job& job);

  LiveRenderer& renderer_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> waiting_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace vdvr::cli
