"""OpenCL's loader, libOpenCL.so.1, which the extension is linked with and the wheel does not hold.

The system's knows the system's drivers, so it comes first. Where there is none, vdvr[cpu] has brought one. Imported
before the extension is.
"""

import ctypes
import os
import sys

_NAME = "libOpenCL.so.1"
_REMEDY = (
    f"{_NAME} was not found: install Debian's ocl-icd-libopencl1 with a driver of your GPU, or for the processor "
    "`pip install 'vdvr[cpu]'`"
)


def _load() -> None:
    try:
        ctypes.CDLL(_NAME, mode=ctypes.RTLD_GLOBAL)
    except OSError:
        brought = os.path.join(sys.prefix, "lib", _NAME)
        if not os.path.exists(brought):
            raise ImportError(_REMEDY) from None
        ctypes.CDLL(brought, mode=ctypes.RTLD_GLOBAL)


_load()
