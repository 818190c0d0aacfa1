"""Scans: projections with their geometry, from files and from arrays."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from ._choices import Path, choice, number, numbers
from ._devices import DeviceLike, device as open_device

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Called with the name of the work and how much of it is done, 0 to 1. What it raises ends the work.
Progress = Callable[[str, float], Any]

#: tomopy's names of filters, beside ours.
_TOMOPY_FILTERS = {"ramlak": "ram-lak", "shepp": "shepp-logan"}


def _projections(array: "ArrayLike", line_integrals: bool = False) -> "NDArray[np.float32]":
    data = np.asarray(array)
    if data.ndim != 3:
        raise _core.InputError(f"projections: an array of {data.ndim} axes; give [view, row, column]")
    if data.dtype.kind not in "fiu":
        raise _core.InputError(f"projections: elements of type {data.dtype}; give numbers")
    if data.dtype.kind in "iu" and not line_integrals:
        raise _core.InputError(
            f"projections: whole numbers ({data.dtype}), which are counts as a rule; give -log((counts - dark) / "
            "(flat - dark)); where that was taken, floats, or line_integrals=True of Scan"
        )
    # No copy where the layout is C's and the type float32 already.
    return np.ascontiguousarray(data, dtype=np.float32)


class Scan:
    """Line integrals of a parallel-beam scan that are in memory.

    Parameters
    ----------
    projections : array [view, row, column], line integrals (after -log), row 0 on top. float32 as it is, other
        floats rounded to float32; whole numbers with `line_integrals=True` only. A float32 array in C's order is not copied: do not write to it while
        the scan, or a build from it, is used.
    angles_deg : one angle a view, degrees.
    center : column onto which the axis of rotation projects; columns' middles are integers. By default it is
        found from the views, and where they do not tell it is the detector's middle.
    pitch : width of a column, or (width, height) of a pixel, in `unit`.
    unit : of length; densities are per `unit`.
    line_integrals : says that whole numbers are line integrals, and not counts.
    half_acquisition : a full turn about an axis off the middle, whose opposite views are rows of a wider detector;
        by default as axis and arc say, and `notes` tell.
    pad : "edge" or "mirror": how rows of objects wider than the detector go on beyond it, tapering to zero.
    heights : "common" or "all", of rows that are shifted: those that all views see, or all that are seen from every
        direction; by default all where views share fewer than half of their rows.
    shifts : how far the sample stood in each view towards higher columns, or columns and rows, in `unit`: array
        [view] or [view, 2].
    axis_roll : degrees by which the axis leans in the detector's plane, towards higher columns at higher rows.

    Raises
    ------
    InputError : sizes that do not fit, numbers that are not finite, angles that leave too little to
        reconstruct from.
    """

    _core: "_core.ProjectionSet"
    _understood: "_core.Understood"
    _source: Optional["_core.ScanSource"]

    def __init__(
        self,
        projections: "ArrayLike",
        angles_deg: "ArrayLike",
        *,
        center: Optional[float] = None,
        pitch: Union[float, Tuple[float, float]] = 1.0,
        unit: str = "pixel",
        name: str = "array",
        line_integrals: bool = False,
        half_acquisition: Optional[bool] = None,
        pad: str = "none",
        heights: Optional[str] = None,
        shifts: Optional["ArrayLike"] = None,
        axis_roll: float = 0.0,
    ) -> None:
        described = _core.ArrayScan()
        described.angles_deg = [float(a) for a in np.asarray(angles_deg, dtype=np.float64).ravel()]
        described.center = None if center is None else number(center, "center")
        pitches = (pitch, pitch) if isinstance(pitch, (int, float)) else numbers(pitch, 2, "pitch")
        described.pitch_u, described.pitch_v = (number(p, "pitch") for p in pitches)
        described.unit = unit
        described.half_acquisition = half_acquisition
        described.padding = choice(_core.Padding, pad, "pad")
        described.heights = None if heights is None else choice(_core.Heights, heights, "heights")
        described.name = name
        described.axis_roll_deg = number(axis_roll, "axis_roll")
        if shifts is not None:
            moved = np.asarray(shifts, dtype=np.float64)
            if moved.ndim == 1:
                moved = np.stack([moved, np.zeros_like(moved)], axis=1)
            if moved.ndim != 2 or moved.shape[1] != 2:
                raise _core.InputError(f"shifts: an array of shape {moved.shape}; [view] or [view, 2] is needed")
            described.shifts = [[float(u), float(v)] for u, v in moved]
        self._understood = _core.Understood()
        self._source = None
        self._core = _core.scan_of(_projections(projections, line_integrals), described)

    @classmethod
    def _of(
        cls, core: "_core.ProjectionSet", understood: "_core.Understood", source: "_core.ScanSource"
    ) -> "Scan":
        scan = cls.__new__(cls)
        scan._core = core
        scan._understood = understood
        scan._source = source
        return scan

    @property
    def data(self) -> "NDArray[np.float32]":
        """Line integrals [view, row, column]; the scan's own memory, read-only."""
        return _core.data_of(self._core)

    @property
    def shape(self) -> Tuple[int, int, int]:
        """Views, rows, columns."""
        return (len(self._core.theta_rad), self._core.rows, self._core.columns)

    @property
    def angles_deg(self) -> "NDArray[np.float64]":
        """One angle a view, degrees."""
        return np.array(self._core.angles_deg)

    @property
    def center(self) -> float:
        """Column onto which the axis projects."""
        return self._core.center

    @property
    def axis_roll(self) -> float:
        """Degrees by which the axis leans in the detector's plane; rows here stand upright on it."""
        return self._core.axis_roll_deg

    @property
    def center_source(self) -> str:
        """Who said so: "option", "file", "found" or "default"."""
        return self._core.center_source

    @property
    def pitch(self) -> Tuple[float, float]:
        """Width and height of a detector pixel, in `unit`."""
        return tuple(self._core.pitch)  # type: ignore[return-value]

    @property
    def unit(self) -> str:
        """Of length."""
        return self._core.unit

    @property
    def name(self) -> str:
        """What certificates call the scan."""
        return self._core.name

    @property
    def sha256(self) -> str:
        """Of the file, or of the array and its description."""
        return self._core.sha256

    @property
    def notes(self) -> List[str]:
        """What was noticed, a line each."""
        return self._core.notes

    @property
    def warnings(self) -> List[str]:
        """What makes it doubtful, a line each; among the notes too."""
        return self._understood.warnings

    def noise(self, *, photons: Optional[float] = None, sigma_p: Optional[float] = None) -> "_core.ScanNoise":
        """What is known of the noise, as `epsilon="1sigma"` takes it: of what is stated, else of the file's repeated
        flats, else of the projections alone. A prepared scan's file is read once more.

        Raises
        ------
        InputError : none is known; the message says why.
        """
        return _core.noise_of(self._core, self._source, photons, sigma_p)

    def save(self, path: Path) -> None:
        """Writes a Data Exchange file (HDF5) that `vdvr build` and `read_scan` read."""
        _core.write_data_exchange(path, self._core)

    def __repr__(self) -> str:
        views, rows, columns = self.shape
        return f"<vdvr.Scan {self.name}: {views} views, {rows} rows, {columns} columns, axis at {self.center:g}>"


