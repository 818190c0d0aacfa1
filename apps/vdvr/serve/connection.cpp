#include "apps/vdvr/serve/connection.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace vdvr::cli {
namespace {

using namespace std::chrono_literals;

// An idle page's connection is kept; a request and its answer are short, and over a slow line a few seconds.
constexpr auto kIdle = 15s, kRequest = 5s, kAnswer = 20s;
// How soon a thread sees that the server ends.
constexpr int kSliceMs = 100;

}  // namespace

// --- the open ones ---

Connections::Place Connections::add(int socket) {
  const std::scoped_lock lock(mutex_);
  return entries_.insert(entries_.end(), Entry{socket});
}

void Connections::remove(Place place) {
  const std::scoped_lock lock(mutex_);
  entries_.erase(place);
}

void Connections::mark_known(Place place) {
  const std::scoped_lock lock(mutex_);
  place->known = true;
}

void Connections::turn_one_away() {
  const std::scoped_lock lock(mutex_);
  const auto stranger =
      std::find_if(entries_.begin(), entries_.end(), [](const Entry& e) { return !e.known && !e.leaving; });
  if (stranger == entries_.end()) return;
  stranger->leaving = true;
  ::shutdown(stranger->socket, SHUT_RDWR);
}

// --- one ---

bool Connection::wait(short events, Clock::time_point deadline) const {
  while (!ending_) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd look{socket_, events, 0};
    const int ready = ::poll(&look, 1, static_cast<int>(std::min<std::int64_t>(left, kSliceMs)));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
  return false;
}

ssize_t Connection::fetch(char* to, std::size_t size, Clock::time_point deadline) {
  while (wait(POLLIN, deadline)) {
    const ssize_t got = ::recv(socket_, to, size, MSG_DONTWAIT);
    if (got >= 0) return got;
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return -1;
  }
  return -1;
}

Connection::Head Connection::receive(RequestHead& head) {
  std::array<char, 4096> chunk{};
  deadline_ = Clock::now() + (pending_.empty() ? kIdle : kRequest);
  std::size_t end;
  while ((end = pending_.find("\r\n\r\n")) == std::string::npos) {
    if (pending_.size() > kMostHead) return Head::bad;
    const bool first = pending_.empty();
    const ssize_t got = fetch(chunk.data(), chunk.size(), deadline_);
    if (got <= 0) return Head::closed;
    pending_.append(chunk.data(), static_cast<std::size_t>(got));
    if (first) deadline_ = Clock::now() + kRequest;
  }
  const auto parsed = parse_head(std::string_view(pending_).substr(0, end + 4));
  pending_.erase(0, end + 4);
  if (!parsed) return Head::bad;
  head = *parsed;
  head_ = plain_head(head);
  head_read_ = 0;
  body_left_ = head.content_length;
  return Head::good;
}

void Connection::refuse(int status) {
  static const std::array<std::pair<int, const char*>, 7> names{{{403, "Forbidden"},
                                                                 {404, "Not Found"},
                                                                 {405, "Method Not Allowed"},
                                                                 {413, "Content Too Large"},
                                                                 {415, "Unsupported Media Type"},
                                                                 {429, "Too Many Requests"},
                                                                 {503, "Service Unavailable"}}};
  const char* name = "Bad Request";
  for (const auto& [number, text] : names)
    if (number == status) name = text;
  const std::string answer = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: text/plain\r\nX-Content-Type-Options: nosniff\r\n"
      "Cache-Control: no-store\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{}\n",
      status, name, std::char_traits<char>::length(name) + 1, name);
  write(answer.data(), answer.size());
}

ssize_t Connection::read(char* to, std::size_t size) {
  if (head_read_ < head_.size()) {
    const std::size_t n = std::min(size, head_.size() - head_read_);
    std::copy_n(head_.data() + head_read_, n, to);
    head_read_ += n;
    return static_cast<ssize_t>(n);
  }
  size = static_cast<std::size_t>(std::min<std::uint64_t>(size, body_left_));
  if (size == 0) return 0;
  if (!pending_.empty()) {
    size = std::min(size, pending_.size());
    std::copy_n(pending_.data(), size, to);
    pending_.erase(0, size);
    body_left_ -= size;
    return static_cast<ssize_t>(size);
  }
  const ssize_t got = fetch(to, size, deadline_);
  if (got > 0) body_left_ -= static_cast<std::uint64_t>(got);
  return got;
}

ssize_t Connection::write(const char* from, std::size_t size) {
  const auto deadline = Clock::now() + kAnswer;
  std::size_t sent = 0;
  while (sent < size) {
    if (!wait(POLLOUT, deadline)) return -1;
    const ssize_t n = ::send(socket_, from + sent, size - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n > 0) sent += static_cast<std::size_t>(n);
    else if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return -1;
  }
  return static_cast<ssize_t>(size);
}

// Nothing here looks at them: who asks is told by the token.
void Connection::get_remote_ip_and_port(std::string& ip, int& port) const {
  ip.clear();
  port = 0;
}
void Connection::get_local_ip_and_port(std::string& ip, int& port) const {
  ip.clear();
  port = 0;
}

}  // namespace vdvr::cli
