#include "apps/vdvr/serve/listener.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

using namespace std::chrono_literals;

// Connections that the system keeps until they are accepted.
constexpr int kWaiting = 128;

void set_option(int socket, int level, int option, int value) {
  ::setsockopt(socket, level, option, &value, sizeof value);
}

void close_both_ways(int socket) {
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
}

union Place {
  sockaddr any;
  sockaddr_in v4;
  sockaddr_in6 v6;
};

Place place_of(const std::string& address, int port) {
  Place place{};
  place.any.sa_family = is_v6(address) ? AF_INET6 : AF_INET;
  void* bytes = is_v6(address) ? static_cast<void*>(&place.v6.sin6_addr) : &place.v4.sin_addr;
  if (::inet_pton(place.any.sa_family, address.c_str(), bytes) != 1)
    throw InputError(
        fmt::format("--address {} is not an IP address; 127.0.0.1 is this machine alone", address));
  (is_v6(address) ? place.v6.sin6_port : place.v4.sin_port) = htons(static_cast<std::uint16_t>(port));
  return place;
}

[[noreturn]] void refuse_port(const std::string& address, int port, int error) {
  if (error == EADDRNOTAVAIL)
    throw InputError(fmt::format("--address {} is none of this machine's", address));
  throw ResourceError(fmt::format("--port {} of {} cannot be had{}; choose another, or leave it out", port,
                                  address,
                                  error == EACCES       ? ": ports below 1024 are root's"
                                  : error == EADDRINUSE ? ": it is in use"
                                                        : ""));
}

}  // namespace

bool is_v6(const std::string& address) { return address.find(':') != std::string::npos; }

// --- the port ---

Listener::Listener(const std::string& address, int port) {
  Place place = place_of(address, port);
  socklen_t size = is_v6(address) ? sizeof place.v6 : sizeof place.v4;
  socket_ = ::socket(place.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  // A port can be taken again soon after its server has ended; never have two servers one port.
  set_option(socket_, SOL_SOCKET, SO_REUSEADDR, 1);
  // "::" is IPv4's addresses too.
  if (is_v6(address)) set_option(socket_, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  if (socket_ < 0 || ::bind(socket_, &place.any, size) != 0 || ::listen(socket_, kWaiting) != 0 ||
      ::getsockname(socket_, &place.any, &size) != 0) {
    const int error = errno;
    if (socket_ >= 0) ::close(socket_);
    refuse_port(address, port, error);
  }
  port_ = ntohs(is_v6(address) ? place.v6.sin6_port : place.v4.sin_port);
}

Listener::~Listener() { ::close(socket_); }

std::optional<int> Listener::next(std::chrono::milliseconds wait) const {
  pollfd look{socket_, POLLIN, 0};
  if (::poll(&look, 1, static_cast<int>(wait.count())) <= 0) return std::nullopt;
  const int accepted = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
  if (accepted >= 0) {
    set_option(accepted, IPPROTO_TCP, TCP_NODELAY, 1);
    return accepted;
  }
  switch (errno) {
    case EBADF:
    case EINVAL:
    case ENOTSOCK:
    case EOPNOTSUPP:
      throw ResourceError("the system ended the listening for connections");
    case EMFILE:
    case ENFILE:
    case ENOBUFS:
    case ENOMEM:
      std::this_thread::sleep_for(wait);  // until others have closed something
      return std::nullopt;
    default:
      return std::nullopt;  // a client that went before it was served
  }
}

// --- the threads ---

Pool::Pool(int threads, Serve serve) : serve_(std::move(serve)) {
  try {
    threads_.reserve(static_cast<std::size_t>(threads));
    while (threads-- > 0) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {
    if (threads_.empty()) throw ResourceError("the system gives no thread to serve connections");
  }
}

Pool::~Pool() {
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  for (const int socket : waiting_) close_both_ways(socket);
}

void Pool::add(int socket) {
  ++open_;
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(socket);
  changed_.notify_one();
}

void Pool::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (ended_) return;
    const int socket = waiting_.front();
    waiting_.pop_front();
    lock.unlock();
    serve_(socket);
    close_both_ways(socket);
    --open_;
  }
}

}  // namespace vdvr::cli
