"""From a scan and a tolerance to a certified volume, and the certificate measured again."""

from __future__ import annotations

import os
from typing import Any, Optional, Sequence, Tuple, Union

from . import _core
from ._choices import Path, choice, number, numbers, takes, tolerance
from ._devices import DeviceLike, device as open_device
from ._scans import Progress, Scan
from ._volume import Volume, compressed, open as open_volume, path_or_volume


def _options(
    *,
    filter: str = "ram-lak",
    cutoff: float = 1.0,
    size: Optional[Sequence[int]] = None,
    spacing: Union[float, Sequence[float], None] = None,
    origin: Optional[Sequence[float]] = None,
    roi: Optional[Sequence[float]] = None,
    window: Optional[Tuple[float, float]] = None,
    upsampling: Optional[int] = None,
    u_filter: Optional[str] = None,
    gold: Optional[int] = None,
    levels: Optional[str] = None,
    granularity: int = 4,
    base: Optional[Sequence[int]] = None,
    storage: str = "auto",
    closing: str = "coarse",
    coefficients: str = "midrange",
    terms: str = "all",
    epsilon_of: str = "range",
) -> "_core.CertifyOptions":
    """
    filter, cutoff : of the ramp ("ram-lak", "shepp-logan", "cosine", "hamming", "hann"); they define F.
    size : cells x, y, z of the grid; by default the covered region's.
    spacing : of samples, or that in x and y and that in z, in the scan's unit; by default the detector's pitch.
    origin : x, y, z of the first sample.
    roi : x0, y0, z0, x1, y1, z1: certify the points of this box alone.
    window : (lo, hi): test only where the field meets these densities.
    upsampling, u_filter, gold : rates; by default the plan chooses.
    levels, granularity, base, storage : how V is stored: "anisotropic" (the default) or "isotropic", cells of a
        brick, cells x, y, z per base sample, "auto", "f32", "u16" or "u8".
    closing, coefficients, terms, epsilon_of : of comparisons with the paper, as `vdvr build` has them. With closing
        "none" or terms "grid" nothing is certified.
    """
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
    options.window = None if window is None else _window(window)
    options.upsampling = None if upsampling is None else int(upsampling)
    options.u_filter = None if u_filter is None else choice(_core.Interpolation, u_filter, "u_filter")
    options.gold = None if gold is None else int(gold)
    # The paper's closing is defined for these alone.
    levels = levels or ("isotropic" if closing == "paper" else "anisotropic")
    options.levels = choice(_core.Levels, levels, "levels")
    options.granularity = int(granularity)
    options.coarsening = None if base is None else _coarsening(base)
    options.storage = choice(_core.StorageChoice, storage, "storage")
    comparison = _core.Comparison()
    comparison.closing = choice(_core.Closing, closing, "closing")
    comparison.coefficients = choice(_core.Coefficients, coefficients, "coefficients")
    comparison.terms = choice(_core.Terms, terms, "terms")
    if epsilon_of not in ("range", "max"):
        raise _core.InputError(f"epsilon_of: '{epsilon_of}' is none of range, max")
    comparison.epsilon_of_max = epsilon_of == "max"
    options.comparison = comparison
    return options


def _window(given: Sequence[float]) -> Tuple[float, float]:
    lo, hi = numbers(given, 2, "window")
    if lo > hi:
        raise _core.InputError(f"window: {lo} lies above {hi}")
    return lo, hi


def _coarsening(base: Sequence[int]) -> Sequence[int]:
    """log2 of cells per base sample, z, y, x."""
    cells = numbers(base, 3, "base")
    if not all(n in (1, 2, 4, 8) for n in cells):
        raise _core.InputError(f"base: {tuple(base)}; cells x, y, z per base sample are 1, 2, 4 or 8")
    return [int(n).bit_length() - 1 for n in reversed(cells)]


