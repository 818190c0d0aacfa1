"""Anybody's volume against F."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence, Union

import numpy as np

from . import _core
from ._choices import Path, choice, number, numbers
from ._devices import DeviceLike, device as open_device
from ._scans import Progress, Scan

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def audit(
    volume: Union["ArrayLike", Path],
    scan: Scan,
    *,
    spacing: Union[float, Sequence[float], None] = None,
    origin: Optional[Sequence[float]] = None,
    interpolate: str = "linear",
    as_is: bool = False,
    within: Union[str, float, None] = None,
    radius: Optional[float] = None,
    roi: Optional[Sequence[float]] = None,
    filter: str = "ram-lak",
    cutoff: float = 1.0,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> Dict[str, Any]:
    """How far a volume of any program lies from F of the scan, at its samples and between them (docs/audit.md).

    Parameters
    ----------
    volume : array [z, y, x], or the path of an MHA, NRRD, NPY, TIFF or FILE.h5:/dataset volume.
    spacing : between samples, one number or x, y, z, in the scan's unit; by default the file's, else the detector's
        pitch at the axis.
    origin : x, y, z of the first sample; by default the file's, else the volume's middle lies on the axis.
    interpolate : "nearest", "linear" or "cubic": what the volume is between its samples.
    as_is : do not look for turns, mirrors, factors, shifts, another centre or window.
    within : "5%" of F's range, or a density; `met` says whether the volume is proved to lie that near everywhere.
    radius, roi : compare only what is that near to the axis, in this box (x0, y0, z0, x1, y1, z1).
    filter, cutoff : what F is, as of `build`.

    Returns
    -------
    dict with `registration` (`found` is a list of what is off, in words), `as_is` and, where something is off,
    `registered`: figures of the volume as it is and when that is put right. `rms` and `largest` are of the samples;
    between them |W - F| is `lower` at `lower_at`, and nowhere above `upper`, which is proved.

    Raises
    ------
    InputError : nothing of the volume lies where all views see it.
    """
    options = _core.AuditOptions()
    field = _core.FieldOptions()
    field.filter = choice(_core.RampWindow, filter, "filter")
    field.cutoff = number(cutoff, "cutoff")
    options.field = field
    options.between = choice(_core.Between, interpolate, "interpolate")
    options.as_is = bool(as_is)
    options.radius = None if radius is None else number(radius, "radius")
    options.roi = None if roi is None else list(numbers(roi, 6, "roi"))
    if within is not None:
        options.within_share = isinstance(within, str) and within.endswith("%")
        options.within = number(within[:-1], "within") / 100 if options.within_share else number(within, "within")
    place = _core.PlaceOptions()
    if spacing is not None:
        place.spacing = [number(spacing, "spacing")] * 3 if np.ndim(spacing) == 0 else list(numbers(spacing, 3, "spacing"))
    place.origin = None if origin is None else list(numbers(origin, 3, "origin"))
    on = open_device(device)
    if isinstance(volume, (str, os.PathLike)):
        return _core.audit_file(on, scan._core, volume, place, options, progress)
    samples = np.asarray(volume)
    if samples.ndim != 3 or samples.dtype.kind not in "fiu":
        raise _core.InputError(f"volume: an array of {samples.ndim} axes of {samples.dtype}; give numbers [z, y, x]")
    samples = np.ascontiguousarray(samples, dtype=np.float32)
    if not np.isfinite(samples).all():
        raise _core.InputError("volume: some samples are no finite numbers; say what they are with numpy.nan_to_num")
    return _core.audit(on, scan._core, samples, place, options, progress)
