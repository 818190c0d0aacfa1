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

constexpr const char* kSafeHeaders =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: "
    "data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n"
    "Referrer-Policy: no-referrer\r\n"  // the address is the key
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cache-Control: no-store\r\n";

const char* name_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 409:
      return "Conflict";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 429:
      return "Too Many Requests";
    case 500:
      return "Internal Server Error";
    case 503:
      return "Service Unavailable";
    default:
      return "Bad Request";
  }
}

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

void Connections::make_way(std::ptrdiff_t wanted) {
  const std::scoped_lock lock(mutex_);
  wanted -= std::count_if(entries_.begin(), entries_.end(), [](const Entry& e) { return e.leaving; });
  for (Entry& e : entries_) {
    if (wanted <= 0) return;
    if (e.known || e.leaving) continue;
    e.leaving = true;
    ::shutdown(e.socket, SHUT_RDWR);
    --wanted;
  }
}

// --- one ---

Answer refusal(int status, const std::string& why) {
  return {status, "text/plain; charset=utf-8", (why.empty() ? name_of(status) : why) + "\n"};
}

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

bool Connection::fetch(Clock::time_point deadline) {
  std::array<char, 4096> chunk{};
  while (wait(POLLIN, deadline)) {
    const ssize_t got = ::recv(socket_, chunk.data(), chunk.size(), MSG_DONTWAIT);
    if (got > 0) pending_.append(chunk.data(), static_cast<std::size_t>(got));
    if (got >= 0) return got > 0;
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return false;
  }
  return false;
}

Connection::Received Connection::receive(RequestHead& head) {
  deadline_ = Clock::now() + (pending_.empty() ? kIdle : kRequest);
  std::size_t end;
  while ((end = pending_.find("\r\n\r\n")) == std::string::npos) {
    if (pending_.size() > kMostHead) return Received::nonsense;
    const bool first = pending_.empty();
    if (!fetch(deadline_)) return Received::nothing;
    if (first) deadline_ = Clock::now() + kRequest;
  }
  const auto parsed = parse_head(std::string_view(pending_).substr(0, end + 4));
  pending_.erase(0, end + 4);
  if (!parsed) return Received::nonsense;
  head = *parsed;
  return Received::request;
}

std::optional<std::string> Connection::receive_body(const RequestHead& head) {
  while (pending_.size() < head.content_length)
    if (!fetch(deadline_)) return std::nullopt;
  const auto size = static_cast<std::size_t>(head.content_length);
  std::string body = pending_.substr(0, size);
  pending_.erase(0, size);
  return body;
}

bool Connection::send(const Answer& answer, bool with_body, bool close) {
  std::string text = fmt::format("HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{}{}\r\n",
                                 answer.status, name_of(answer.status), answer.type, answer.body.size(),
                                 kSafeHeaders, close ? "Connection: close\r\n" : "");
  if (with_body) text += answer.body;
  return write(text);
}

bool Connection::write(const std::string& text) {
  const auto deadline = Clock::now() + kAnswer;
  std::size_t sent = 0;
  while (sent < text.size()) {
    if (!wait(POLLOUT, deadline)) return false;
    const ssize_t n = ::send(socket_, text.data() + sent, text.size() - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n > 0) sent += static_cast<std::size_t>(n);
    else if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return false;
  }
  return true;
}

}  // namespace vdvr::cli