def _checked(scan: Any) -> Any:
    if not isinstance(scan, Scan):
        raise _core.InputError(f"scan: a {type(scan).__name__}; give a vdvr.Scan, or what read_scan returns")
    return scan._core


def _stated(scan: Any) -> "_core.InputStatement":
    """What read_scan was told beside the file, for the certificate."""
    return scan._understood.stated if isinstance(scan, Scan) else _core.InputStatement()


@takes(_options)
def plan(
    scan: Scan,
    epsilon: Union[str, float, None] = None,
    *,
    epsilon_abs: Optional[float] = None,
    photons: Optional[float] = None,
    sigma_p: Optional[float] = None,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> "_core.Plan":
    """What `build` with the same arguments would do, store and cost. Builds nothing.

    Raises
    ------
    ToleranceError : the tolerance is out of reach; the message says what would do.
    """
    wanted = _options(**options)
    wanted.input = _stated(scan)
    projections, asked = _checked(scan), tolerance(epsilon, epsilon_abs, photons, sigma_p)
    asked.source = scan._source
    return _core.make_plan(open_device(device), projections, asked, wanted, progress)


@takes(_options)
def build(
    scan: Scan,
    epsilon: Union[str, float, None] = None,
    *,
    epsilon_abs: Optional[float] = None,
    photons: Optional[float] = None,
    sigma_p: Optional[float] = None,
    save: Optional[Path] = None,
    overwrite: bool = False,
    compression: str = "deflate",
    resume: bool = False,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Volume:
    """Builds the certified volume V: |V - F| is at most epsilon at every covered point.

    Parameters
    ----------
    epsilon : "3%" or 0.03 of F's range; "1sigma": of the scan's own noise, brick by brick; or
    epsilon_abs : a density.
    photons, sigma_p : with "1sigma": photons of a pixel in the open beam, or the standard deviation of every line
        integral, in place of what the projections tell.
    save : path of a .vdvr file that is written too. While the build goes on `SAVE.journal` keeps what is finished;
        it is removed once the file is in place.
    overwrite, compression : as `Volume.save` has them.
    resume : continue what an interrupted build left in that journal.
    progress : called with a stage's name and how much of it is done, about 20 times a second.
    OPTIONS

    Raises
    ------
    ToleranceError : the tolerance is out of reach; the message says what would do.
    KeyboardInterrupt : Ctrl-C, within about a second.
    """
    wanted = _options(**options)
    wanted.input = _stated(scan)
    wanted.forecast = False
    projections, asked = _checked(scan), tolerance(epsilon, epsilon_abs, photons, sigma_p)
    asked.source = scan._source
    if save is None:
        if resume:
            raise _core.InputError("resume: give save=, beside which the journal lies")
        return Volume(_core.build(open_device(device), projections, asked, wanted, progress), device)
    if not overwrite and os.path.exists(save):
        raise _core.InputError(f"{os.fspath(save)}: exists already; overwrite=True replaces it")
    held = _core.build_into(open_device(device), projections, asked, wanted, save, compressed(compression), resume,
                            progress)
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
    return work(open_device(device), where, _checked(scan), scan._source, options, progress)


def verify_picture(
    certificate: Path,
    volume: Union[Volume, Path],
    scan: Optional[Scan] = None,
    *,
    rays: int = 16,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> "_core.PictureVerification":
    """Draws and certifies again what X.certificate.json describes, and compares.

    Parameters
    ----------
    volume : that it is a picture of: a Volume, or the path of a .vdvr file.
    scan : the projections that the volume was built from: then F itself is evaluated along random rays.
    rays : how many.

    Returns
    -------
    PictureVerification : true where all of it holds; `failures` says what does not.

    Raises
    ------
    FileError : it is no certificate of a picture. MismatchError : it is of another volume, or the scan is.
    """
    held = volume if isinstance(volume, Volume) else open_volume(volume)
    return _core.verify_picture(
        open_device(device), held._held, certificate, None if scan is None else _checked(scan), int(rays), progress)
