"""For the Core Imaging Library: its AcquisitionData as a Scan, and filtered back-projection as one of its processors.

    slices = vdvr.cil.FBP()(data)                     # ImageData
    volume = vdvr.build(vdvr.cil.scan_of(data), "3%")   # certified

Needs the package cil, which `import vdvr` does not import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Tuple

import numpy as np

from . import _core
from ._choices import choice, number
from ._devices import DeviceLike, device as open_device
from ._scans import Scan

if TYPE_CHECKING:
    from numpy.typing import NDArray

try:
    from cil.framework import AcquisitionData, DataProcessor
except ImportError:
    raise ImportError("vdvr.cil needs the Core Imaging Library: conda install -c ccpi cil") from None

__all__ = ["FBP", "scan_of"]


def _refuse(text: str) -> None:
    raise _core.InputError(f"data: {text}")


def _signs(system: Any) -> Tuple[float, float]:
    """Of the detector's directions against x and z, once the axis is z and rays go along y."""
    flat = len(system.detector.direction_x) == 2
    x = np.append(system.detector.direction_x, 0.0) if flat else np.asarray(system.detector.direction_x)
    z = np.array([0.0, 0.0, 1.0]) if flat else np.asarray(system.detector.direction_y)
    # CIL's own limit for what is parallel.
    if abs(abs(x[0]) - 1) > 1e-10 or abs(abs(z[2]) - 1) > 1e-10:
        _refuse("its detector is turned or its axis tilted; VDVR takes rays across the axis onto upright rows")
    return float(np.sign(x[0])), float(np.sign(z[2]))


def _described(data: Any) -> Tuple[Scan, float]:
    """The scan, and the height of its middle in CIL's world."""
    geometry = data.geometry
    # By CIL's own comparison with words, which its versions all have.
    if geometry.geom_type != "parallel":
        _refuse(f"of {geometry.geom_type} beam; take parallel beam, or for cone beam vdvr.read_scan (docs/inputs.md)")
    if geometry.channels != 1:
        _refuse(f"{geometry.channels} channels; take one by get_slice(channel=...)")
    aligned = geometry.copy()
    aligned.config.system.align_reference_frame("cil")
    system, panel, angles = aligned.config.system, aligned.config.panel, aligned.config.angles
    sign_x, sign_z = _signs(system)

    # [view, row, column], columns along +x and rows along +z; axes of one element are left out by CIL.
    labels = [str(getattr(label, "value", label)) for label in data.dimension_labels]
    array = data.as_array()
    wanted = ("angle", "vertical", "horizontal")
    array = array.transpose([labels.index(label) for label in wanted if label in labels])
    for axis, label in enumerate(wanted):
        if label not in labels:
            array = np.expand_dims(array, axis)
    if ("right" in panel.origin) != (sign_x < 0):
        array = array[:, :, ::-1]
    if ("top" in panel.origin) != (sign_z < 0):
        array = array[:, ::-1]

    # The object turns by the angles from x to y, so that in its frame rays turn the other way.
    radians = str(angles.angle_unit) == "radian"
    turned = -(float(angles.initial_angle) + np.asarray(angles.angle_data, np.float64))
    degrees = np.asarray(_core.degrees_of(list(turned))) if radians else turned
    width, height = (float(p) for p in panel.pixel_size)
    # The axis is at x = 0.
    middle = np.asarray(system.detector.position, float)
    center = -middle[0] / width + 0.5 * (array.shape[2] - 1)
    unit = str(aligned.config.units)
    scan = Scan(array, degrees, center=center, pitch=(width, height), unit=unit, name="AcquisitionData")
    return scan, float(middle[2]) if len(middle) == 3 else 0.0


def scan_of(data: "AcquisitionData") -> Scan:
    """Parallel-beam AcquisitionData as a Scan, in the world that CIL has after it brought the axis to z and rays along
    +y. The heights of VDVR's world count from the middle of the detector, CIL's from the position of the axis.

    Raises
    ------
    InputError : cone beam, several channels, a turned detector, a tilted axis.
    """
    return _described(data)[0]


class FBP(DataProcessor):
    """Filtered back-projection of parallel-beam AcquisitionData: `FBP()(data)`, or set_input and get_output.

    Uncertified; `vdvr.build(scan_of(data), ...)` certifies.

    Parameters
    ----------
    image_geometry : where to; voxels as wide in x as in y. By default the data's own.
    filter, cutoff : "ram-lak", "shepp-logan", "cosine", "hamming" or "hann", and the fraction of the detector's
        Nyquist frequency.
    upsampling : of the filtered projections before they are interpolated linearly; 1 is the usual FBP.
    """

    def __init__(self, image_geometry: Any = None, filter: str = "ram-lak", cutoff: float = 1.0, upsampling: int = 8,
                 device: DeviceLike = None) -> None:
        field = _core.FieldOptions()
        field.filter = choice(_core.RampWindow, filter, "filter")
        field.cutoff = number(cutoff, "cutoff")
        options = _core.ReconstructOptions()
        options.field = field
        options.upsampling = int(upsampling)
        # CIL knows no attributes but those that it is given here.
        super().__init__(image_geometry=image_geometry, options=options, device=device)

    def check_input(self, dataset: Any) -> bool:
        if not isinstance(dataset, AcquisitionData):
            _refuse(f"a {type(dataset).__name__}; give an AcquisitionData")
        return True

    def _target(self) -> Any:
        return self.image_geometry or self.get_input().geometry.get_ImageGeometry()

    def check_output(self, out: Any) -> bool:
        """Called by newer versions of CIL."""
        if out is not None and out.shape != self._target().shape:
            raise _core.InputError(f"out: of shape {out.shape}; the image has {self._target().shape}")
        return True

    def process(self, out: Any = None) -> Any:
        data, target = self.get_input(), self._target()
        values = self._values(*_described(data), target)
        labels = [str(getattr(label, "value", label)) for label in target.dimension_labels]
        order = ("vertical", "horizontal_y", "horizontal_x")
        for axis, label in reversed(list(enumerate(order))):
            if label not in labels:
                values = values.take(0, axis=axis)
        kept = [label for label in order if label in labels]
        values = values.transpose([kept.index(label) for label in labels])
        result = target.allocate(None) if out is None else out
        result.fill(np.ascontiguousarray(values))
        return result

    def _values(self, scan: Scan, middle: float, target: Any) -> "NDArray[np.float32]":
        """[z, y, x] of the voxels' middles."""
        if target.voxel_size_x != target.voxel_size_y:
            raise _core.InputError(f"image_geometry: voxels of {target.voxel_size_x} x {target.voxel_size_y}; "
                                   "take the same size in x and y")
        count = [max(1, int(n)) for n in (target.voxel_num_x, target.voxel_num_y, target.voxel_num_z)]
        size = [target.voxel_size_x, target.voxel_size_y, target.voxel_size_z]
        center = [target.center_x, target.center_y, target.center_z - middle]
        origin = [c - 0.5 * (n - 1) * s for c, n, s in zip(center, count, size)]
        return _core.on_grid(open_device(self.device), scan._core, count, size[0], size[2], origin, self.options, None)
