#include "apps/vdvr/serve/access.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>

#include "vdvr/error.hpp"

namespace vdvr::cli {
namespace {

bool is_one_of(char c, std::string_view set) { return set.find(c) != std::string_view::npos; }

bool is_word(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return out;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_one_of(text.front(), " \t")) text.remove_prefix(1);
  while (!text.empty() && is_one_of(text.back(), " \t")) text.remove_suffix(1);
  return text;
}

/// The text before `end`, which is taken away with it; nothing where there is no `end`.
std::optional<std::string_view> taken(std::string_view& text, std::string_view end) {
  const auto at = text.find(end);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view before = text.substr(0, at);
  text.remove_prefix(at + end.size());
  return before;
}

bool read_request_line(std::string_view line, RequestHead& head) {
  const auto method = taken(line, " "), target = taken(line, " ");
  if (!method || !target || (line != "HTTP/1.1" && line != "HTTP/1.0")) return false;
  // Everything that we serve has such a name; a query, an escape or a `..` is none of them.
  const bool plain =
      std::all_of(target->begin(), target->end(), [](char c) { return is_word(c) || is_one_of(c, "/._-"); });
  if (target->empty() || target->front() != '/' || target->size() > kMostTarget || !plain) return false;
  head.method = *method;
  head.target = *target;
  head.close = line == "HTTP/1.0";
  return head.method == "GET" || head.method == "HEAD" || head.method == "POST";
}

bool read_length(std::string_view value, RequestHead& head) {
  if (value.empty() || value.size() > 9) return false;
  head.content_length = 0;
  for (const char c : value) {
    if (c < '0' || c > '9') return false;
    head.content_length = head.content_length * 10 + static_cast<std::uint64_t>(c - '0');
  }
  return true;
}

/// Headers that count, each at most once.
struct Seen {
  bool host = false, origin = false, type = false, length = false;
};

bool read_header(std::string_view line, RequestHead& head, Seen& seen) {
  const auto name = taken(line, ":");
  const auto is_token = [](char c) { return is_word(c) || is_one_of(c, "!#$%&'*+-.^_`|~"); };
  if (!name || name->empty() || !std::all_of(name->begin(), name->end(), is_token)) return false;
  const std::string_view value = trimmed(line);
  if (std::any_of(value.begin(), value.end(), [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte < 0x20 ? c != '\t' : byte == 0x7f;
      }))
    return false;
  const std::string which = lower(*name);
  const auto once = [&](bool& flag, std::string& to) {
    to = value;
    return !std::exchange(flag, true);
  };
  if (which == "host") return once(seen.host, head.host);
  if (which == "origin") return once(seen.origin, head.origin);
  if (which == "content-type") return once(seen.type, head.content_type);
  if (which == "content-length") return !std::exchange(seen.length, true) && read_length(value, head);
  if (which == "connection" && lower(value) == "close") head.close = true;
  // A body in pieces, or packed, has no length that could be checked before it is read.
  return which != "transfer-encoding" && which != "content-encoding";
}

bool is_address(const std::string& text) {
  std::array<unsigned char, 16> bytes{};
  return ::inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
}

/// Without the port.
std::optional<std::string> host_name(std::string_view host) {
  std::string_view name = host, port;
  if (!host.empty() && host.front() == '[') {
    const auto end = host.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
  } else if (const auto colon = host.find(':'); colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  if (!port.empty()) {
    if (port.front() != ':' || port.size() < 2 || port.size() > 6) return std::nullopt;
    port.remove_prefix(1);
    if (!std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; }))
      return std::nullopt;
  }
  return lower(name);
}

/// "/TOKEN/..." in two; the second part is empty but for what follows the slash.
std::optional<std::pair<std::string_view, std::string_view>> token_and_rest(std::string_view target) {
  if (target.empty() || target.front() != '/') return std::nullopt;
  target.remove_prefix(1);
  const auto token = taken(target, "/");
  if (!token) return std::nullopt;
  return std::pair{*token, target};
}

}  // namespace

std::optional<RequestHead> parse_head(std::string_view text) {
  if (text.size() > kMostHead) return std::nullopt;
  RequestHead head;
  const auto first = taken(text, "\r\n");
  if (!first || !read_request_line(*first, head)) return std::nullopt;
  Seen seen;
  while (true) {
    const auto line = taken(text, "\r\n");
    if (!line) return std::nullopt;
    if (line->empty()) break;
    if (!read_header(*line, head, seen)) return std::nullopt;
  }
  if (!text.empty() || (head.method != "POST" && head.content_length > 0)) return std::nullopt;
  return head;
}

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw ResourceError("the system gives no random numbers, so that no address can be kept secret");
  std::string token;
  for (const unsigned char b : bytes) token += fmt::format("{:02x}", b);
  return token;
}

bool same_text(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned differences = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    differences |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  // Read through a volatile, so that no compiler leaves the loop early.
  const volatile unsigned seen = differences;
  return seen == 0;
}

bool is_allowed_host(std::string_view host, const std::vector<std::string>& names) {
  const auto name = host_name(host);
  if (!name) return false;
  return is_address(*name) ||
         std::any_of(names.begin(), names.end(), [&](const std::string& n) { return lower(n) == *name; });
}

int refusal_of(const RequestHead& head, const Access& access) {
  if (!is_allowed_host(head.host, access.names)) return 403;
  // A page of ours says where it is from, or nothing; any other page is a stranger's.
  if (!head.origin.empty() && lower(head.origin) != "http://" + lower(head.host)) return 403;
  const auto parts = token_and_rest(head.target);
  // One answer for a wrong token and for a wrong name: who has no token learns nothing.
  if (!parts || !same_text(parts->first, access.token)) return 404;
  const Target target = target_of(head.target);
  if (target.asked == Resource::nothing) return 404;
  if ((head.method == "POST") != (target.asked == Resource::frame)) return 405;
  if (head.method != "POST") return 0;
  // Only such a type makes a browser ask before it sends what another page wants to be sent.
  if (lower(head.content_type) != "application/json") return 415;
  return head.content_length > kMostBody ? 413 : 0;
}

Target target_of(std::string_view text) {
  const auto parts = token_and_rest(text);
  if (!parts) return {};
  std::string_view rest = parts->second;
  if (rest.empty()) return {Resource::page, {}, false};
  if (rest == "page.js") return {Resource::script, {}, false};
  if (rest == "page.css") return {Resource::style, {}, false};
  if (rest == "scene.json") return {Resource::scene, {}, false};
  const auto frame = taken(rest, "/"), client = taken(rest, "/");
  if (!frame || *frame != "frame" || !client || client->empty() || client->size() > 32) return {};
  if (!std::all_of(client->begin(), client->end(), is_word)) return {};
  if (rest != "moving" && rest != "still") return {};
  return {Resource::frame, std::string(*client), rest == "moving"};
}

}  // namespace vdvr::cli
