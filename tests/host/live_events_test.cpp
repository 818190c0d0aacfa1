// What events do to a view, and the text that states and events travel as. No device.
#define BOOST_TEST_MODULE live_events
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/support/fields.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/live_json.hpp"

using namespace vdvr;

namespace {

LiveScene scene_of_a_box() {
  LiveScene s;
  s.grid = Grid{{20, 30, 40}, {-10, -15, -20}, {1, 1, 1}};
  s.frame = frame_grid(s.grid);
  s.brightness = Brightness{0, 1, 0.1, 0.9, 0.5, 0.2, {1, 2, 3}};
  s.range = {-0.25, 1.75};
  s.histogram = {0.5, 0.5};
  s.has_bounds = true;
  s.epsilon_abs = 0.03;
  return s;
}

const LiveScene& scene() {
  static const LiveScene s = scene_of_a_box();
  return s;
}

LiveState start() { return first_state(scene(), 400, 200); }

LiveEvent pointer(LiveEventKind kind, double x, double y, int button = 0) {
  LiveEvent e;
  e.kind = kind;
  e.x = x;
  e.y = y;
  e.button = button;
  return e;
}

/// Pressed at (100, 100), moved by (dx, dy), released.
LiveState dragged(LiveState s, int button, double dx, double dy, bool shift = false, bool control = false) {
  LiveEvent down = pointer(LiveEventKind::pointer_down, 100, 100, button);
  down.shift = shift;
  down.control = control;
  s = after_event(s, down, scene());
  s = after_event(s, pointer(LiveEventKind::pointer_move, 100 + dx / 2, 100 + dy / 2), scene());
  s = after_event(s, pointer(LiveEventKind::pointer_move, 100 + dx, 100 + dy), scene());
  return after_event(s, pointer(LiveEventKind::pointer_up, 100 + dx, 100 + dy), scene());
}

LiveState pressed(const LiveState& s, const std::string& key) {
  LiveEvent e;
  e.kind = LiveEventKind::key_down;
  e.key = key;
  return after_event(s, e, scene());
}

LiveState rolled(const LiveState& s, double dy) {
  LiveEvent e;
  e.kind = LiveEventKind::wheel;
  e.dy = dy;
  return after_event(s, e, scene());
}

LiveState in_mode(RenderMode mode) {
  LiveState s = start();
  s.view.mode = mode;
  return s;
}

/// Angles of a few hundred and numbers near 1, each of a few operations in double precision.
bool near(double a, double b) { return std::abs(a - b) <= tolerance::fp64_sum(16, 400); }

bool same(const LiveState& a, const LiveState& b) { return to_json(a) == to_json(b); }

/// Where the picture shows a point, in heights of the picture from its centre, right and down.
std::array<double, 2> seen_at(const Camera& c, const Vec3& p) {
  const auto minus = [](const Vec3& a, const Vec3& b) { return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
  const auto dot = [](const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const auto cross = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Vec3 view = minus(c.focal_point, c.position), right = cross(view, c.view_up), up = cross(right, view),
             to = minus(p, c.position);
  const double depth = dot(to, view) / std::sqrt(dot(view, view));
  const double scale = 2 * std::tan(c.view_angle_deg / 360 * 3.14159265358979323846) * depth;
  return {dot(to, right) / std::sqrt(dot(right, right)) / scale,
          -dot(to, up) / std::sqrt(dot(up, up)) / scale};
}

const Vec3 kCentre{0, 0, 0};

}  // namespace

BOOST_AUTO_TEST_CASE(what_is_shown_is_orbited_not_the_grid) {
  // A ball of radius 16, dense in its middle, aside of the middle of a grid of 64 cells.
  const Grid grid{{64, 64, 64}, {-32, -32, -32}, {1, 1, 1}, "mm"};
  const Vec3 middle{10, -12, 8};
  const auto density = [&](double x, double y, double z) {
    const Vec3 d{x - middle[0], y - middle[1], z - middle[2]};
    return static_cast<float>(std::max(0.0, 1 - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / 256));
  };
  Volume v{grid, {}};
  for (int z = -32; z <= 32; ++z)
    for (int y = -32; y <= 32; ++y)
      for (int x = -32; x <= 32; ++x) v.samples.push_back(density(x, y, z));
  const OrbitFrame frame = live_scene(as_mixed(v)).frame;
  // A cell around what is shown counts, and blocks of a few cells.
  for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(std::abs(frame.middle[a] - middle[a]) <= 2);
  BOOST_TEST(frame.distance < frame_grid(grid).distance / 2);
  // The denser half of it is in the picture, whichever way it is turned: within half the view angle, 15
  // degrees.
  BOOST_TEST(frame.distance * std::sin(std::numbers::pi / 12) >= 8);
}

BOOST_AUTO_TEST_CASE(left_drag_turns_the_volume_with_the_hand) {
  const LiveState right = dragged(start(), 1, 200, 0);
  BOOST_TEST(near(right.view.azimuth_deg, 30 - 180));
  BOOST_TEST(right.view.elevation_deg == 20);
  const LiveState down = dragged(start(), 1, 0, 20);
  BOOST_TEST(near(down.view.elevation_deg, 38));
  // A point in front of the centre follows the hand: that is what "with the hand" means.
  LiveState s = start();
  s.view.azimuth_deg = s.view.elevation_deg = 0;  // seen from +y
  const Vec3 front{0, 10, 0};
  const auto before = seen_at(camera_of(s.view, scene().frame), front);
  const auto after = seen_at(camera_of(dragged(s, 1, 10, 10).view, scene().frame), front);
  BOOST_TEST(after[0] > before[0]);
  BOOST_TEST(after[1] > before[1]);
}

BOOST_AUTO_TEST_CASE(turns_stay_in_range_however_long_they_go_on) {
  LiveState s = start();
  for (int i = 0; i < 50; ++i) s = dragged(s, 1, 1e4, 1e4);
  BOOST_TEST(s.view.elevation_deg == 90);
  BOOST_TEST(std::abs(s.view.azimuth_deg) <= 180);
  check_view(s.view, scene());
}

BOOST_AUTO_TEST_CASE(nothing_moves_without_a_pressed_button) {
  const LiveState s = start();
  BOOST_TEST(same(after_event(s, pointer(LiveEventKind::pointer_move, 300, 10), scene()), s));
  BOOST_TEST(dragged(s, 0, 50, 50).view.azimuth_deg == s.view.azimuth_deg);
}

BOOST_AUTO_TEST_CASE(a_pan_moves_the_centre_by_the_way_of_the_pointer) {
  for (const double zoom : {0.5, 1.0, 3.0}) {
    LiveState s = start();
    s.view.zoom = zoom;
    for (const auto& moved : {dragged(s, 3, 60, -20), dragged(s, 1, 60, -20, true)}) {
      const auto at = seen_at(camera_of(moved.view, scene().frame), kCentre);
      BOOST_TEST(near(at[0], 60.0 / 200));
      BOOST_TEST(near(at[1], -20.0 / 200));
      BOOST_TEST(moved.view.azimuth_deg == s.view.azimuth_deg);
    }
  }
}

BOOST_AUTO_TEST_CASE(without_a_pan_the_camera_is_that_of_render_to_the_bit) {
  const LiveState s = start();
  const Camera a = camera_of(s.view, scene().frame), b = orbit_camera(scene().grid, 30, 20, 1);
  BOOST_TEST((a.position == b.position && a.focal_point == b.focal_point && a.view_up == b.view_up));
  BOOST_TEST(a.view_angle_deg == b.view_angle_deg);
}

BOOST_AUTO_TEST_CASE(the_wheel_zooms_and_stops_at_the_limits) {
  const LiveState s = start();
  BOOST_TEST(near(rolled(s, -800).view.zoom, 2));
  BOOST_TEST(near(rolled(s, 800).view.zoom, 0.5));
  BOOST_TEST(rolled(rolled(s, -1e4), -1e4).view.zoom == 64);
  BOOST_TEST(rolled(s, 1e300).view.zoom == 0.25);
  BOOST_TEST(near(dragged(s, 2, 0, -50).view.zoom, 2));
  BOOST_TEST(near(dragged(s, 1, 0, -50, false, true).view.zoom, 2));
}

BOOST_AUTO_TEST_CASE(slices_are_moved_by_wheel_drag_and_keys_and_stay_in_the_volume) {
  const LiveState s = in_mode(RenderMode::slice);
  BOOST_TEST(s.view.slice_position == 3);  // of the dense part
  BOOST_TEST(rolled(s, -200).view.slice_position == 5);
  BOOST_TEST(rolled(s, 1e6).view.slice_position == -20);
  BOOST_TEST(near(dragged(s, 1, 0, -50).view.slice_position, 3 + 10));
  BOOST_TEST(pressed(s, "ArrowUp").view.slice_position == 4);
  BOOST_TEST(pressed(s, "PageDown").view.slice_position == -7);
  const LiveState x = pressed(s, "x");
  BOOST_TEST(x.view.slice_axis == 0);
  BOOST_TEST(x.view.slice_position == 1);
  BOOST_TEST(rolled(x, -1e6).view.slice_position == 10);
}

BOOST_AUTO_TEST_CASE(the_grey_window_is_dragged_and_stays_in_order) {
  LiveState s = in_mode(RenderMode::slice);
  const auto [lo, hi] = dragged(s, 2, 20, 0).view.slice_range;
  BOOST_TEST(near(hi - lo, 0.8 + 0.1 * 2));
  BOOST_TEST(near(lo + hi, 1.0));
  for (int i = 0; i < 20; ++i) s = dragged(s, 2, -1e4, 1e4);
  check_view(s.view, scene());
  BOOST_TEST(s.view.slice_range.first < s.view.slice_range.second);
}

BOOST_AUTO_TEST_CASE(keys_choose_the_mode_the_light_the_bound_and_the_surface) {
  const LiveState s = start();
  BOOST_TEST((pressed(s, "2").view.mode == RenderMode::iso));
  BOOST_TEST((pressed(s, "5").view.mode == RenderMode::error));
  BOOST_TEST(pressed(s, "b").view.bound);
  BOOST_TEST(!pressed(pressed(s, "b"), "b").view.bound);
  BOOST_TEST(!pressed(s, "l").view.shading);
  BOOST_TEST(near(pressed(s, "]").view.iso, 0.5 + 0.02));
  BOOST_TEST(near(pressed(s, "ArrowRight").view.azimuth_deg, 25));
  BOOST_TEST(same(pressed(s, "q"), s));
  LiveEvent reload;
  reload.kind = LiveEventKind::key_down;
  reload.key = "r";
  reload.control = true;
  BOOST_TEST(same(after_event(dragged(s, 1, 9, 9), reload, scene()), dragged(s, 1, 9, 9)));
}

BOOST_AUTO_TEST_CASE(a_volume_without_a_certificate_shows_no_bound) {
  LiveScene bare = scene();
  bare.has_bounds = false;
  LiveEvent e;
  e.kind = LiveEventKind::key_down;
  e.key = "b";
  LiveState s = after_event(first_state(bare, 400, 200), e, bare);
  BOOST_TEST(!s.view.bound);
  e.key = "5";
  BOOST_TEST((after_event(s, e, bare).view.mode == RenderMode::dvr));
  BOOST_CHECK_THROW(live_request(R"({"state": {"bound": true}})", bare, s), InputError);
  BOOST_CHECK_THROW(live_request(R"({"state": {"mode": "error"}})", bare, s), InputError);
}

BOOST_AUTO_TEST_CASE(double_click_shows_the_first_camera_and_keeps_the_rest) {
  LiveState s = pressed(dragged(rolled(start(), -300), 1, 33, 44), "2");
  LiveEvent e;
  e.kind = LiveEventKind::double_click;
  s = after_event(s, e, scene());
  const LiveState first = start();
  BOOST_TEST(s.view.azimuth_deg == first.view.azimuth_deg);
  BOOST_TEST(s.view.zoom == first.view.zoom);
  BOOST_TEST((s.view.mode == RenderMode::iso));
}

BOOST_AUTO_TEST_CASE(a_high_picture_shows_the_whole_volume) {
  BOOST_TEST(first_state(scene(), 300, 600).view.zoom == 0.5);
  BOOST_TEST(first_state(scene(), 600, 300).view.zoom == 1);
}

BOOST_AUTO_TEST_CASE(views_along_an_axis_have_the_others_where_slices_have_them) {
  for (const int axis : {0, 1, 2}) {
    const LiveState s = pressed(start(), std::string(1, "xyz"[axis]));
    const Camera c = camera_of(s.view, scene().frame);
    Vec3 across{}, down{};
    across[axis == 0 ? 1 : 0] = 1;
    down[axis == 2 ? 1 : 2] = 1;
    BOOST_TEST(seen_at(c, across)[0] > 0);
    BOOST_TEST(seen_at(c, down)[1] > 0);
  }
}

BOOST_AUTO_TEST_CASE(numbers_that_are_not_finite_do_nothing) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   inf = std::numeric_limits<double>::infinity();
  LiveState s = after_event(start(), pointer(LiveEventKind::pointer_down, 5, 5, 1), scene());
  for (const double bad : {nan, inf, -inf}) {
    BOOST_TEST(same(after_event(s, pointer(LiveEventKind::pointer_move, bad, 5), scene()), s));
    BOOST_TEST(same(rolled(s, bad), s));
  }
}

BOOST_AUTO_TEST_CASE(a_state_comes_back_from_its_text) {
  LiveState s = dragged(rolled(start(), -333), 1, 17, 19, true);
  s.view.iso = 0.1;
  s.view.clip = {-1, -2, -3.25, 4, 5, 6};
  s.view.transfer.points = {{0.1, {0.25, 0.5, 1}, 0}, {0.7, {1, 1, 1}, 0.3}};
  s = after_event(s, pointer(LiveEventKind::pointer_down, 5, 6.5, 3), scene());
  const LiveState back = live_request(R"({"state": )" + to_json(s) + "}", scene(), start());
  BOOST_TEST(to_json(back) == to_json(s));
  BOOST_TEST(back.view.iso == 0.1);
  BOOST_TEST((back.view.clip == s.view.clip));
  BOOST_TEST(!live_request(R"({"state": {"clip": null}})", scene(), back).view.clip);
  BOOST_TEST((back.drag == LiveDrag::pan));
}

BOOST_AUTO_TEST_CASE(events_arrive_as_jupyter_rfb_sends_them) {
  const LiveState s = live_request(
      R"({"events": [
        {"event_type": "resize", "width": 400.0, "height": 200.4, "pixel_ratio": 1.0},
        {"event_type": "pointer_down", "x": 100, "y": 100, "button": 1, "buttons": [1],
         "modifiers": ["Shift"], "ntouches": 0, "touches": {}, "time_stamp": 1.5},
        {"event_type": "pointer_enter", "x": 1, "y": 1},
        {"event_type": "pointer_move", "x": 160, "y": 80, "button": 0, "buttons": [1], "modifiers": []},
        {"event_type": "pointer_up", "x": 160, "y": 80, "button": 1}]})",
      scene(), first_state(scene(), 100, 100));
  BOOST_TEST(to_json(s) == to_json(dragged(start(), 1, 60, -20, true)));
}

