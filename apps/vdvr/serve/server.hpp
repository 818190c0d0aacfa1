// `vdvr serve` as a server: who is let in (access.hpp), what a connection may cost (connection.hpp), whose
// frame is next (drawing.hpp), what is answered. HTTP/1.1 is spoken by ourselves: cpp-httplib reads heads
// without end, and a slow one for ever (docs/serve.md). Called by commands/serve.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vdvr/expert/live_renderer.hpp"

namespace vdvr::cli {

struct ServerOptions {
  std::string address = "127.0.0.1";  ///< an IP address
  int port = 0;                       ///< 0: one that is free
  std::vector<std::string> names;     ///< by which a `Host` may call us, beside addresses
  std::string scene;                  ///< scene.json, what the page is told
};

class Server {
 public:
  /// Takes the port. Throws InputError for what is no address of this machine, ResourceError for a port that
  /// cannot be had.
  Server(LiveRenderer& renderer, const ServerOptions& options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:PORT/TOKEN/"
  [[nodiscard]] std::string address() const;
  /// Answers until a stop is requested (vdvr/expert/stop.hpp); then no connection is left. Throws
  /// ResourceError if the system ends it.
  void run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr::cli
