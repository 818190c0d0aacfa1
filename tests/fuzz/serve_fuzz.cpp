// Requests to `vdvr serve`: the head, what it asks for, and the JSON of a frame with its events.
#include <stdexcept>

#include "apps/vdvr/serve/access.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/live_json.hpp"

namespace vdvr::fuzz {
namespace {

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

LiveScene scene() {
  LiveScene s;
  s.grid = Grid{{20, 30, 40}, {-10, -15, -20}, {1, 1, 1}};
  s.frame = frame_grid(s.grid);
  s.brightness = Brightness{0, 1, 0.1, 0.9, 0.5, 0.2, {1, 2, 3}};
  s.range = {-0.25, 1.75};
  s.histogram = {1};
  s.has_bounds = true;
  s.epsilon_abs = 0.03;
  return s;
}

std::string post(const std::string& body) {
  return std::string("POST /") + kToken +
         "/frame/a1/moving HTTP/1.1\r\nHost: 127.0.0.1:8080\r\nOrigin: http://127.0.0.1:8080\r\n"
         "Content-Type: application/json\r\nContent-Length: " +
         std::to_string(body.size()) + "\r\nConnection: keep-alive\r\nAccept: */*\r\n\r\n" + body;
}

constexpr const char* kEvents =
    R"({"state": {"mode": "slice", "slice_axis": 0, "slice_range": [0.25, 0.5], "pan": [0.1, -1],
 "clip": [-5, -5, -5, 5, 6.5, 7]},
 "events": [{"event_type": "pointer_down", "x": 10, "y": 20.5, "button": 1, "modifiers": ["Shift"]},
 {"event_type": "pointer_move", "x": 40, "y": 25}, {"event_type": "wheel", "dx": 0, "dy": -120.5},
 {"event_type": "key_down", "key": "x"}, {"event_type": "resize", "width": 640, "height": 480}]})";

std::vector<std::string> seeds(const std::filesystem::path&) {
  const LiveState first = first_state(scene(), 400, 300);
  return {std::string("GET /") + kToken + "/scene.json HTTP/1.1\r\nHost: localhost:80\r\n\r\n",
          std::string("GET /") + kToken + "/ HTTP/1.0\r\nHost: [::1]:80\r\nConnection: close\r\n\r\n",
          post(R"({"state": )" + to_json(first) + "}"),
          R"({"state": )" + to_json(first) + "}",
          post(kEvents),
          kEvents};
}

void require(bool holds, const char* what) {
  if (!holds) throw std::logic_error(what);
}

/// Whatever was asked for, the state can be drawn, and comes back from its text.
void check_state(const LiveState& state) {
  static const LiveScene s = scene();
  check_view(state.view, s);
  require(state.width >= 1 && state.width <= kMostLivePixels, "a width that cannot be drawn");
  static_cast<void>(options_of(state.view, s, state.width, state.height));
  const std::string text = to_json(state);
  require(to_json(live_request(R"({"state": )" + text + "}", s, first_state(s, 1, 1))) == text,
          "a state does not come back from its text");
}

void read_json(const std::filesystem::path& file, std::string_view json) {
  static const LiveScene s = scene();
  try {
    check_state(live_request(json, s, first_state(s, 512, 512)));
  } catch (Error& e) {
    e.add_context(file.string());
    throw;
  }
}

void read(const std::filesystem::path& file) {
  const std::string bytes = support::bytes_of(file);
  // Most mutants of a whole request have no token any more, so that their JSON is never seen.
  if (bytes.rfind('{', 0) == 0) return read_json(file, bytes);
  const auto end = bytes.find("\r\n\r\n");
  const auto head =
      cli::parse_head(std::string_view(bytes).substr(0, end == std::string::npos ? end : end + 4));
  if (!head) throw InputError(file.string() + ": no request");
  require(head->method == "POST" || head->content_length == 0, "a body is announced that nobody reads");
  const int refusal = cli::refusal_of(*head, cli::Access{kToken, {"localhost"}});
  if (refusal != 0) throw InputError(file.string() + ": refused with " + std::to_string(refusal));
  require(head->target.find(kToken) == 1, "a request without the token is let in");
  if (head->method == "POST") read_json(file, std::string_view(bytes).substr(end + 4));
}

}  // namespace

const Target fuzz_target{"request.txt", Contents::text, seeds, read};

}  // namespace vdvr::fuzz
