// States and events of a viewer as JSON text.
#pragma once

#include <string>
#include <string_view>

#include "vdvr/api.hpp"
#include "vdvr/expert/live_events.hpp"

namespace vdvr {

/// Longest text that live_request reads, and most events in it.
inline constexpr std::size_t kMostLiveText = 65536, kMostLiveEvents = 256, kMostTransferPoints = 64;

/// The state that a viewer asks for: {"state": {...}, "events": [...]}, both optional. Members of the state
/// (as to_json writes them) replace those of `from`; then the events happen in order. An event is what
/// jupyter_rfb sends: {"event_type": "pointer_down", "x": 3, "y": 4, "button": 1, "modifiers": ["Shift"]};
/// its types that mean nothing here are passed over, and so are members that are not known.
/// Throws InputError for a text that is no such request, naming the member and the value. Opens nothing.
VDVR_API LiveState live_request(std::string_view text, const LiveScene& scene, const LiveState& from);

/// {"mode", "azimuth", "elevation", "zoom", "pan", "transfer", "iso", "slice_axis", "slice_position",
/// "slice_range", "clip", "shading", "bound", "width", "height", "drag", "pointer"}.
VDVR_API std::string to_json(const LiveState& state);
/// What a page must know of the volume: {"grid", "range", "bulk", "histogram", "threshold", "has_bounds",
/// "epsilon_abs", "unit"}.
VDVR_API std::string to_json(const LiveScene& scene);

}  // namespace vdvr
