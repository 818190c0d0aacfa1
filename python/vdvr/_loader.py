"""OpenCL's loader, libOpenCL.so.1, which the extension is linked with and the wheel does not hold.

The system's knows the system's drivers, so it comes first. Where there is none, vdvr[cpu] has brought one. Imported
before the extension is.
"""

import ctypes
import os
import sys

_NAME = "libOpenCL.so.1"
# What Intel's loader needs, and does not say where it is; each after what it needs itself.
_BEFORE = ("libintlc.so.5", "libirng.so", "libimf.so", "libsvml.so")
_DEVICE = 3  # the exit code of the program where a device is missing
_REMEDY = (
    f"{_NAME} was not found: install Debian's ocl-icd-libopencl1 with a driver of your GPU, or for the processor "
    "`pip install 'vdvr[cpu]'`"
)


def _load() -> None:
    try:
        ctypes.CDLL(_NAME, mode=ctypes.RTLD_GLOBAL)
        return
    except OSError:
        folder = os.path.join(sys.prefix, "lib")
    if not os.path.exists(os.path.join(folder, _NAME)):
        if os.path.basename(sys.argv[0]) == "vdvr":  # the command: what the user needs is the line, not a traceback
            print(f"vdvr: {_REMEDY}", file=sys.stderr)
            raise SystemExit(_DEVICE)
        raise ImportError(_REMEDY)
    for name in (*_BEFORE, _NAME):
        path = os.path.join(folder, name)
        if os.path.exists(path):
            ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)


_load()
