// One connection of a client, with an end to everything: how long it may be idle, how long a request and an
// answer may take, how much may be sent. The HTTP library reads and writes through it. Called by server.cpp.
#pragma once

#include <httplib.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <list>
#include <mutex>
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
  /// Closes the oldest stranger's connection, if there is one: its thread ends soon.
  void turn_one_away();

 private:
  std::mutex mutex_;
  std::list<Entry> entries_;
};

class Connection : public httplib::Stream {
 public:
  Connection(int socket, const std::atomic<bool>& ending) : socket_(socket), ending_(ending) {}

  enum class Head { good, bad, closed };
  /// Waits for the next request's head, and hands the library no more of it than plain_head.
  Head receive(RequestHead& head);
  /// Whether the library has read the whole body, so that another request may follow.
  [[nodiscard]] bool is_drained() const { return body_left_ == 0; }
  /// A refusal without a body worth reading.
  void refuse(int status);

  [[nodiscard]] bool is_readable() const override { return true; }
  [[nodiscard]] bool is_writable() const override { return true; }
  ssize_t read(char* to, std::size_t size) override;
  ssize_t write(const char* from, std::size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  using Clock = std::chrono::steady_clock;
  /// False at the deadline, or when the server ends.
  [[nodiscard]] bool wait(short events, Clock::time_point deadline) const;
  /// Bytes read, 0 at the end of the stream, -1 at the deadline.
  ssize_t fetch(char* to, std::size_t size, Clock::time_point deadline);

  int socket_;
  const std::atomic<bool>& ending_;
  std::string pending_;  ///< received, not yet read
  std::string head_;     ///< for the library
  std::size_t head_read_ = 0;
  std::uint64_t body_left_ = 0;
  Clock::time_point deadline_{};
};

}  // namespace vdvr::cli
