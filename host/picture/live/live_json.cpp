// Requests of viewers, read strictly: what a stranger sends is refused by name or does what an event may do.
#include "vdvr/expert/live_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 5> kModes{"dvr", "iso", "mip", "slice", "error"};
constexpr std::array<const char*, 6> kDrags{"none", "orbit", "pan", "zoom", "slice", "window"};
constexpr std::array<const char*, 7> kEvents{"pointer_down", "pointer_move", "pointer_up", "double_click",
                                             "wheel",        "key_down",     "resize"};

/// A value as it is shown in a message: short, whatever was sent.
std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 37) + "...";
  return text;
}

[[noreturn]] void refuse(const std::string& member, const Json& value, const char* wanted) {
  throw InputError(fmt::format("`{}` {} is not {}", member, shown(value), wanted));
}

double number(const std::string& member, const Json& value) {
  if (!value.is_number()) refuse(member, value, "a number");
  const double x = value.get<double>();
  if (!std::isfinite(x)) refuse(member, value, "a finite number");
  return x;
}

std::int64_t whole(const std::string& member, const Json& value, std::int64_t lowest, std::int64_t highest) {
  const double x = number(member, value);
  if (!(x >= static_cast<double>(lowest) && x <= static_cast<double>(highest)) || x != std::floor(x))
    throw InputError(fmt::format("`{}` {} is not a whole number from {} to {}", member, x, lowest, highest));
  return static_cast<std::int64_t>(x);
}

bool truth(const std::string& member, const Json& value) {
  if (!value.is_boolean()) refuse(member, value, "true or false");
  return value.get<bool>();
}

template <std::size_t N>
std::array<double, N> numbers(const std::string& member, const Json& value) {
  if (!value.is_array() || value.size() != N)
    refuse(member, value, N == 2 ? "two numbers" : N == 3 ? "three numbers" : "six numbers");
  std::array<double, N> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = number(member, value[i]);
  return all;
}

template <std::size_t N>
std::size_t choice(const std::string& member, const Json& value, const std::array<const char*, N>& names) {
  if (value.is_string())
    for (std::size_t i = 0; i < N; ++i)
      if (value.get_ref<const std::string&>() == names[i]) return i;
  refuse(member, value, "one of its names");
}

TransferFunction transfer_of(const Json& value) {
  if (!value.is_array() || value.empty() || value.size() > kMostTransferPoints)
    throw InputError(fmt::format("`transfer` is not a list of 1 to {} points", kMostTransferPoints));
  TransferFunction f;
  f.name = "drawn";
  for (const Json& p : value) {
    if (!p.is_object() || !p.contains("value") || !p.contains("rgb") || !p.contains("opacity"))
      refuse("transfer", p, R"({"value", "rgb", "opacity"})");
    TransferPoint point{number("value", p["value"]), numbers<3>("rgb", p["rgb"]),
                        number("opacity", p["opacity"])};
    if (!(point.opacity >= 0 && point.opacity <= 1)) refuse("opacity", p["opacity"], "within 0 and 1");
    if (std::any_of(point.rgb.begin(), point.rgb.end(), [](double c) { return !(c >= 0 && c <= 1); }))
      refuse("rgb", p["rgb"], "within 0 and 1");
    if (!f.points.empty() && point.value < f.points.back().value)
      refuse("value", p["value"], "as large as the point's before it");
    f.points.push_back(point);
  }
  return f;
}

using Setter = std::function<void(LiveState&, const std::string&, const Json&)>;

const std::map<std::string, Setter, std::less<>>& setters() {
  using J = const Json&;
  using M = const std::string&;
  static const std::map<std::string, Setter, std::less<>> table{
      {"mode", [](LiveState& s, M m, J j) { s.view.mode = static_cast<RenderMode>(choice(m, j, kModes)); }},
      {"azimuth", [](LiveState& s, M m, J j) { s.view.azimuth_deg = number(m, j); }},
      {"elevation", [](LiveState& s, M m, J j) { s.view.elevation_deg = number(m, j); }},
      {"zoom", [](LiveState& s, M m, J j) { s.view.zoom = number(m, j); }},
      {"pan", [](LiveState& s, M m, J j) { s.view.pan = numbers<2>(m, j); }},
      {"transfer", [](LiveState& s, M, J j) { s.view.transfer = transfer_of(j); }},
      {"iso", [](LiveState& s, M m, J j) { s.view.iso = number(m, j); }},
      {"slice_axis", [](LiveState& s, M m, J j) { s.view.slice_axis = static_cast<int>(whole(m, j, 0, 2)); }},
      {"slice_position", [](LiveState& s, M m, J j) { s.view.slice_position = number(m, j); }},
      {"slice_range",
       [](LiveState& s, M m, J j) {
         const auto range = numbers<2>(m, j);
         s.view.slice_range = {range[0], range[1]};
       }},
      {"clip",
       [](LiveState& s, M m, J j) {
         if (j.is_null()) s.view.clip.reset();
         else s.view.clip = numbers<6>(m, j);
       }},
      {"shading", [](LiveState& s, M m, J j) { s.view.shading = truth(m, j); }},
      {"bound", [](LiveState& s, M m, J j) { s.view.bound = truth(m, j); }},
      {"width", [](LiveState& s, M m, J j) { s.width = whole(m, j, 1, kMostLivePixels); }},
      {"height", [](LiveState& s, M m, J j) { s.height = whole(m, j, 1, kMostLivePixels); }},
      {"drag", [](LiveState& s, M m, J j) { s.drag = static_cast<LiveDrag>(choice(m, j, kDrags)); }},
      {"pointer",
       [](LiveState& s, M m, J j) {
         const auto at = numbers<2>(m, j);
         s.x = std::clamp(at[0], -1e5, 1e5);
         s.y = std::clamp(at[1], -1e5, 1e5);
       }},
  };
  return table;
}

