"""The certified field at a point, from the file alone: read_volume.py FILE.vdvr X Y Z. Needs h5py and numpy.

docs/file-format.md says what the datasets mean. Axes are z, y, x here, as in the file.
"""

import itertools
import json
import sys

import h5py
import numpy as np


def tile_of(file, level, number):
    """The samples of a tile: they lie in up to three datasets, one a sample type, through which numbers run on."""
    name = "tiles/" + "".join(map(str, level))
    for part in (name, name + "_1", name + "_2"):
        count = file[part].shape[0]
        if number < count:
            break
        number -= count
    samples = file[part][number].astype(float)
    if file[part].dtype.kind == "u":
        offset, shift = file[part + "_offset"][number], file[part + "_shift"][number]
        samples = file.attrs["step"] * (offset + samples * 2.0**shift)
    return samples


def base_of(file):
    base = file["base"]
    samples = base[...].astype(float)
    if base.dtype.kind == "u":
        samples = file.attrs["step"] * (base.attrs["offset"] + samples * 2.0 ** base.attrs["shift"])
    return samples


def field_at(file, point):
    """Trilinear between the samples of the brick that the point belongs to."""
    grid = file["grid"].attrs
    bricks, g = file["level"].shape[:3], int(grid["granularity"])
    coarsening = grid.get("coarsening", np.zeros(3, int))
    cell = (np.array(point) - grid["origin"]) / grid["spacing"]
    brick = np.minimum((cell // g).astype(int), np.array(bricks) - 1)
    level = file["level"][tuple(brick)]
    if level.any():
        samples, first = tile_of(file, level, int(file["tile"][tuple(brick)])), brick * g
    else:
        samples, first = base_of(file), np.zeros(3, int)
    position = (cell - first) * 2.0 ** (level.astype(float) - coarsening)
    low = np.minimum(position.astype(int), np.array(samples.shape) - 2)
    t = position - low
    corners = itertools.product((0, 1), repeat=3)
    return sum(samples[tuple(low + c)] * np.prod(np.where(c, t, 1 - t)) for c in map(np.array, corners))


if __name__ == "__main__":
    with h5py.File(sys.argv[1], "r") as vdvr:
        x, y, z = map(float, sys.argv[2:5])
        epsilon = json.loads(vdvr["certificate"][()])["epsilon_abs"]
        print(f"{float(field_at(vdvr, (z, y, x)))!r} within {epsilon:.6g} of F, where the scan covers the point")
