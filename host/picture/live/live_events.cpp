// Pointer, wheel and keys.
#include "vdvr/expert/live_events.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdvr {
namespace {

// Half a turn for a drag over the picture's height, as when a ball of that size is rolled by its front.
constexpr double kDegreesPerHeight = 180;
constexpr double kKeyDegrees = 5, kKeyZoom = 1.125;
// Of the wheel: eight notches double the size.
constexpr double kWheelPerOctave = 800, kWheelPerSlice = 100;
constexpr double kFarthest = 1e5;  // pixels
constexpr double kLeastZoom = 0.25, kMostZoom = 64, kMostPan = 2;

void turn(LiveView& v, double right_deg, double up_deg) {
  // What the hand pulls to the right goes there when the camera goes to its left.
  v.azimuth_deg = std::remainder(v.azimuth_deg - right_deg, 360.0);
  v.elevation_deg = std::clamp(v.elevation_deg - up_deg, -90.0, 90.0);
}

void zoom(LiveView& v, double factor) { v.zoom = std::clamp(v.zoom * factor, kLeastZoom, kMostZoom); }

void move_slice(LiveView& v, const LiveScene& scene, double world) {
  const auto a = static_cast<std::size_t>(v.slice_axis);
  const double lo = scene.grid.origin[a],
               hi = lo + static_cast<double>(scene.grid.cells[a]) * scene.grid.spacing[a];
  v.slice_position = std::clamp(v.slice_position + world, lo, hi);
}

void move_slice_by_cells(LiveView& v, const LiveScene& scene, double cells) {
  move_slice(v, scene, cells * scene.grid.spacing[static_cast<std::size_t>(v.slice_axis)]);
}

void move_iso(LiveView& v, const LiveScene& scene, double share) {
  const auto [lo, hi] = scene.range;
  v.iso = std::clamp(v.iso + share * (hi - lo), lo, hi);
}

/// `wider` and `brighter` in heights of the picture.
void move_window(LiveView& v, const LiveScene& scene, double wider, double brighter) {
  const double whole = scene.range.second - scene.range.first;
  if (!(whole > 0)) return;
  double middle = (v.slice_range.first + v.slice_range.second) / 2;
  double width = v.slice_range.second - v.slice_range.first;
  middle = std::clamp(middle - brighter * whole, scene.range.first - whole, scene.range.second + whole);
  width = std::clamp(width + wider * whole, whole / 1000, 4 * whole);
  v.slice_range = {middle - width / 2, middle + width / 2};
}

/// Along an axis, with the other two where slices across it have them.
void look_along(LiveView& v, const LiveScene& scene, int axis) {
  if (v.is_flat()) {
    v.slice_axis = axis;
    v.slice_position = scene.brightness.dense_center[static_cast<std::size_t>(axis)];
    return;
  }
  v.azimuth_deg = axis == 0 ? -90 : 0;
  v.elevation_deg = axis == 2 ? 90 : 0;
}

void first_camera(LiveState& s, const LiveScene& scene) {
  const LiveView first = first_view(scene, s.width, s.height);
  LiveView& v = s.view;
  v.azimuth_deg = first.azimuth_deg;
  v.elevation_deg = first.elevation_deg;
  v.zoom = first.zoom;
  v.pan = first.pan;
  v.slice_position = scene.brightness.dense_center[static_cast<std::size_t>(v.slice_axis)];
  v.slice_range = first.slice_range;
}

LiveDrag drag_of(const LiveView& v, const LiveEvent& e) {
  const bool left = e.button == 1;
  if (v.is_flat()) {
    if (e.button == 2 || (left && e.control)) return LiveDrag::window;
    return left || e.button == 3 ? LiveDrag::slice : LiveDrag::none;
  }
  if (e.button == 3 || (left && e.shift)) return LiveDrag::pan;
  if (e.button == 2 || (left && e.control)) return LiveDrag::zoom;
  return left ? LiveDrag::orbit : LiveDrag::none;
}

void pan(LiveView& v, double right, double down) {
  // The picture's height at the volume's centre in diameters, for half the view angle of zoom 1, 15 degrees.
  const double height = 1 / (v.zoom * std::cos(std::numbers::pi / 12));
  v.pan[0] = std::clamp(v.pan[0] + right * height, -kMostPan, kMostPan);
  v.pan[1] = std::clamp(v.pan[1] + down * height, -kMostPan, kMostPan);
}

void drag(LiveState& s, const LiveEvent& e, const LiveScene& scene) {
  const double height = static_cast<double>(s.height);
  const double right = (e.x - s.x) / height, down = (e.y - s.y) / height;
  const auto a = static_cast<std::size_t>(s.view.slice_axis);
  switch (s.drag) {
    case LiveDrag::orbit:
      turn(s.view, right * kDegreesPerHeight, -down * kDegreesPerHeight);
      break;
    case LiveDrag::pan:
      pan(s.view, right, down);
      break;
    case LiveDrag::zoom:
      zoom(s.view, std::exp2(std::clamp(-4 * down, -8.0, 8.0)));
      break;
    case LiveDrag::slice:
      move_slice(s.view, scene, -down * static_cast<double>(scene.grid.cells[a]) * scene.grid.spacing[a]);
      break;
    case LiveDrag::window:
      move_window(s.view, scene, right, -down);
      break;
    case LiveDrag::none:
      break;
  }
  s.x = e.x;
  s.y = e.y;
}

void set_mode(LiveView& v, const LiveScene& scene, RenderMode mode) {
  if (mode != RenderMode::error || scene.has_bounds) v.mode = mode;
}

void arrow(LiveView& v, const LiveScene& scene, int right, int up) {
  if (v.is_flat()) move_slice_by_cells(v, scene, right + up);
  else turn(v, right * kKeyDegrees, up * kKeyDegrees);
}

void letter(LiveState& s, char key, const LiveScene& scene) {
  LiveView& v = s.view;
  if (key >= '1' && key <= '5') set_mode(v, scene, static_cast<RenderMode>(key - '1'));
  else if (key >= 'x' && key <= 'z') look_along(v, scene, key - 'x');
  else if (key == '+' || key == '=') zoom(v, kKeyZoom);
  else if (key == '-' || key == '_') zoom(v, 1 / kKeyZoom);
  else if (key == 'r') first_camera(s, scene);
  else if (key == 'b') v.bound = scene.has_bounds && !v.bound;
  else if (key == 'l') v.shading = !v.shading;
  else if (key == '[') move_iso(v, scene, -0.01);
  else if (key == ']') move_iso(v, scene, 0.01);
}

void press(LiveState& s, const LiveEvent& e, const LiveScene& scene) {
  LiveView& v = s.view;
  if (e.control || e.alt) return;  // the browser's own
  if (e.key == "ArrowLeft") arrow(v, scene, -1, 0);
  else if (e.key == "ArrowRight") arrow(v, scene, 1, 0);
  else if (e.key == "ArrowUp") arrow(v, scene, 0, 1);
  else if (e.key == "ArrowDown") arrow(v, scene, 0, -1);
  else if (e.key == "PageUp") move_slice_by_cells(v, scene, 10);
  else if (e.key == "PageDown") move_slice_by_cells(v, scene, -10);
  else if (e.key == "Home") first_camera(s, scene);
  else if (e.key.size() == 1) letter(s, e.key[0], scene);
}

void roll(LiveState& s, const LiveEvent& e, const LiveScene& scene) {
  const double dy = std::clamp(e.dy, -10000.0, 10000.0);
  if (s.view.is_flat()) move_slice_by_cells(s.view, scene, -dy / kWheelPerSlice);
  else zoom(s.view, std::exp2(-dy / kWheelPerOctave));
}

}  // namespace

