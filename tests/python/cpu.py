#!/usr/bin/env python3
"""The wheel with its extra `cpu`, on a machine that has no OpenCL driver of its own.

  cpu.py
"""
import glob
import sys

import numpy as np

# The system's drivers are out of sight of what looks for them.
found = glob.glob
glob.glob = lambda pattern, **options: [] if "OpenCL/vendors" in pattern else found(pattern, **options)
import vdvr  # noqa: E402

devices = vdvr.devices()
print([d.name for d in devices], [d.driver for d in devices])
assert devices and all(d.is_cpu for d in devices) and all("Intel" in d.platform for d in devices)
theta = np.arange(60) * np.pi / 60
v, u = np.mgrid[:24, :33].astype(float)
middle = 3 * np.cos(theta)[:, None, None]
tomo = 2 * np.sqrt(np.maximum(0, 49 - (u - 16 - middle) ** 2 - (v - 11.5) ** 2))
scan = vdvr.Scan(tomo, np.rad2deg(theta), center=16.0)
volume = vdvr.build(scan, "4%")
assert vdvr.verify(volume, scan)
assert volume.render((64, 48)).std() > 5
assert "jupyter_rfb" not in sys.modules and "vtk" not in sys.modules
print("cpu: a certified volume and a picture by Intel's runtime from PyPI")
