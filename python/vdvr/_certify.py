"""From a scan and a tolerance to a certified volume, and the certificate measured again."""

from __future__ import annotations

from typing import Any, Optional, Sequence, Union

from . import _core
from ._choices import Path, choice, number, numbers, tolerance
from ._devices import DeviceLike, device as open_device
from ._scans import Progress, Scan
from ._volume import Volume, path_or_volume


def _options(
    scan: Scan,
    *,
    filter: str,
    cutoff: float,
    size: Optional[Sequence[int]],
    spacing: Union[float, Sequence[float], None],
    origin: Optional[Sequence[float]],
    roi: Optional[Sequence[float]],
    upsampling: Optional[int],
    u_filter: Optional[str],
    gold: Optional[int],
    levels: str,
    granularity: int,
    storage: str,
) -> "_core.CertifyOptions":
    if not isinstance(scan, Scan):
        raise _core.InputError(f"scan: a {type(scan).__name__}; give a vdvr.Scan, or what read_scan returns")
    options = _core.CertifyOptions()
    field = _core.FieldOptions()
    field.filter = choice(_core.RampWindow, filter, "filter")
    field.cutoff = number(cutoff, "cutoff")
    options.field = field
    options.size = None if size is None else [int(n) for n in numbers(size, 3, "size")]
    if isinstance(spacing, (int, float)):
        options.spacing = number(spacing, "spacing")
    elif spacing is not None:
        options.spacing, options.spacing_z = numbers(spacing, 2, "spacing")
    options.origin = None if origin is None else list(numbers(origin, 3, "origin"))
    options.roi = None if roi is None else list(numbers(roi, 6, "roi"))
    options.upsampling = None if upsampling is None else int(upsampling)
    options.u_filter = None if u_filter is None else choice(_core.Interpolation, u_filter, "u_filter")
    options.gold = None if gold is None else int(gold)
    options.levels = choice(_core.Levels, levels, "levels")
    options.granularity = int(granularity)
    options.storage = choice(_core.StorageChoice, storage, "storage")
    return options


def plan(
    scan: Scan,
    epsilon: Union[str, float, None] = None,
    *,
    epsilon_abs: Optional[float] = None,
    filter: str = "ram-lak",
    cutoff: float = 1.0,
    size: Optional[Sequence[int]] = None,
    spacing: Union[float, Sequence[float], None] = None,
    origin: Optional[Sequence[float]] = None,
    roi: Optional[Sequence[float]] = None,
    upsampling: Optional[int] = None,
    u_filter: Optional[str] = None,
    gold: Optional[int] = None,
    levels: str = "anisotropic",
    granularity: int = 4,
    storage: str = "auto",
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> "_core.Plan":
    """What `build` with the same arguments would do, store and cost. Builds nothing.

    Raises
    ------
    ToleranceError : the tolerance is out of reach; the message says what would do.
    """
    options = _options(scan, filter=filter, cutoff=cutoff, size=size, spacing=spacing, origin=origin, roi=roi,
                       upsampling=upsampling, u_filter=u_filter, gold=gold, levels=levels,
                       granularity=granularity, storage=storage)
    return _core.make_plan(open_device(device), scan._core, tolerance(epsilon, epsilon_abs), options, progress)


def build(
    scan: Scan,
    epsilon: Union[str, float, None] = None,
    *,
    epsilon_abs: Optional[float] = None,
    filter: str = "ram-lak",
    cutoff: float = 1.0,
    size: Optional[Sequence[int]] = None,
    spacing: Union[float, Sequence[float], None] = None,
    origin: Optional[Sequence[float]] = None,
    roi: Optional[Sequence[float]] = None,
    upsampling: Optional[int] = None,
    u_filter: Optional[str] = None,
    gold: Optional[int] = None,
    levels: str = "anisotropic",
    granularity: int = 4,
    storage: str = "auto",
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> Volume:
    """Builds the certified volume V: |V - F| is at most epsilon at every covered point.

    Parameters
    ----------
    epsilon : "3%" or 0.03 of F's range; or
    epsilon_abs : a density.
    filter, cutoff : of the ramp ("ram-lak", "shepp-logan", "cosine", "hamming", "hann"); they define F.
    size : cells x, y, z of the grid; by default the covered region's.
    spacing : of samples, or that in x and y and that in z, in the scan's unit; by default the detector's pitch.
    origin : x, y, z of the first sample.
    roi : x0, y0, z0, x1, y1, z1: certify the points of this box alone.
    upsampling, u_filter, gold : rates; by default the plan chooses.
    levels, granularity, storage : how V is stored.
    progress : called with a stage's name and how much of it is done, about 20 times a second.

    Raises
    ------
    ToleranceError : the tolerance is out of reach; the message says what would do.
    KeyboardInterrupt : Ctrl-C, within about a second.
    """
    options = _options(scan, filter=filter, cutoff=cutoff, size=size, spacing=spacing, origin=origin, roi=roi,
                       upsampling=upsampling, u_filter=u_filter, gold=gold, levels=levels,
                       granularity=granularity, storage=storage)
    options.foresee = False
    held = _core.build(open_device(device), scan._core, tolerance(epsilon, epsilon_abs), options, progress)
    return Volume(held, device)


def verify(
    volume: Union[Volume, Path],
    scan: Scan,
    *,
    exhaustive: bool = False,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> "_core.Verification":
    """Measures a certificate again, from the projections and the stored volume alone.

    Parameters
    ----------
    volume : a Volume, or the path of a .vdvr file.
    scan : the projections that it was built from.
    exhaustive : every cell, instead of a stratified sample of bricks and the worst ones.

    Returns
    -------
    Verification : true where the certificate holds; `failure` says what does not.

    Raises
    ------
    MismatchError : the certificate is of other projections, or of a file whose seal is broken.
    """
    options = _core.VerifyOptions()
    options.exhaustive = exhaustive
    where: Any = path_or_volume(volume)
    work = _core.verify_held if isinstance(where, _core.HeldVolume) else _core.verify_path
    return work(open_device(device), where, scan._core, options, progress)
