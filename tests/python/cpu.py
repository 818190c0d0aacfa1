#!/usr/bin/env python3
"""The wheel with its extra `cpu`, on a machine that has no OpenCL of its own, neither driver nor loader.

  cpu.py
"""
import ctypes
import glob
import os
import pathlib
import subprocess
import sys

import numpy as np

# Where the system lets us, its OpenCL is gone for this process and its children; else its drivers are out of sight of
# what looks for them.
WITHOUT = "VDVR_TEST_WITHOUT_OPENCL"
hide = """set -e
mount --make-rprivate /
for file in $(ldconfig -p | sed -n 's/.*libOpenCL.so[^ ]* .*=> //p'); do mount --bind /dev/null "$file"; done
if [ -d /etc/OpenCL/vendors ]; then mount -t tmpfs none /etc/OpenCL/vendors; fi
"""
if WITHOUT not in os.environ and subprocess.run(["unshare", "--mount", "sh", "-c", hide], capture_output=True).returncode == 0:
    again = ["unshare", "--mount", "sh", "-c", hide + 'exec "$@"', "sh", sys.executable, *sys.argv]
    raise SystemExit(subprocess.run(again, env={**os.environ, WITHOUT: "1"}).returncode)
if WITHOUT in os.environ:
    assert not glob.glob("/etc/OpenCL/vendors/*")
    try:
        ctypes.CDLL("libOpenCL.so.1")
        raise SystemExit("the system's libOpenCL is still there")
    except OSError:
        pass
else:
    print("the system's OpenCL cannot be hidden here: its loader is used")
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
if WITHOUT in os.environ:
    # Without the extra, too (an empty prefix): one line with the remedy, from the command and from the import.
    bare = ["import sys; sys.prefix = '/nowhere'; sys.argv = ['/venv/bin/vdvr', '--version']; import vdvr",
            "import sys; sys.prefix = '/nowhere'; import vdvr"]
    ended = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True) for code in bare]
    assert ended[0].returncode == 3 and ended[0].stderr.startswith("vdvr: libOpenCL.so.1 was not found"), ended[0]
    assert ended[0].stderr.count("\n") == 1 and "vdvr[cpu]" in ended[0].stderr, ended[0]
    assert ended[1].returncode == 1 and "ImportError: libOpenCL.so.1 was not found" in ended[1].stderr, ended[1]
    command = str(pathlib.Path(sys.executable).with_name("vdvr"))
    subprocess.run([command, "simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "40", "-o", "s.h5"], check=True)
    subprocess.run([command, "run", "s.h5", "--epsilon", "4%", "-o", "result"], check=True, stdout=subprocess.DEVNULL)
    assert pathlib.Path("result/certificate.json").stat().st_size > 1000
print("cpu: a certified volume and a picture by Intel's runtime from PyPI")
