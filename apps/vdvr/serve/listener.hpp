// A port, and the threads that serve its connections. Called by server.cpp.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace vdvr::cli {

bool is_v6(const std::string& address);

class Listener {
 public:
  /// `address`: an IP address; `port` 0: one that is free. Throws InputError for what is no address of this
  /// machine, ResourceError for a port that cannot be had.
  Listener(const std::string& address, int port);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// The socket of the next connection, which the caller closes; nothing where none comes for so long. Throws
  /// ResourceError where the system ends the listening.
  [[nodiscard]] std::optional<int> next(std::chrono::milliseconds wait) const;

 private:
  int socket_ = -1, port_ = 0;
};

/// Threads, made at once, that serve sockets in turn and close them.
class Pool {
 public:
  using Serve = std::function<void(int socket)>;
  /// As many as the system gives. Throws ResourceError where it gives none.
  Pool(int threads, Serve serve);
  /// Waits for those that are served, and closes those that wait.
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  /// Sockets that are served or wait.
  [[nodiscard]] int open() const { return open_; }
  void add(int socket);

 private:
  void work();

  Serve serve_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<int> waiting_;
  bool ended_ = false;
  std::atomic<int> open_{0};
  std::vector<std::thread> threads_;
};

}  // namespace vdvr::cli
