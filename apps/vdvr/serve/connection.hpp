// One connection of a client by HTTP/1.1, with an end to everything: how long it may be idle, how long a
// request and an answer may take, how much may be sent. Called by server.cpp.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include "apps/vdvr/serve/access.hpp"

namespace vdvr::cli {

/// The connections that are open. When there are too many, the oldest that never knew the token has to go.
class Connections {
 public:
  struct Entry {
    int socket = -1;
    bool known = false, leaving = false;
  };
  using Place = std::list<Entry>::iterator;

  Place add(int socket);
  void remove(Place place);
  void mark_known(Place place);
  /// Sees to it that so many connections are about to end, as far as there are strangers' ones: the oldest
  /// first.
  void make_way(std::ptrdiff_t wanted);

 private:
  std::mutex mutex_;
  std::list<Entry> entries_;
};

/// What is answered.
struct Answer {
  int status = 200;
  std::string type, body;  ///< the media type, and its bytes
};
/// A line of text: `why`, or the status's own name.
Answer refusal(int status, const std::string& why = "");

class Connection {
 public:
  Connection(int socket, const std::atomic<bool>& ending) : socket_(socket), ending_(ending) {}

  enum class Received { request, nonsense, nothing };
  /// Waits for the next request's head. `nothing` where the client or the server ends, or time is over.
  Received receive(RequestHead& head);
  /// The body that the head announced; nothing where it does not come in time.
  std::optional<std::string> receive_body(const RequestHead& head);
  /// False where the client does not take it. Without the body for the method HEAD.
  bool send(const Answer& answer, bool with_body, bool close);

 private:
  using Clock = std::chrono::steady_clock;
  /// False at the deadline, or when the server ends.
  [[nodiscard]] bool wait(short events, Clock::time_point deadline) const;
  /// Appends what comes to what is pending; false at the end of the stream, and at the deadline.
  bool fetch(Clock::time_point deadline);
  bool write(const std::string& text);

  int socket_;
  const std::atomic<bool>& ending_;
  std::string pending_;  ///< received, not yet read
  Clock::time_point deadline_{};
};

}  // namespace vdvr::cli
