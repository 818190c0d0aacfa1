"""A certified volume in a notebook, to be turned with the mouse."""

from __future__ import annotations

import json
from typing import Any, Dict, Tuple

import numpy as np

try:
    from jupyter_rfb import RemoteFrameBuffer
except ImportError:
    raise ImportError("Viewer needs jupyter_rfb: pip install 'vdvr[notebook]'") from None

from . import _core
from ._choices import sizes
from ._devices import DeviceLike
from ._volume import Volume


class Viewer(RemoteFrameBuffer):
    """A certified volume in a notebook.

    The left button turns it, of slices it moves the slice; the middle one, or Shift and left, moves the picture;
    the right one, or Control and left, zooms, of slices it changes the grey window. The wheel zooms, or moves
    the slice. A double click or `r` show the first view. Keys: 1 to 5 the mode (volume, iso-surface, maximum,
    slice, bound), x, y, z the slice's axis, b the bound's colours over the picture, l the light, [ and ] the
    iso-surface's density, + and - zoom, arrows turn.

    Frames are coarse while the mouse moves, and at rest those of `vdvr render`, to the bit.

    Parameters
    ----------
    volume : what `build` or `open` returns.
    size : width and height, CSS pixels.
    """

    def __init__(self, volume: Volume, size: Tuple[int, int] = (640, 480), *, device: DeviceLike = None,
                 **kwargs: Any) -> None:
        width, height = sizes(size)
        self._live = _core.LiveVolume(volume._held, volume._open_device(device), width, height)
        self._moving = False
        super().__init__(**kwargs)
        self.css_width, self.css_height = f"{width}px", f"{height}px"

    @property
    def state(self) -> Dict[str, Any]:
        """What is shown: mode, azimuth, elevation, zoom, pan, transfer, iso, slice, bound and so on."""
        return json.loads(self._live.state)

    def show(self, **state: Any) -> None:
        """Changes the view by members of `state`: `viewer.show(mode="iso", iso=0.3, bound=True)`.

        Raises
        ------
        InputError : a member's value is none.
        """
        unknown = set(state) - set(self.state)
        if unknown:
            raise _core.InputError(f"state: '{sorted(unknown)[0]}' is none of {', '.join(sorted(self.state))}")
        self._request({"state": state}, moving=False)

    @property
    def render_options(self) -> list:
        """The words behind `vdvr render FILE -o IMG.png` that draw the picture at rest."""
        return self._live.words

    def handle_event(self, event: Dict[str, Any]) -> None:
        """Called by jupyter_rfb for each event of pointer, wheel, keys and size."""
        if event.get("event_type") in ("close", "pointer_enter", "pointer_leave", "key_up"):
            return
        moving = event.get("event_type") in ("pointer_down", "pointer_move", "wheel")
        self._request({"events": [_plain(event)]}, moving=moving)

    def _request(self, request: Dict[str, Any], moving: bool) -> None:
        before = self._live.state
        self._live.request(json.dumps(request))
        # A pointer that passes by with no button changes nothing that is seen.
        if self._live.state != before:
            self._moving = moving
            self.request_draw()

    def get_frame(self) -> np.ndarray:
        """Called by jupyter_rfb: uint8 [y, x, 3]. A coarse frame is followed by the full one."""
        frame, full = self._live.draw(self._moving)
        self._moving = False
        if not full:
            self.request_draw()
        return frame


def _plain(event: Dict[str, Any]) -> Dict[str, Any]:
    """What JSON can say of an event: some versions add objects."""
    return {k: (list(v) if isinstance(v, tuple) else v) for k, v in event.items()
            if isinstance(v, (str, int, float, list, tuple))}
