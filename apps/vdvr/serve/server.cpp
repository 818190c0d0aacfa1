#include "apps/vdvr/serve/server.hpp"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string_view>

#include "apps/vdvr/serve/connection.hpp"
#include "apps/vdvr/serve/drawing.hpp"
#include "apps/vdvr/serve/listener.hpp"
#include "apps/vdvr/serve/page.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/live_json.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::cli {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

// A browser opens up to six connections a host. More threads than a few browsers need only serve strangers.
constexpr int kThreads = 24, kMostOpen = 48;
// Sixty frames a second for each of a few clients; a burst for a page that loads.
constexpr double kRequestsPerSecond = 400, kBurst = 800;

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

// Fine enough for a picture that the next one replaces at once.
constexpr int kQuality = 85;

struct End {
  void operator()(void* handle) const { tjDestroy(handle); }
};
struct Free {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

/// While it moves; at rest it is a PNG. Throws ResourceError.
std::string jpeg_bytes(const Image& image) {
  const std::unique_ptr<void, End> jpeg(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool good = jpeg && tjCompress2(jpeg.get(), image.rgb.data(), static_cast<int>(image.width), 0,
                                        static_cast<int>(image.height), TJPF_RGB, &bytes, &size, TJSAMP_420,
                                        kQuality, TJFLAG_FASTDCT) == 0;
  const std::unique_ptr<unsigned char, Free> owned(bytes);
  if (!good)
    throw ResourceError(fmt::format("a frame of {} x {} pixels cannot be encoded as JPEG: {}", image.width,
                                    image.height, tjGetErrorStr2(jpeg.get())));
  return {reinterpret_cast<const char*>(bytes), size};
}

const char* media_type(Resource asked) {
  switch (asked) {
    case Resource::script:
      return "text/javascript; charset=utf-8";
    case Resource::style:
      return "text/css; charset=utf-8";
    case Resource::scene:
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
  Access access;
  Listener listener;
  Allowance allowance;
  Connections connections;
  std::atomic<bool> ending{false};
  Drawing drawing;

  Impl(LiveRenderer& r, const ServerOptions& o)
      : renderer(r),
        options(o),
        first(first_state(r.scene(), 512, 512)),
        access{random_token(), o.names},
        listener(o.address, o.port),
        drawing(r) {}

  void end() {
    drawing.end();
    ending = true;
  }

  /// Answers what comes over a connection, until one of its ends has enough.
  void serve(int socket) {
    const auto place = connections.add(socket);
    try {
      Connection connection(socket, ending);
      while (answer_next(connection, place)) continue;
    } catch (const std::exception&) {
      // A connection that fails ends; the others do not.
    }
    connections.remove(place);
  }

  /// False when the connection is to be closed.
  bool answer_next(Connection& connection, Connections::Place place) {
    RequestHead head;
    const auto refuse = [&](int status) {
      connection.send(refusal(status), head.method != "HEAD", true);
      return false;
    };
    switch (connection.receive(head)) {
      case Connection::Received::nothing:
        return false;
      case Connection::Received::nonsense:
        return refuse(400);
      case Connection::Received::request:
        break;
    }
    if (!allowance.take()) return refuse(429);
    if (const int status = refusal_of(head, access); status != 0) return refuse(status);
    connections.mark_known(place);
    const auto body = connection.receive_body(head);
    return body && connection.send(answer(head, *body), head.method != "HEAD", head.close) && !head.close;
  }

  Answer answer(const RequestHead& head, const std::string& body) {
    const Target target = target_of(head.target);
    try {
      return target.asked == Resource::frame ? draw(target, body) : file(target.asked);
    } catch (const std::exception&) {
      return refusal(500, "this cannot be answered");
    }
  }

  [[nodiscard]] Answer file(Resource asked) const {
    std::string text(asked == Resource::scene    ? std::string_view(options.scene)
                     : asked == Resource::script ? page_file("page.js")
                     : asked == Resource::style  ? page_file("page.css")
                                                 : page_file("page.html"));
    if (asked == Resource::script) text += page_file("curve.js");
    return {200, media_type(asked), std::move(text)};
  }

  /// A line of JSON, then the picture.
  Answer draw(const Target& target, const std::string& body) {
    LiveState state;
    try {
      state = live_request(body, renderer.scene(), first);
    } catch (const InputError& e) {
      return refusal(400, e.what());
    }
    const Drawing::Answer drawn = drawing.ask(target.client, state, target.moving).get();
    switch (drawn.outcome) {
      case Drawing::Outcome::replaced:
        return refusal(409, "a newer request took its place");
      case Drawing::Outcome::busy:
        return refusal(503, "too many pages are open");
      case Drawing::Outcome::ending:
        return refusal(503, "the server ends");
      case Drawing::Outcome::failed:
        return refusal(500, drawn.error);
      case Drawing::Outcome::drawn:
        break;
    }
    const LiveFrame& f = drawn.frame;
    Json line{{"type", target.moving ? "image/jpeg" : "image/png"},
              {"width", f.image.width},
              {"height", f.image.height},
              {"full", f.full},
              {"seconds", f.seconds},
              {"state", Json::parse(to_json(state))}};
    if (!target.moving)
      line["command"] = render_words(state.view, renderer.scene(), state.width, state.height);
    return {200, "application/octet-stream",
            line.dump() + "\n" + (target.moving ? jpeg_bytes(f.image) : png_bytes(f.image))};
  }
};

Server::Server(LiveRenderer& renderer, const ServerOptions& options)
    : impl_(std::make_unique<Impl>(renderer, options)) {}
Server::~Server() = default;

int Server::port() const { return impl_->listener.port(); }

std::string Server::address() const {
  const std::string& asked = impl_->options.address;
  // What listens everywhere is reached from here by the loopback.
  const std::string host = asked == "0.0.0.0" ? "127.0.0.1"
                           : asked == "::"    ? "[::1]"
                           : is_v6(asked)     ? "[" + asked + "]"
                                              : asked;
  return fmt::format("http://{}:{}/{}/", host, port(), impl_->access.token);
}

void Server::run() {
  Impl& s = *impl_;
  Pool pool(kThreads, [&s](int socket) { s.serve(socket); });
  try {
    while (stop_requested() == 0) {
      s.connections.make_way(pool.open() - kThreads);
      // Who finds no place waits with the system, and is not refused for strangers who are about to go.
      if (pool.open() >= kMostOpen) std::this_thread::sleep_for(2ms);
      else if (const auto socket = s.listener.next(20ms)) pool.add(*socket);
    }
  } catch (...) {
    s.end();
    throw;
  }
  s.end();
}

}  // namespace vdvr::cli