void set_members(LiveState& state, const Json& members) {
  if (!members.is_object()) refuse("state", members, "an object");
  for (const auto& [name, value] : members.items()) {
    const auto found = setters().find(name);
    if (found == setters().end())
      throw InputError(fmt::format("a state has no member `{}`", shown(Json(name))));
    found->second(state, name, value);
  }
}

double number_or(const Json& event, const char* member, double fallback) {
  return event.contains(member) ? number(member, event[member]) : fallback;
}

bool has_modifier(const Json& event, const char* name) {
  if (!event.contains("modifiers")) return false;
  const Json& all = event["modifiers"];
  if (!all.is_array()) refuse("modifiers", all, "a list of names");
  return std::any_of(all.begin(), all.end(),
                     [&](const Json& m) { return m.is_string() && m.get_ref<const std::string&>() == name; });
}

std::optional<LiveEvent> event_of(const Json& json) {
  if (!json.is_object() || !json.contains("event_type") || !json["event_type"].is_string())
    refuse("events", json, R"(an object with "event_type")");
  const auto& type = json["event_type"].get_ref<const std::string&>();
  const auto known = std::find_if(kEvents.begin(), kEvents.end(), [&](const char* n) { return type == n; });
  if (known == kEvents.end()) return std::nullopt;
  LiveEvent e;
  e.kind = static_cast<LiveEventKind>(known - kEvents.begin());
  e.x = number_or(json, "x", 0);
  e.y = number_or(json, "y", 0);
  e.dx = number_or(json, "dx", 0);
  e.dy = number_or(json, "dy", 0);
  if (json.contains("button")) e.button = static_cast<int>(whole("button", json["button"], 0, 32));
  e.shift = has_modifier(json, "Shift");
  e.control = has_modifier(json, "Control") || has_modifier(json, "Meta");
  e.alt = has_modifier(json, "Alt");
  if (json.contains("key")) {
    if (!json["key"].is_string()) refuse("key", json["key"], "a name");
    e.key = json["key"].get<std::string>();
  }
  if (e.kind == LiveEventKind::resize) {
    // jupyter_rfb's sizes may have fractions.
    e.width = static_cast<std::int64_t>(
        std::clamp(std::round(number_or(json, "width", 0)), 1.0, static_cast<double>(kMostLivePixels)));
    e.height = static_cast<std::int64_t>(
        std::clamp(std::round(number_or(json, "height", 0)), 1.0, static_cast<double>(kMostLivePixels)));
  }
  return e;
}

Json parsed(std::string_view text) {
  if (text.size() > kMostLiveText)
    throw InputError(
        fmt::format("the request has {} bytes; at most {} are read", text.size(), kMostLiveText));
  try {
    // Nothing that is meant lies deeper than state, list, point, colour.
    return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
      if (depth > 8) throw InputError("the request is nested too deeply");
      return true;
    });
  } catch (const nlohmann::json::exception&) {
    throw InputError("the request is not JSON");
  }
}

Json transfer_json(const TransferFunction& f) {
  Json points = Json::array();
  for (const TransferPoint& p : f.points)
    points.push_back({{"value", p.value}, {"rgb", p.rgb}, {"opacity", p.opacity}});
  return points;
}

}  // namespace

LiveState live_request(std::string_view text, const LiveScene& scene, const LiveState& from) {
  const Json json = parsed(text);
  if (!json.is_object()) refuse("request", json, "an object");
  LiveState state = from;
  for (const auto& [name, value] : json.items())
    if (name != "state" && name != "events")
      throw InputError(fmt::format("a request has no member {}", shown(Json(name))));
  if (json.contains("state")) set_members(state, json["state"]);
  check_view(state.view, scene);
  if (json.contains("events")) {
    const Json& events = json["events"];
    if (!events.is_array() || events.size() > kMostLiveEvents)
      throw InputError(fmt::format("`events` is not a list of at most {} events", kMostLiveEvents));
    for (const Json& event : events)
      if (const auto e = event_of(event)) state = after_event(std::move(state), *e, scene);
  }
  return state;
}

std::string to_json(const LiveState& s) {
  const LiveView& v = s.view;
  const Json json = {{"mode", kModes[static_cast<std::size_t>(v.mode)]},
                     {"azimuth", v.azimuth_deg},
                     {"elevation", v.elevation_deg},
                     {"zoom", v.zoom},
                     {"pan", v.pan},
                     {"transfer", transfer_json(v.transfer)},
                     {"iso", v.iso},
                     {"slice_axis", v.slice_axis},
                     {"slice_position", v.slice_position},
                     {"slice_range", v.slice_range},
                     {"clip", v.clip ? Json(*v.clip) : Json()},
                     {"shading", v.shading},
                     {"bound", v.bound},
                     {"width", s.width},
                     {"height", s.height},
                     {"drag", kDrags[static_cast<std::size_t>(s.drag)]},
                     {"pointer", {s.x, s.y}}};
  return json.dump();
}

std::string to_json(const LiveScene& scene) {
  const Grid& g = scene.grid;
  const Brightness& b = scene.brightness;
  const Json json = {
      {"grid", {{"cells", g.cells}, {"origin", g.origin}, {"spacing", g.spacing}, {"unit", g.unit}}},
      {"range", scene.range},
      {"bulk", {b.lo, b.hi}},
      {"threshold", b.threshold},
      {"dense_center", b.dense_center},
      {"histogram", scene.histogram},
      {"has_bounds", scene.has_bounds},
      {"epsilon_abs", scene.epsilon_abs}};
  return json.dump();
}

}  // namespace vdvr