def read_scan(
    path: Path,
    *,
    center: Optional[float] = None,
    angles_file: Optional[Path] = None,
    angle_unit: Optional[str] = None,
    shifts: Optional[Path] = None,
    axis_roll: Optional[float] = None,
    beam: Optional[str] = None,
    binning: int = 1,
    median: int = 1,
    gaussian: Tuple[float, float] = (0.0, 0.0),
    stripes: Union[bool, float, Sequence[float]] = False,
    outliers: Union[float, Sequence[float], None] = None,
    phase: Optional[Sequence[float]] = None,
    half_acquisition: Optional[bool] = None,
    pad: str = "none",
    heights: Optional[str] = None,
    flats_in_time: Optional[bool] = None,
    beam_current: Optional[str] = None,
    entry: Optional[str] = None,
    views: Union[str, Sequence[Sequence[int]], None] = None,
    darks: Union[str, float, None] = None,
    flats: Union[str, float, None] = None,
    transmission: bool = False,
    line_integrals: bool = False,
    follow_links: bool = False,
    max_memory: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Scan:
    """Reads a scan: Data Exchange or NXtomo HDF5, a folder with scan.json, an MHA or NRRD stack.

    What the options do to projections, docs/preparation.md says; certificates record it.

    Parameters
    ----------
    center : column of the axis, in columns of the prepared projections; by default the file's, else found.
    angles_file : of an MHA or NRRD stack, or an HDF5 file: one angle a view.
    angle_unit : "degrees" or "radians", of the angles, whatever their file says.
    shifts : a file of numbers, or "FILE.h5:/dataset": how far the sample stood in each view towards higher columns
        [and rows], in the unit of the pitch; "none": it stood still, whatever the scan's files say.
    axis_roll : degrees by which the axis leans in the detector's plane, towards higher columns at higher rows,
        whatever the scan's files say.
    beam : "cone" or "parallel", of an NXtomo file that says it by its distances alone.
    binning : columns and rows that become one.
    median, gaussian : side of the median's window; standard deviations in columns and rows.
    stripes : takes stripes of sinograms (rings of slices) out: True, the ratio of a stripe to noise, or (ratio,
        large window, small window).
    outliers : takes out pixels whose transmission is above their neighbours' median by more than this fraction
        of the open beam; or (fraction, side of the window).
    phase : (distance from object to detector in mm, energy in keV, delta / beta) of Paganin's phase retrieval.
    half_acquisition : a full turn about an axis off the middle, whose opposite views are rows of a wider detector;
        by default as axis and arc say, with a warning.
    pad : "edge" or "mirror": how rows of objects wider than the detector go on beyond it, tapering to zero.
    heights : "common" or "all", of views that saw the sample at other heights: those that all see, or all that are
        seen from every direction; by default all where views share fewer than half of their rows.
    flats_in_time : divides projections by what lies between the flats before and after them; by default where the
        order of frames is known. False: by the mean of all flats.
    beam_current : the dataset of an HDF5 file with the beam's current in each frame, by which frames are divided; by
        default the usual one, where the file has it. "none": they are not.
    entry : the group of an HDF5 file that holds the scan, where there are several.
    views : the projections used: "0:40,41:90", or [(0, 40), (41, 90)], half-open.
    darks, flats : "none", or one number that stands for them: counts without beam, counts of the open beam.
    transmission : values are transmissions, normalised by flats and darks, without -log.
    line_integrals : values are line integrals, whatever they look like.
    max_memory : bytes; by default half of what is free.

    What makes the scan doubtful comes as a Python warning, and stands in `Scan.warnings`.
    """
    options = _core.ScanOptions()
    options.center = None if center is None else number(center, "center")
    options.angles_file = None if angles_file is None else angles_file
    options.shifts = "" if shifts is None else str(shifts)
    options.beam = None if beam is None else choice(_core.Beam, beam, "beam")
    options.input = _statement(entry, views, darks, flats, transmission, line_integrals, angle_unit)
    options.input.beam_current = beam_current or ""
    options.input.axis_roll_deg = None if axis_roll is None else number(axis_roll, "axis_roll")
    options.follow_links = follow_links
    options.max_memory_bytes = _core.half_of_free_memory() if max_memory is None else int(max_memory)
    preparation = _core.Preparation()
    preparation.binning = int(binning)
    preparation.median = int(median)
    preparation.gaussian = list(numbers(gaussian, 2, "gaussian"))
    if stripes is not False:
        preparation.stripes = _step(_core.Stripes(), ("ratio", "large", "small"), stripes, "stripes")
    if outliers is not None:
        preparation.outliers = _step(_core.Outliers(), ("threshold", "window"), outliers, "outliers")
    if phase is not None:
        members = ("distance_mm", "energy_kev", "delta_beta")
        preparation.phase = _step(_core.PhaseRetrieval(), members, numbers(phase, 3, "phase"), "phase")
    preparation.half_acquisition = None if half_acquisition is None else bool(half_acquisition)
    preparation.padding = choice(_core.Padding, pad, "pad")
    preparation.heights = None if heights is None else choice(_core.Heights, heights, "heights")
    preparation.flats_in_time = None if flats_in_time is None else bool(flats_in_time)
    options.preparation = preparation
    scan = Scan._of(*_core.read_scan(path, options, progress), _core.ScanSource(path, options))
    for text in scan.warnings:
        warnings.warn(text, stacklevel=2)
    return scan


def _statement(
    entry: Optional[str],
    views: Union[str, Sequence[Sequence[int]], None],
    darks: Union[str, float, None],
    flats: Union[str, float, None],
    transmission: bool,
    line_integrals: bool,
    angle_unit: Optional[str],
) -> "_core.InputStatement":
    """What the caller says of an input that its files do not say, or say otherwise."""
    if transmission and line_integrals:
        raise _core.InputError("transmission and line_integrals exclude each other")
    stated = _core.InputStatement()
    stated.entry = entry or ""
    if isinstance(views, str):
        stated.views = _core.view_ranges_of(views)
    elif views is not None:
        stated.views = [(int(first), int(end)) for first, end in views]
    if darks is not None:
        stated.dark = 0.0 if darks == "none" else number(darks, "darks")
    if flats is not None:
        stated.flat = 1.0 if flats == "none" else number(flats, "flats")
    if transmission:
        stated.values = choice(_core.SampleValues, "transmission", "values")
    if line_integrals:
        stated.values = choice(_core.SampleValues, "line integrals", "values")
    if angle_unit is not None:
        stated.angle_unit = choice(_core.AngleUnit, angle_unit, "angle_unit")
    return stated


def _step(step: Any, members: Sequence[str], given: Any, name: str) -> Any:
    """A step of preparation with its numbers: True leaves them as they are, one number is the first of them."""
    if given is True:
        return step
    values = [given] if np.ndim(given) == 0 else list(given)
    if len(values) not in (1, len(members)):
        raise _core.InputError(f"{name}: {len(values)} numbers; give {len(members)} ({', '.join(members)}) or the first")
    for member, value in zip(members, values):
        whole = isinstance(getattr(step, member), int)
        if whole and number(value, name) != int(value):
            raise _core.InputError(f"{name}: {member} {value} is not a whole number of pixels")
        setattr(step, member, int(value) if whole else number(value, name))
    return step


def find_center(scan: Scan) -> Optional["_core.CenterEstimate"]:
    """The column of the axis from the data, and how sure that is; None where no method applies.

    `scan.center` is not looked at. An estimate that is not `sure` may be off by any number of columns.
    """
    return _core.find_center(scan._core)


def find_roll(scan: Scan) -> Optional["_core.RollEstimate"]:
    """How far the axis leans in the detector's plane, from the data, and how sure that is; None where rows do not tell.

    What the scan was read with is in it: of `Scan(..., axis_roll=1.5)` it is about 1.5.
    """
    return _core.find_roll(scan._core)


def recon(
    tomo: "ArrayLike",
    theta: "ArrayLike",
    center: Optional[float] = None,
    filter_name: str = "ramlak",
    *,
    sinogram_order: bool = False,
    upsampling: int = 8,
    device: DeviceLike = None,
    progress: Optional[Progress] = None,
) -> "NDArray[np.float32]":
    """Filtered back-projection in tomopy's order and units. Nothing is certified; `build` does that.

    Parameters
    ----------
    tomo : line integrals [view, row, column], or with `sinogram_order` [row, view, column].
    theta : one angle a view, radians.
    center : column onto which the axis projects, columns' middles being integers: what tomopy's gridrec takes and
        its find_center functions give, and what `Scan(center=)` is. By default the middle, (columns - 1) / 2.
    filter_name : "ramlak", "shepp", "cosine", "hamming" or "hann".
    upsampling : of the filtered projections before they are interpolated linearly; 1 is the usual FBP.

    Returns
    -------
    float32 [row, y, x] of shape (rows, columns, columns), density per column width; the axis goes through the
    middle of the slice. As in tomopy, a point at column x and row y of a slice, both from its middle, is seen at
    x cos(theta) - y sin(theta). Outside of the circle that all views see values mean nothing.
    """
    data = np.asarray(tomo)
    if data.ndim == 3 and sinogram_order:
        data = data.transpose(1, 0, 2)
    described = _core.ArrayScan()
    described.angles_deg = _core.degrees_of([float(a) for a in np.asarray(theta, dtype=np.float64).ravel()])
    projections = _projections(data)
    described.center = 0.5 * (projections.shape[2] - 1) if center is None else number(center, "center")
    options = _core.ReconstructOptions()
    options.upsampling = int(upsampling)
    field = _core.FieldOptions()
    field.filter = choice(_core.RampWindow, _TOMOPY_FILTERS.get(filter_name, filter_name), "filter_name")
    options.field = field
    scan = _core.scan_of(projections, described)
    slices = _core.slices(open_device(device), scan, options, progress)
    # Our y points against the rows of tomopy's slices.
    return np.ascontiguousarray(slices[: projections.shape[1], ::-1, :])
