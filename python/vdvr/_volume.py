"""Certified volumes."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from ._choices import Path, axis, choice, number, numbers, sizes, spacings, takes
from ._devices import DeviceLike, device as open_device
from ._measure import Measured

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: A preset's name, the path of a file, points (density, red, green, blue, opacity), or a function of these.
TransferLike = Union[str, "os.PathLike[str]", Sequence[Sequence[float]], "_core.TransferFunction", None]


class Volume(Measured):
    """A certified volume V, and the certificate that says how far it lies from F at most.

    `volume(points)` is V, `volume.bound(points)` what |V - F| is at most. Made by `build` and `open`. Several
    threads may use one; pictures of it are drawn one after the other.
    """

    def __init__(self, held: "_core.HeldVolume", device: DeviceLike = None) -> None:
        self._held = held
        self._device = device

    # --- what it is ---

    @property
    def certificate(self) -> Dict[str, Any]:
        """As docs/file-format.md has it; densities per unit of length."""
        return json.loads(self._held.certificate_json)

    @property
    def epsilon(self) -> float:
        """The tolerance as a fraction of F's range."""
        return self._held.epsilon

    @property
    def epsilon_abs(self) -> float:
        """The same as a density."""
        return self._held.epsilon_abs

    @property
    def grid(self) -> "_core.Grid":
        """Cells x, y, z, where the first sample lies, how far they are apart, the unit of length."""
        return self._held.grid

    @property
    def levels(self) -> "NDArray[np.uint8]":
        """uint8 [brick z, brick y, brick x, 3]: how fine each brick is along z, y, x; 0 is the base."""
        return self._held.levels()

    @property
    def content_sha256(self) -> str:
        """Hash of samples and index, computed anew (docs/file-format.md)."""
        return self._held.content_sha256

    def __repr__(self) -> str:
        n = self.grid.samples
        return f"<vdvr.Volume {n[0]} x {n[1]} x {n[2]} samples, |V - F| <= {self.epsilon_abs:.4g}>"

    # --- values ---

    def __call__(self, points: "ArrayLike") -> "NDArray[np.float32]":
        """V at points, in density: float32 [...] of points [..., 3] (x, y, z). NaN where F is not known, which
        is outside of the region that all views see. The values of `vdvr probe`."""
        flat, shape = _points(points)
        return self._held.values(flat).reshape(shape)

    def bound(self, points: "ArrayLike") -> "NDArray[np.float32]":
        """What |V - F| is at most at points, in density: float32 [...] of points [..., 3] (x, y, z).

        Of the brick that holds the point; at most the certificate's total, which is below epsilon. NaN where
        nothing is promised: not covered, outside of a region of interest.
        """
        flat, shape = _points(points)
        return self._held.bounds(flat).reshape(shape)

    def sigma(self, points: "ArrayLike") -> "NDArray[np.float32]":
        """What the scan's noise is worth at points, the standard deviation of F in the brick there, in density:
        float32 [...] of points [..., 3] (x, y, z). An estimate, not proved. NaN where points are not covered,
        everywhere where the certificate knows no noise (`certificate["noise"]`)."""
        flat, shape = _points(points)
        return self._held.sigmas(flat).reshape(shape)

    def lattice(
        self, spacing: Union[float, Sequence[float], None] = None, box: Optional[Sequence[float]] = None
    ) -> "_core.Lattice":
        """Where the samples of `to_numpy` with the same arguments lie: `origin`, `spacing`, `count`, each
        x, y, z."""
        return self._held.lattice(spacings(spacing), None if box is None else list(numbers(box, 6, "box")))

    def to_numpy(
        self, spacing: Union[float, Sequence[float], None] = None, box: Optional[Sequence[float]] = None
    ) -> "NDArray[np.float32]":
        """V on uniform samples: float32 [z, y, x], density.

        Parameters
        ----------
        spacing : of samples, one length or x, y, z; by default the grid's. Half of that, a quarter and so on
            give what `vdvr export --oversampling` writes.
        box : x0, y0, z0, x1, y1, z1: the samples in this closed box alone.

        Samples outside of the region that all views see are 0 or mean nothing; `bound_to_numpy` is NaN there.
        """
        return self._held.on_lattice(self.lattice(spacing, box), False)

    def bound_to_numpy(
        self, spacing: Union[float, Sequence[float], None] = None, box: Optional[Sequence[float]] = None
    ) -> "NDArray[np.float32]":
        """What |V - F| is at most at the samples of `to_numpy`: float32 [z, y, x], NaN where nothing is
        promised."""
        return self._held.on_lattice(self.lattice(spacing, box), True)

    # --- pictures ---

    def _view(
        self,
        size: Tuple[int, int],
        mode: str,
        transfer: TransferLike,
        *,
        azimuth: float = 30.0,
        elevation: float = 20.0,
        zoom: float = 1.0,
        frame: str = "shown",
        camera: Optional[Dict[str, Any]] = None,
        transfer_range: Optional[Tuple[float, float]] = None,
        iso: Union[float, Sequence[float], None] = None,
        iso_opacity: Optional[Sequence[float]] = None,
        slice_axis: str = "z",
        slice_position: Optional[float] = None,
        clip: Optional[Sequence[float]] = None,
        step: float = 1.0,
        step_mode: Optional[str] = None,
        classification: str = "post",
        gradient: str = "auto",
        shading: bool = True,
        lights: Optional[Sequence[Union[str, Sequence[float]]]] = None,
        background: Optional[Sequence[float]] = None,
        sampler: str = "auto",
    ) -> "_core.RenderOptions":
        """azimuth, elevation : degrees; azimuth 0 looks along -y with x to the right, elevation is towards -z.
        zoom : 1 fits what `frame` says: "shown", what the transfer function or the surfaces show, or "grid", the
            whole grid (which costs no look at the samples).
        camera : {"position", "focal_point", "view_up", "view_angle"} instead of these; x, y, z and degrees.
        transfer_range : stretches the transfer function over these densities; of a slice and of integrals the window,
            black to white (of integrals by default the picture's least and largest).
        iso : densities of surfaces, mode "iso"; by default one between background and object.
        slice_axis, slice_position : "x", "y" or "z", and where on it; by default the middle.
        clip : x0, y0, z0, x1, y1, z1: draw what lies in this box alone; of every mode but slices.
        step : of a ray, in cells.
        step_mode : "adaptive" (finer where the transfer function changes much along one), "fixed" or "level" (step
            / 2^l in bricks of level l); by default adaptive of mode "dvr" with classification "post", else fixed.
        lights : "head" for one at the eye, or directions x, y, z towards the light; by default the first.
        background : red, green, blue, 0 to 1; or six numbers, of the top and of the bottom."""
        o = _core.RenderOptions()
        o.width, o.height = sizes(size)
        o.mode = choice(_core.RenderMode, mode, "mode")
        o.slice_axis = axis(slice_axis)
        o.slice_position = None if slice_position is None else number(slice_position, "slice_position")
        bright = self._held.brightness
        window = None if transfer_range is None else _window(transfer_range)
        integral = mode == "integral"
        # A window of integrals is none of densities.
        o.transfer = self._transfer(transfer, None if integral else window)
        o.slice_range = window if integral else window or (bright.grey_lo, bright.grey_hi)
        densities = [bright.threshold] if iso is None else [float(v) for v in np.atleast_1d(np.asarray(iso, float))]
        o.surfaces = _core.iso_surfaces(densities, None if iso_opacity is None else [float(v) for v in iso_opacity])
        o.step = number(step, "step")
        o.classification = choice(_core.Classification, classification, "classification")
        can_adapt = mode == "dvr" and classification == "post"
        o.step_mode = choice(_core.StepMode, step_mode or ("adaptive" if can_adapt else "fixed"), "step_mode")
        o.camera = self._camera(o, azimuth, elevation, zoom, frame, camera)
        if clip is not None:
            o.set_clip(*_box(clip, "clip"))
        o.gradient = choice(_core.GradientKind, gradient, "gradient")
        o.shading = bool(shading)
        if lights is not None:
            o.head_light = any(isinstance(light, str) and light == "head" for light in lights)
            o.lights = [list(numbers(light, 3, "lights")) for light in lights if not isinstance(light, str)]
        if background is not None:
            given = [number(c, "background") for c in background]
            if len(given) not in (3, 6) or not all(0 <= c <= 1 for c in given):
                raise _core.InputError(f"background: {background}; give three or six numbers from 0 to 1")
            o.background_top, o.background_bottom = given[:3], given[-3:]
        o.sampler = choice(_core.SamplerKind, sampler, "sampler")
        return o

    def _slice(self, size: Tuple[int, int], slice_axis: str = "z", slice_position: Optional[float] = None,
               **_: Any) -> "_core.RenderOptions":
        """Of mode "error", which has a position in any case."""
        o = _core.RenderOptions()
        o.width, o.height = sizes(size)
        o.mode = _core.RenderMode.error
        o.slice_axis = axis(slice_axis)
        g, a = self.grid, o.slice_axis
        middle = g.origin[a] + 0.5 * g.cells[a] * g.spacing[a]
        o.slice_position = middle if slice_position is None else number(slice_position, "slice_position")
        return o

    @takes(_view)
    def render(
        self,
        size: Tuple[int, int] = (512, 512),
        mode: str = "dvr",
        transfer: TransferLike = None,
        *,
        show: str = "colour",
        values: bool = False,
        device: DeviceLike = None,
        **view: Any,
    ) -> "NDArray[Any]":
        """One picture: uint8 [y, x, 3], sRGB, row 0 on top. That of `vdvr render` with the same options;
        a slice that of `--plain`, without a frame.

        Parameters
        ----------
        size : width and height, pixels.
        mode : "dvr", "iso", "mip", "integral" (an X-ray picture: the field summed up along each ray), "slice", or
            "error": on a slice what the certificate bounds |V - F| by.
        transfer : a preset (`transfer_presets()`), a file of VDVR, 3D Slicer or ParaView, or points (density,
            red, green, blue, opacity of one cell); by default one that suits the volume.
        show : "colour", "depth", "normal", or of the samples behind a pixel "error", their largest bound, "sigma", what the
            scan's own noise leaves in them (estimated), "error-in-sigma", the one in units of the other; mode "error" too.
        values : float32 [y, x] of what lies behind the pixels instead, NaN where nothing does
            (docs/rendering.md); of `show="normal"` [y, x, 3].
        OPTIONS
        """
        in_sigma = {"sigma": _core.BrickQuantity.sigma, "error-in-sigma": _core.BrickQuantity.bound_in_sigma}
        quantity = in_sigma.get(show, _core.BrickQuantity.bound)
        if mode == "error":
            return self._held.error_picture(self._slice(size, **view), quantity, values)
        o = self._view(size, mode, transfer, **view)
        o.output = choice(_core.RenderOutput, "error" if show in in_sigma else show, "show")
        return self._held.render(self._open_device(device), o, quantity, values)

    @takes(_view)
    def certify_picture(
        self,
        size: Tuple[int, int] = (512, 512),
        mode: str = "dvr",
        transfer: TransferLike = None,
        *,
        form: str = "exact",
        light: str = "as-drawn",
        parts: Optional[float] = None,
        tolerance: Optional[float] = None,
        device: DeviceLike = None,
        progress: Optional[Callable[[str, float], object]] = None,
        **view: Any,
    ) -> "CertifiedPicture":
        """A picture, and for every pixel an interval that holds what F itself would show: that of
        `vdvr render --certify`.

        Parameters
        ----------
        size, mode, transfer : as of `render`; modes "dvr", "iso" (one surface), "mip", "integral" and "slice". Only
            what is covered is drawn. Of "dvr" steps are chosen, and shortened while that narrows the bound much, unless
            `step`, `step_mode` or `classification` is given.
        form : of mode "dvr": "exact", "box" (some per cent wider) or "fast" (in one pass, 1.4 to 3 times as wide).
        light : of mode "dvr": "as-drawn" (colour and opacity of F under V's light) or "lit" (F's own).
        parts : of mode "dvr": smaller is narrower and slower (default 0.5).
        tolerance : levels of 255 that every pixel shall be certain to; drawn finer for it. `worst` says whether it is.
        OPTIONS
        """
        request = _core.PictureRequest()
        request.keep_steps = any(view.get(name) is not None for name in ("step", "step_mode", "classification"))
        request.options = self._view(size, mode, transfer, **view)
        _one_of(form, ("exact", "box", "fast"), "form")
        _one_of(light, ("as-drawn", "lit"), "light")
        request.certify.fast = form == "fast"
        request.certify.box = form == "box"
        if parts is not None:
            request.certify.kappa = number(parts, "parts")
        request.lit = light == "lit"
        request.tolerance = None if tolerance is None else number(tolerance, "tolerance")
        return CertifiedPicture(_core.certify_picture(self._held, self._open_device(device), request, progress))

    def _transfer(self, transfer: TransferLike, window: Optional[Tuple[float, float]]) -> "_core.TransferFunction":
        if isinstance(transfer, str) and transfer in _core.transfer_presets():
            return (_core.transfer_preset(transfer, *window) if window
                    else _core.preset_for(transfer, self._held.brightness))
        if transfer is None:
            function = _core.two_material_transfer(self._held.brightness)
        elif isinstance(transfer, _core.TransferFunction):
            function = transfer
        elif isinstance(transfer, (str, os.PathLike)):
            if not os.path.exists(transfer):
                raise _core.InputError(
                    f"transfer: '{os.fspath(transfer)}' is neither a file nor one of "
                    f"{', '.join(_core.transfer_presets())}")
            function = _core.read_transfer_function(transfer)
            if window:
                function = _core.stretched(function, *window)
            return _core.per_base_cell(function, self.grid)
        else:
            function = _core.transfer_of([list(numbers(p, 5, "transfer")) for p in transfer])
        return _core.stretched(function, *window) if window else function

    def _camera(self, options: "_core.RenderOptions", azimuth: float, elevation: float, zoom: float, frame: str,
                free: Optional[Dict[str, Any]]) -> "_core.Camera":
        angles = number(azimuth, "azimuth"), number(elevation, "elevation")
        _one_of(frame, ("shown", "grid"), "frame")
        # A slice has no camera.
        whole = frame == "grid" or options.mode == _core.RenderMode.slice
        about = _core.frame_grid(self.grid) if whole else self._held.frame_view(options, *angles)
        orbit = _core.orbit_camera(about, *angles, number(zoom, "zoom"))
        if free is None:
            return orbit
        known = {"position", "focal_point", "view_up", "view_angle"}
        if not set(free) <= known:
            raise _core.InputError(f"camera: {sorted(set(free) - known)[0]!r} is none of {', '.join(sorted(known))}")
        up = free.get("view_up")
        return _core.look_at(
            list(numbers(free.get("position", orbit.position), 3, "camera: position")),
            list(numbers(free.get("focal_point", orbit.focal_point), 3, "camera: focal_point")),
            None if up is None else list(numbers(up, 3, "camera: view_up")),
            number(free.get("view_angle", orbit.view_angle_deg), "camera: view_angle"))

    def _open_device(self, device: DeviceLike = None) -> "_core.Device":
        return open_device(self._device if device is None else device)

    # --- elsewhere ---

    def save(self, path: Path, *, overwrite: bool = False, compression: str = "deflate") -> None:
        """Writes a .vdvr file, whole or not at all.

        Parameters
        ----------
        overwrite : without it a file that exists is refused.
        compression : "deflate" or "none".
        """
        if not overwrite and os.path.exists(path):
            raise _core.InputError(f"{os.fspath(path)}: exists already; overwrite=True replaces it")
        self._held.save(path, compressed(compression))

    def to_vtk(self, blocks: int = 2000) -> Any:
        """V as a vtkMultiBlockDataSet of vtkImageData with point data `density`, as fine as each brick is:
        for VTK, ParaView, and PyVista (`pyvista.wrap`). Needs the package vtk.

        Parameters
        ----------
        blocks : at most about so many; fewer hold more points (docs/exports.md).
        """
        from ._vtk import multiblock

        return multiblock(self._held.vtk_boxes(int(blocks)), self.grid.unit, self.epsilon_abs)

    def close(self) -> None:
        """Gives back what pictures keep on the device. The volume can still be used."""
        self._held.release()

    def __enter__(self) -> "Volume":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class CertifiedPicture:
    """A picture of V, and what is certain of the one that F would give. Made by `Volume.certify_picture`."""

    def __init__(self, picture: "_core.CertifiedPicture") -> None:
        self._picture = picture

    @property
    def image(self) -> "NDArray[np.uint8]":
        """uint8 [y, x, 3], sRGB: what was drawn."""
        return self._picture.image

    @property
    def levels(self) -> Optional["NDArray[np.float32]"]:
        """float32 [y, x]: how far the ideal picture may lie from `image`, in levels of 255, of the worst channel;
        infinite where nothing is known. None of surfaces."""
        return self._picture.levels

    @property
    def low(self) -> "NDArray[np.float32]":
        """The lower ends of what is certain, float32. Of "dvr" and "slice" of the colour, [y, x, 3], 0 to 1. Of
        "mip" of the largest F on the ray, of "integral" of its integral, of "iso" of the distance from the eye at
        which F passes the value first: [y, x], NaN where there is none."""
        return self._picture.low

    @property
    def high(self) -> "NDArray[np.float32]":
        """The upper ends."""
        return self._picture.high

    @property
    def classes(self) -> Optional["NDArray[np.uint8]"]:
        """Of surfaces uint8 [y, x]: 2 where F passes the value for sure, 1 where it may, 0 where it does not. None
        of other modes."""
        return self._picture.classes

    @property
    def worst(self) -> float:
        """The largest of `levels`."""
        return self._picture.worst

    @property
    def mean(self) -> float:
        """Of `levels`."""
        return self._picture.mean

    def save(self, path: Path, *, overwrite: bool = False) -> Dict[str, Any]:
        """Writes X.png, X.certificate.json and, but for surfaces, X.bound.png: all of them, or none. Returns the
        certificate.

        Parameters
        ----------
        overwrite : without it files that exist are refused.
        """
        if not overwrite:
            for file in self._picture.files(path):
                if os.path.exists(file):
                    raise _core.InputError(f"{os.fspath(file)}: exists already; overwrite=True replaces it")
        return json.loads(self._picture.write(path))

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        of = "surface" if self.levels is None else f"worst pixel to {self.worst:.1f} levels"
        return f"<vdvr.CertifiedPicture {width} x {height}, {of}>"


