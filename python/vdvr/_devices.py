"""The OpenCL device that work is done on."""

from __future__ import annotations

import glob
import os
import sys
import tempfile
import threading
from typing import Dict, List, Optional, Tuple, Union

from . import _core

#: A device, or what `vdvr --device` takes: an index, "cpu", "gpu", or part of a name.
DeviceLike = Union["_core.Device", str, int, None]

_lock = threading.Lock()
_opened: Dict[Tuple[str, int], "_core.Device"] = {}

_REMEDY = (
    "no OpenCL driver was found. Install one: that of your GPU, or for the processor "
    "`pip install 'vdvr[cpu]'` (Intel's runtime) or Debian's package pocl-opencl-icd"
)


def use_runtime_of_environment() -> None:
    """Lets the OpenCL loader find Intel's runtime where vdvr[cpu] put it, unless somebody chose drivers.

    The loader reads the variable when it is first asked for platforms, which is after this.
    """
    if "OCL_ICD_VENDORS" in os.environ or "OCL_ICD_FILENAMES" in os.environ:
        return
    library = os.path.join(sys.prefix, "lib", "libintelocl.so")
    if not os.path.exists(library):
        return
    # What the system has stays first: a GPU's driver is worth more than the processor's.
    system = sorted(glob.glob("/etc/OpenCL/vendors/*.icd"))
    if not system:
        folder = tempfile.mkdtemp(prefix="vdvr-icd-")
        with open(os.path.join(folder, "intel.icd"), "w", encoding="utf-8") as file:
            file.write(library + "\n")
        import atexit
        import shutil

        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        os.environ["OCL_ICD_VENDORS"] = folder


def devices() -> List["_core.DeviceInfo"]:
    """All OpenCL devices, in the order that `device=INDEX` counts them. Empty where no driver is installed."""
    use_runtime_of_environment()
    return _core.Device.list()


def device(selector: DeviceLike = None, max_memory: Optional[int] = None) -> "_core.Device":
    """Opens a device.

    Parameters
    ----------
    selector : an index of `devices()`, "cpu", "gpu", or part of a name; by default a GPU if there is one,
        else the first device.
    max_memory : bytes that our allocations on host and device may take together; by default half of the memory
        that is free.

    Raises
    ------
    DeviceError : nothing matches, or no OpenCL driver is installed; the message says what to install.
    """
    if isinstance(selector, _core.Device):
        return selector
    word = "" if selector is None else str(selector)
    if not devices():
        raise _core.DeviceError(_REMEDY)
    limit = _core.half_of_free_memory() if max_memory is None else int(max_memory)
    key = (word, -1 if max_memory is None else limit)
    with _lock:
        if key not in _opened:
            _opened[key] = _core.Device(word, limit)
        return _opened[key]
