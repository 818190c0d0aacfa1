#!/usr/bin/env python3
"""The notebook's viewer, by events and frames: no browser. And a leak test: open, draw, close.

  viewer.py VDVR
"""
import ctypes
import gc
import os
import subprocess
import sys

import numpy as np
import vdvr
from PIL import Image

rng = np.random.default_rng(2)
scan = vdvr.Scan(rng.random((24, 9, 17)).astype(np.float32), np.arange(24) * 7.5, center=8.0)
volume = vdvr.build(scan, "20%")
volume.save("v.vdvr", overwrite=True)
viewer = vdvr.Viewer(volume, size=(160, 120))


def event(kind, **members):
    viewer.handle_event({"event_type": kind, "x": 0, "y": 0, "button": 0, "buttons": (), "modifiers": (),
                         "time_stamp": 1.0, **members})


def rest():
    """The frame that comes to rest, after a coarse one or not."""
    for _ in range(3):
        frame = viewer.get_frame()
        if frame.shape == (120, 160, 3):
            return frame
    raise SystemExit("no full frame came")


def program():
    words = [sys.argv[1], "render", "v.vdvr", "-o", "p.png", "--force", "--quiet", *viewer.render_options]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    return np.asarray(Image.open("p.png").convert("RGB"))


first = rest()
event("pointer_down", x=80, y=60, button=1)
event("pointer_move", x=110, y=70, button=1, buttons=(1,))
coarse = viewer.get_frame()
assert coarse.shape[0] <= 120 and coarse.dtype == np.uint8
event("pointer_up", x=110, y=70, button=1)
turned = rest()
assert viewer.state["azimuth"] != 30 and not np.array_equal(first, turned), "a drag turned nothing"
zoom = viewer.state["zoom"]
event("wheel", x=80, y=60, dx=0, dy=-100)
assert viewer.state["zoom"] > zoom, "the wheel zoomed nothing"
event("double_click", x=80, y=60, button=1)
assert np.array_equal(rest(), first), "a double click does not show the first view"
event("key_down", key="2")
assert viewer.state["mode"] == "iso"
low = rest()
viewer.show(iso=viewer.state["iso"] * 1.2)
assert not np.array_equal(rest(), low), "another iso-value, the same picture"
assert np.array_equal(rest(), program()), "the frame at rest is not that of vdvr render"
event("key_down", key="4")
assert viewer.state["mode"] == "slice"
plain = rest()
assert np.array_equal(plain, program())
event("key_down", key="b")
assert viewer.state["bound"] and not np.array_equal(rest(), plain), "the bound's colours are not seen"
try:
    viewer.show(mode="sideways")
    raise SystemExit("a mode that is none was taken")
except vdvr.InputError as error:
    assert "sideways" in str(error)
event("resize", width=100, height=80, pixel_ratio=1)
assert viewer.state["width"] == 100

# --- leaks: as tests/program/soak.cpp judges ---
libc = ctypes.CDLL(None)


def held():
    gc.collect()
    libc.malloc_trim(0)
    resident = int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGESIZE") / 2**20
    return resident, len(os.listdir("/proc/self/fd"))


cycles = 1000
for i in range(cycles):
    with vdvr.open("v.vdvr") as again:
        again.render((32, 32))
    if i == cycles // 4:
        warm = held()
end = held()
allowed = 8 + 0.047 * cycles
print(f"{cycles} cycles: {warm[0]:.1f} MiB and {warm[1]} files when warm, {end[0]:.1f} MiB and {end[1]} at the end")
assert end[0] - warm[0] <= allowed, f"at most {allowed:.1f} MiB more are allowed"
assert end[1] <= warm[1], "files stay open"
print("viewer: events, frames, 1,000 cycles")