BOOST_AUTO_TEST_CASE(requests_that_are_none_are_refused_in_one_line) {
  const LiveState s = start();
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      live_request(text, scene(), s);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const std::pair<const char*, const char*> cases[] = {
      {"", "not JSON"},
      {"{", "not JSON"},
      {"\xff\xfe", "not JSON"},
      {"[]", "an object"},
      {R"({"path": "/etc/passwd"})", "no member \"path\""},
      {R"({"state": {"file": 1}})", "no member `\"file\"`"},
      {R"({"state": {"azimuth": "1"}})", "`azimuth` \"1\" is not a number"},
      {R"({"state": {"azimuth": NaN}})", "not JSON"},
      {R"({"state": {"azimuth": 1e999}})", "not JSON"},
      {R"({"state": {"elevation": 91}})", "`elevation` 91"},
      {R"({"state": {"zoom": 0}})", "`zoom` 0"},
      {R"({"state": {"mode": "volume"}})", "`mode` \"volume\""},
      {R"({"state": {"slice_axis": 3}})", "`slice_axis` 3"},
      {R"({"state": {"slice_axis": 1.5}})", "`slice_axis` 1.5"},
      {R"({"state": {"slice_position": 21}})", "`slice_position` 21"},
      {R"({"state": {"slice_range": [2, 1]}})", "`slice_range` 2, 1"},
      {R"({"state": {"clip": [1, 0, 0, 0, 1, 1]}})", "`clip` 1 to 0 along x"},
      {R"({"state": {"clip": [1, 0]}})", "`clip` [1,0] is not six numbers"},
      {R"({"state": {"width": 100000}})", "`width` 100000"},
      {R"({"state": {"transfer": []}})", "1 to 64 points"},
      {R"({"state": {"transfer": [{"value": 0, "rgb": [0, 0, 2], "opacity": 0}]}})", "`rgb`"},
      {R"({"state": {"transfer": [{"value": 0, "rgb": [0, 0, 0], "opacity": -1}]}})", "`opacity` -1"},
      {R"({"events": [1]})", "event_type"},
      {R"({"events": [{"event_type": "wheel", "dy": "far"}]})", "`dy`"},
      {R"({"events": [{"event_type": "pointer_down", "button": 99}]})", "`button` 99"},
  };
  for (const auto& [text, part] : cases) {
    const std::string said = refusal(text);
    BOOST_TEST(said.find(part) != std::string::npos, text << " gave: " << said);
    BOOST_TEST(said.find('\n') == std::string::npos);
  }
  BOOST_TEST(refusal(std::string(kMostLiveText + 1, ' ')).find("bytes") != std::string::npos);
  BOOST_TEST(refusal(std::string(30000, '[')).find("nested") != std::string::npos);
  std::string events = R"({"events": [)";
  for (int i = 0; i < 257; ++i) events += std::string(i ? "," : "") + R"({"event_type": "wheel"})";
  BOOST_TEST(refusal(events + "]}").find("256") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_scene_is_json) {
  const auto json = nlohmann::json::parse(to_json(scene()));
  BOOST_TEST(json["range"][1] == 1.75);
  BOOST_TEST(json["has_bounds"] == true);
}
