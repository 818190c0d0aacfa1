#include "apps/vdvr/serve/server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/vdvr/serve/connection.hpp"
#include "apps/vdvr/serve/drawing.hpp"
#include "apps/vdvr/serve/encode.hpp"
#include "apps/vdvr/serve/page.hpp"
#include "vdvr/error.hpp"
#include "vdvr/live_json.hpp"
#include "vdvr/stop.hpp"

namespace vdvr::cli {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

// A browser opens up to six connections a host. More threads than a few browsers need only serve strangers.
constexpr int kThreads = 24, kMostOpen = 48;
// Sixty frames a second for each of a few clients; a burst for a page that loads.
constexpr double kRequestsPerSecond = 400, kBurst = 800;
constexpr std::size_t kMostBody = 65536;

const httplib::Headers& safe_headers() {
  static const httplib::Headers headers{{"Content-Security-Policy",
                                         "default-src 'none'; script-src 'self'; style-src 'self'; img-src "
                                         "'self' blob: data:; connect-src 'self'; "
                                         "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
                                        {"X-Content-Type-Options", "nosniff"},
                                        {"X-Frame-Options", "DENY"},
                                        {"Referrer-Policy", "no-referrer"},  // the address is the key
                                        {"Cross-Origin-Resource-Policy", "same-origin"},
                                        {"Cross-Origin-Opener-Policy", "same-origin"},
                                        {"Cache-Control", "no-store"}};
  return headers;
}

/// How often anybody may ask: a bucket that fills at a steady rate.
class Allowance {
 public:
  bool take() {
    const std::scoped_lock lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    left_ = std::min(kBurst, left_ + kRequestsPerSecond * std::chrono::duration<double>(now - at_).count());
    at_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  std::mutex mutex_;
  double left_ = kBurst;
  std::chrono::steady_clock::time_point at_ = std::chrono::steady_clock::now();
};

/// The library's accepting and parsing, with our connections.
class Listener : public httplib::Server {
 public:
  explicit Listener(Access access) : access_(std::move(access)) {}

  void begin_ending() { ending_ = true; }
  [[nodiscard]] const std::atomic<bool>& ending() const { return ending_; }
  [[nodiscard]] const Access& access() const { return access_; }
  Connections& connections() { return connections_; }

 private:
  // Called by a thread of Threads for every connection.
  bool process_and_close_socket(socket_t socket) override;
  void serve(Connection& connection, Connections::Place place);

  Access access_;
  Allowance allowance_;
  Connections connections_;
  std::atomic<bool> ending_{false};
};

thread_local bool turned_away = false;

/// The library's pool, that takes no more than it can hold.
class Threads : public httplib::TaskQueue {
 public:
  explicit Threads(Connections& connections) : connections_(connections), pool_(kThreads) {}

  void enqueue(std::function<void()> task) override {
    const int open = ++open_;
    const auto run = [this, task] {
      task();
      --open_;
    };
    if (open > kMostOpen) {
      turned_away = true;
      run();
      turned_away = false;
      return;
    }
    if (open > kThreads) connections_.turn_one_away();
    pool_.enqueue(run);
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  Connections& connections_;
  std::atomic<int> open_{0};
  httplib::ThreadPool pool_;
};

bool Listener::process_and_close_socket(socket_t socket) {
  if (!turned_away && !ending_) {
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const auto place = connections_.add(socket);
    Connection connection(socket, ending_);
    try {
      serve(connection, place);
    } catch (const std::exception&) {
      // A connection that fails ends; the others do not.
    }
    connections_.remove(place);
  }
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
  return true;
}

void Listener::serve(Connection& connection, Connections::Place place) {
  bool closed = false;
  while (!closed && !ending_) {
    RequestHead head;
    switch (connection.receive(head)) {
      case Connection::Head::closed:
        return;
      case Connection::Head::bad:
        return connection.refuse(400);
      case Connection::Head::good:
        break;
    }
    if (!allowance_.take()) return connection.refuse(429);
    if (const int status = refusal_of(head, access_); status != 0) return connection.refuse(status);
    connections_.mark_known(place);
    if (!process_request(connection, head.close, closed, nullptr) || !connection.is_drained()) return;
  }
}

/// Only what lets a port be taken again soon after its server has ended; never two servers on one port.
void set_reuse(socket_t socket) {
  const int on = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
}

bool is_v6(const std::string& address) { return address.find(':') != std::string::npos; }

void check_address(const std::string& address) {
  in6_addr bytes{};
  if (::inet_pton(is_v6(address) ? AF_INET6 : AF_INET, address.c_str(), &bytes) != 1)
    throw InputError(
        fmt::format("--address {} is not an IP address; 127.0.0.1 is this machine alone", address));
}

const char* media_type(Asked asked) {
  switch (asked) {
    case Asked::script:
      return "text/javascript; charset=utf-8";
    case Asked::style:
      return "text/css; charset=utf-8";
    case Asked::scene:
      return "application/json";
    default:
      return "text/html; charset=utf-8";
  }
}

}  // namespace

struct Server::Impl {
  LiveRenderer& renderer;
  ServerOptions options;
  LiveState first;
  Listener listener;
  Drawing drawing;
  int port = 0;

  Impl(LiveRenderer& r, const ServerOptions& o)
      : renderer(r),
        options(o),
        first(first_state(r.scene(), 512, 512)),
        listener(Access{random_token(), o.names}),
        drawing(r) {
    check_address(options.address);
    listener.set_socket_options(set_reuse);
    listener.set_default_headers(safe_headers());
    listener.set_payload_max_length(kMostBody);
    listener.new_task_queue = [this] { return new Threads(listener.connections()); };
    listener.set_exception_handler([](const httplib::Request&, httplib::Response& res, std::exception_ptr) {
      res.status = 500;
      res.set_content("this cannot be answered\n", "text/plain");
    });
    listener.Get("/.*", [this](const httplib::Request& req, httplib::Response& res) { give(req, res); });
    listener.Post("/.*", [this](const httplib::Request& req, httplib::Response& res,
                                const httplib::ContentReader& read) {
      std::string body;
      const bool whole = read([&](const char* data, std::size_t size) {
        body.append(data, size);
        return body.size() <= kMostBody;
      });
      if (whole) draw(target_of(req.path), body, res);
      else res.status = 400;
    });
    take_port();
  }

  void take_port() {
    errno = 0;
    if (options.port == 0) port = listener.bind_to_any_port(options.address);
    else port = listener.bind_to_port(options.address, options.port) ? options.port : -1;
    if (port > 0) return;
    const int error = errno;
    if (error == EADDRNOTAVAIL)
      throw InputError(fmt::format("--address {} is none of this machine's", options.address));
    throw ResourceError(fmt::format("--port {} of {} cannot be had{}; choose another, or leave it out",
                                    options.port, options.address,
                                    error == EACCES       ? ": ports below 1024 are root's"
                                    : error == EADDRINUSE ? ": it is in use"
                                                          : ""));
  }

  void give(const httplib::Request& req, httplib::Response& res) const {
    const Asked asked = target_of(req.path).asked;
    const std::string_view text = asked == Asked::scene    ? std::string_view(options.scene)
                                  : asked == Asked::script ? page_file("page.js")
                                  : asked == Asked::style  ? page_file("page.css")
                                                           : page_file("page.html");
    res.set_content(text.data(), text.size(), media_type(asked));
  }

  static void refuse(httplib::Response& res, int status, const std::string& why) {
    res.status = status;
    res.set_content(why + "\n", "text/plain; charset=utf-8");
  }

  /// A line of JSON, then the picture.
  void draw(const Target& target, const std::string& body, httplib::Response& res) {
    LiveState state;
    try {
      state = live_request(body, renderer.scene(), first);
    } catch (const InputError& e) {
      return refuse(res, 400, e.what());
    }
    const Drawing::Answer answer = drawing.ask(target.client, state, target.moving).get();
    switch (answer.outcome) {
      case Drawing::Outcome::replaced:
        return refuse(res, 409, "a newer request took its place");
      case Drawing::Outcome::busy:
        return refuse(res, 503, "too many pages are open");
      case Drawing::Outcome::ending:
        return refuse(res, 503, "the server ends");
      case Drawing::Outcome::failed:
        return refuse(res, 500, answer.error);
      case Drawing::Outcome::drawn:
        break;
    }
    const LiveFrame& f = answer.frame;
    Json line{{"type", target.moving ? "image/jpeg" : "image/png"},
              {"width", f.image.width},
              {"height", f.image.height},
              {"full", f.full},
              {"seconds", f.seconds},
              {"state", Json::parse(to_json(state))}};
    if (!target.moving)
      line["command"] = render_words(state.view, renderer.scene(), state.width, state.height);
    res.set_content(line.dump() + "\n" + (target.moving ? jpeg_bytes(f.image) : png_bytes(f.image)),
                    "application/octet-stream");
  }
};

Server::Server(LiveRenderer& renderer, const ServerOptions& options)
    : impl_(std::make_unique<Impl>(renderer, options)) {}
Server::~Server() = default;

int Server::port() const { return impl_->port; }

std::string Server::address() const {
  const std::string& asked = impl_->options.address;
  // What listens everywhere is reached from here by the loopback.
  const std::string host = asked == "0.0.0.0" ? "127.0.0.1"
                           : asked == "::"    ? "[::1]"
                           : is_v6(asked)     ? "[" + asked + "]"
                                              : asked;
  return fmt::format("http://{}:{}/{}/", host, impl_->port, impl_->listener.access().token);
}

void Server::run() {
  std::atomic<bool> listening{true};
  std::thread thread([&] {
    impl_->listener.listen_after_bind();
    listening = false;
  });
  while (stop_requested() == 0 && listening) std::this_thread::sleep_for(20ms);
  impl_->drawing.end();
  impl_->listener.begin_ending();
  impl_->listener.stop();
  thread.join();
  if (stop_requested() == 0) throw ResourceError("the system ended the listening for connections");
}

}  // namespace vdvr::cli
