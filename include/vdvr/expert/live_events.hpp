// What pointer, wheel and keys do to a view: pure functions of a state and an event. Names and units of
// events are those of jupyter_rfb and of browsers.
#pragma once

#include <cstdint>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/live_view.hpp"

namespace vdvr {

enum class LiveEventKind { pointer_down, pointer_move, pointer_up, double_click, wheel, key_down, resize };

struct LiveEvent {
  LiveEventKind kind = LiveEventKind::pointer_move;
  double x = 0, y = 0;    ///< pixels from the picture's top left corner
  int button = 0;         ///< of pointer_down: 1 left, 2 right, 3 middle
  double dx = 0, dy = 0;  ///< of wheel: about 100 a notch, dy positive towards the user
  bool shift = false, control = false, alt = false;
  std::string key;                     ///< as browsers name it: "ArrowLeft", "+", "x"
  std::int64_t width = 0, height = 0;  ///< of resize
};

/// What a pressed pointer drags.
enum class LiveDrag { none, orbit, pan, zoom, slice, window };

/// All that a viewer remembers from one event to the next.
struct LiveState {
  LiveView view;
  std::int64_t width = 512, height = 512;  ///< of the picture on the screen, pixels
  LiveDrag drag = LiveDrag::none;
  double x = 0, y = 0;  ///< where the pointer was
};

/// Largest side of a live picture.
inline constexpr std::int64_t kMostLivePixels = 4096;

/// The view at the start: first_view.
VDVR_API LiveState first_state(const LiveScene& scene, std::int64_t width, std::int64_t height);

/// The state after an event. Left drags turn the volume with the hand, of slices they move the slice; middle
/// or Shift and left move the picture; right or Control and left zoom, of slices they change the grey window
/// (right and left the width, up and down the middle). The wheel zooms, or moves the slice. Double click and
/// `r` show the first camera. Keys: arrows turn, or move the slice; + and -; Page Up and Down; x, y, z along
/// that axis; 1 to 5 the mode; b the bound's colours; l the light; [ and ] the iso-surface's density.
/// What an event would do beyond a limit it does up to it; numbers that are not finite do nothing.
VDVR_API LiveState after_event(LiveState state, const LiveEvent& event, const LiveScene& scene);

}  // namespace vdvr
