"""X-ray CT projections and a tolerance in, a certified volume and pictures out.

    scan = vdvr.read_scan("tooth.h5")             # or vdvr.Scan(array, angles_deg)
    volume = vdvr.build(scan, epsilon="3%")       # |V - F| <= 3 % of F's range, proved
    volume.save("tooth.vdvr")
    values, bounds = volume(points), volume.bound(points)
    picture = volume.render(size=(512, 512), azimuth=40)

F is the field that filtered back-projection with ideal interpolation defines, V what is stored. Arrays are
[z, y, x], projections [view, row, column]; points are x, y, z in the scan's unit of length. Long functions let
other threads run and end at Ctrl-C. The tutorial: docs/python.md.
"""

from . import _loader  # first: what follows needs it
from ._core import (
    BuildError,
    CenterEstimate,
    DeviceError,
    Error,
    FileError,
    Grid,
    InputError,
    MismatchError,
    PictureVerification,
    Plan,
    ResourceError,
    ToleranceError,
    TransferFunction,
    Verification,
    __version__,
)
from ._audit import audit
from ._certify import build, plan, verify, verify_picture
from ._devices import device, devices
from ._scans import Scan, find_center, find_roll, read_scan, recon
from ._volume import CertifiedPicture, Volume, open, transfer_presets

__all__ = [
    "BuildError", "CenterEstimate", "CertifiedPicture", "DeviceError", "Error", "FileError", "Grid", "InputError",
    "MismatchError", "PictureVerification", "Plan", "ResourceError", "Scan", "ToleranceError", "TransferFunction",
    "Verification", "Viewer", "Volume", "__version__", "audit", "build", "device", "devices", "find_center", "find_roll", "open", "plan",
    "read_scan", "recon", "transfer_presets", "verify", "verify_picture",
]


def __getattr__(name: str) -> object:
    # jupyter_rfb is an extra: it is imported when somebody asks for a viewer.
    if name == "Viewer":
        from ._viewer import Viewer

        return Viewer
    raise AttributeError(f"module 'vdvr' has no attribute {name!r}")
