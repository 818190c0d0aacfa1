// Who may ask for what: the head of an HTTP request, read strictly, and whether it is answered. Pure
// functions; tests/fuzz/serve_fuzz.cpp drives them. Called by connection.cpp and server.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vdvr::cli {

/// What a request says before its body; headers that mean nothing here are gone.
struct RequestHead {
  std::string method, target, host, origin, content_type;
  std::uint64_t content_length = 0;
  bool close = false;  ///< the connection ends with the answer
};

inline constexpr std::size_t kMostHead = 16384, kMostTarget = 200, kMostBody = 65536;

/// `text`: from the request line to the empty line, both included. Nothing where it is no HTTP/1 request, a
/// header is malformed, one that must be single comes twice, or the body has no plain length.
std::optional<RequestHead> parse_head(std::string_view text);

struct Access {
  std::string token;
  std::vector<std::string> names;  ///< hosts that may be asked for by name, beside IP addresses
};
/// 128 random bits in hexadecimal digits. Throws ResourceError.
std::string random_token();
/// Takes the same time wherever two texts of one length differ.
bool same_text(std::string_view a, std::string_view b);
/// Whether a `Host` is an address, or one of the names. A name of a stranger that leads here is how web pages
/// would get at servers on this machine.
bool is_allowed_host(std::string_view host, const std::vector<std::string>& names);

/// 0, or the status of the refusal.
int refusal_of(const RequestHead& head, const Access& access);

/// What follows the token in a target.
enum class Resource { nothing, page, script, style, scene, frame };
struct Target {
  Resource asked = Resource::nothing;
  std::string client;   ///< of a frame: 1 to 32 letters and digits
  bool moving = false;  ///< of a frame
};
/// Of "/TOKEN/", "/TOKEN/page.js", "/TOKEN/page.css", "/TOKEN/scene.json" and "/TOKEN/frame/CLIENT/moving" or
/// "still". The token is not looked at.
Target target_of(std::string_view target);

}  // namespace vdvr::cli