LiveState first_state(const LiveScene& scene, std::int64_t width, std::int64_t height) {
  LiveState s;
  s.width = std::clamp<std::int64_t>(width, 1, kMostLivePixels);
  s.height = std::clamp<std::int64_t>(height, 1, kMostLivePixels);
  s.view = first_view(scene, s.width, s.height);
  return s;
}

LiveState after_event(LiveState s, const LiveEvent& given, const LiveScene& scene) {
  for (const double number : {given.x, given.y, given.dx, given.dy})
    if (!std::isfinite(number)) return s;
  LiveEvent e = given;
  // No screen is larger, and differences of such numbers stay finite.
  e.x = std::clamp(e.x, -kFarthest, kFarthest);
  e.y = std::clamp(e.y, -kFarthest, kFarthest);
  switch (e.kind) {
    case LiveEventKind::pointer_down:
      s.drag = drag_of(s.view, e);
      s.x = e.x;
      s.y = e.y;
      break;
    case LiveEventKind::pointer_move:
      if (s.drag != LiveDrag::none) drag(s, e, scene);
      break;
    case LiveEventKind::pointer_up:
      s.drag = LiveDrag::none;
      break;
    case LiveEventKind::double_click:
      first_camera(s, scene);
      break;
    case LiveEventKind::wheel:
      roll(s, e, scene);
      break;
    case LiveEventKind::key_down:
      press(s, e, scene);
      break;
    case LiveEventKind::resize:
      s.width = std::clamp<std::int64_t>(e.width, 1, kMostLivePixels);
      s.height = std::clamp<std::int64_t>(e.height, 1, kMostLivePixels);
      break;
  }
  return s;
}

}  // namespace vdvr