def _points(points: "ArrayLike") -> Tuple["NDArray[np.float64]", Tuple[int, ...]]:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim < 1 or array.shape[-1] != 3:
        raise _core.InputError(f"points: an array of shape {array.shape}; give [..., 3], x, y, z")
    return np.ascontiguousarray(array.reshape(-1, 3)), array.shape[:-1]


def _box(given: Sequence[float], name: str) -> Tuple[List[float], List[float]]:
    box = numbers(given, 6, name)
    if not all(low < high for low, high in zip(box, box[3:])):
        raise _core.InputError(f"{name}: {given}; give x0, y0, z0, x1, y1, z1, each of the last three above the first")
    return list(box[:3]), list(box[3:])


def _window(given: Sequence[float]) -> Tuple[float, float]:
    lo, hi = numbers(given, 2, "transfer_range")
    if not lo < hi:
        raise _core.InputError(f"transfer_range: {lo} is not below {hi}")
    return lo, hi


def _one_of(word: str, known: Sequence[str], name: str) -> None:
    if word not in known:
        raise _core.InputError(f"{name}: '{word}' is none of {', '.join(known)}")


def compressed(compression: str) -> bool:
    """Whether a word asks for compression."""
    _one_of(compression, ("deflate", "none"), "compression")
    return compression == "deflate"


def path_or_volume(volume: Union[Volume, Path]) -> Union["_core.HeldVolume", Path]:
    """What the library takes for either."""
    return volume._held if isinstance(volume, Volume) else volume


def open(  # noqa: A001: vdvr.open is what a user looks for
    path: Path, *, unverified: bool = False, max_memory: Optional[int] = None, device: DeviceLike = None
) -> Volume:
    """Opens a .vdvr file. Its samples, index, certificate and seal are compared with their hashes.

    Parameters
    ----------
    unverified : open it although they do not match.
    max_memory : bytes; by default half of what is free.
    device : what pictures are drawn on; it is not needed for anything else.

    Raises
    ------
    FileError : it cannot be read. MismatchError : it was altered.
    """
    limit = _core.half_of_free_memory() if max_memory is None else int(max_memory)
    return Volume(_core.open(path, limit, unverified), device)


def transfer_presets() -> List[str]:
    """Names that `render(transfer=)` takes."""
    return _core.transfer_presets()
