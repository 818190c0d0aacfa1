#!/usr/bin/env python3
"""vdvr.cil with the Core Imaging Library, where it is installed beside vdvr.

  cil_processor.py
"""
try:
    import cil.framework
except ImportError:
    print("python_cil_processor_test skipped: the Core Imaging Library is not installed")
    raise SystemExit(0) from None

import numpy as np
import vdvr
import vdvr.cil
from cil.framework import AcquisitionGeometry, ImageGeometry

# A ball of density 1 at x = 3, y = -2, z = 1.5, seen as CIL defines it: the object turns from x to y.
views, rows, columns, size = 90, 20, 33, 0.5
angles = np.arange(views) * 2.0
at, radius = np.array([3.0, -2.0, 1.5]), 2.5


def data_of(geometry, first=0.0, offset=0.0):
    """The projections that stand in an array of order angle, vertical, horizontal, origin bottom-left."""
    theta = np.deg2rad(first + angles)[:, None, None]
    z = ((np.arange(rows) - (rows - 1) / 2) * size)[None, :, None]
    x = ((np.arange(columns) - (columns - 1) / 2) * size - offset)[None, None, :]
    seen = at[0] * np.cos(theta) - at[1] * np.sin(theta)
    return 2 * np.sqrt(np.maximum(0, radius**2 - (x - seen) ** 2 - (z - at[2]) ** 2)).astype(np.float32)


def geometry_of(**panel):
    return AcquisitionGeometry.create_Parallel3D(units="mm").set_panel((columns, rows), (size, size), **panel)


def filled(geometry, array):
    data = geometry.allocate(None)
    data.fill(array)
    return data


plain = geometry_of().set_angles(angles)
data = filled(plain, data_of(plain))
image = vdvr.cil.FBP()(data)
target = plain.get_ImageGeometry()
assert image.geometry == target and image.shape == (rows, columns, columns)
values = image.as_array()
# Those of recon, which takes the same angles in the same sense, per millimetre. What both round: float32 of `views`
# terms, each at most the largest filtered value, and of the filter's sums (see module.py).
theirs = vdvr.recon(data_of(plain), np.deg2rad(angles)) / size
rounding = 8 * (views + columns) * 2.0**-24 * data_of(plain).max() / size * np.pi / 4
print(f"FBP - recon: at most {np.abs(values - theirs).max():.3g}; rounding allows {rounding:.3g}")
assert np.abs(values - theirs).max() <= rounding
heavy = np.argwhere(values > 0.5).mean(axis=0)
place = (heavy - (np.array(image.shape) - 1) / 2) * size
assert np.abs(place - at[::-1]).max() < size / 4, place

# The same scan, told in other ways.
scan = vdvr.cil.scan_of(data)
for geometry, array in (
    (geometry_of().set_angles(np.deg2rad(angles), angle_unit="radian"), data_of(None)),
    (geometry_of().set_angles(angles - 30, initial_angle=30), data_of(None)),
    (geometry_of(origin="top-right").set_angles(angles), data_of(None)[:, ::-1, ::-1]),
    (geometry_of().set_angles(angles).set_labels(["vertical", "angle", "horizontal"]), data_of(None).swapaxes(0, 1)),
):
    other = vdvr.cil.scan_of(filled(geometry, np.ascontiguousarray(array)))
    assert np.array_equal(other.data, scan.data) and other.center == scan.center
    assert np.allclose(other.angles_deg, scan.angles_deg, atol=180 * 2.0**-22)  # CIL keeps angles in float32
off = geometry_of().set_angles(angles)
off.set_centre_of_rotation(1.25, "pixels")
shifted = vdvr.cil.scan_of(filled(off, data_of(off, offset=1.25 * size)))
assert abs(shifted.center - (columns - 1) / 2 - 1.25) < 1e-9
again = vdvr.cil.FBP()(filled(off, data_of(off, offset=1.25 * size))).as_array()
heavy = (np.argwhere(again > 0.5).mean(axis=0) - (np.array(again.shape) - 1) / 2) * size
assert np.abs(heavy - at[::-1]).max() < size / 4, heavy

# Elsewhere, into a given container, and certified.
small = ImageGeometry(5, 7, 3, size, size, size, center_x=at[0], center_y=at[1], center_z=1.75)
out = small.allocate(0)
processor = vdvr.cil.FBP(small)
processor.set_input(data)
processor.get_output(out=out)
assert np.abs(out.as_array() - values[12:15, 9:16, 20:25]).max() <= rounding
assert vdvr.verify(vdvr.build(scan, "5%"), scan)
for bad in (AcquisitionGeometry.create_Cone3D([0, -10, 0], [0, 10, 0]).set_panel((columns, rows)).set_angles(angles),
            AcquisitionGeometry.create_Parallel3D(rotation_axis_direction=[0, 0.1, 1]).set_panel((columns, rows))
            .set_angles(angles)):
    try:
        vdvr.cil.scan_of(bad.allocate(0))
        raise SystemExit("a geometry that VDVR has not was taken")
    except vdvr.InputError:
        pass
print(f"vdvr.cil: with CIL {getattr(cil, '__version__', 'of unknown version')}")
