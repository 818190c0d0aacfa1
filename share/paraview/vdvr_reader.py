"""ParaView reads .vdvr: load this file by Tools > Manage Plugins > Load New, or with `pvpython`
paraview.simple.LoadPlugin; then File > Open. Needs h5py in ParaView's Python (Debian: python3-h5py).

The result is a vtkMultiBlockDataSet: for each level triple a block, in it boxes of bricks as vtkImageData with
`density` at points. Field data say what the certificate promises: |density - F| <= epsilon_abs at covered
points of the boxes. docs/file-format.md says what the datasets mean; axes are z, y, x here, as in the file.
"""

import json

import h5py
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkImageData, vtkMultiBlockDataSet

try:
    from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
except ImportError:  # plain VTK: the reader works, without a user interface
    class _Unmarked:
        def __getattr__(self, _):
            return lambda *_, **__: lambda marked: marked

    smdomain = smhint = smproperty = smproxy = _Unmarked()

NEWEST_VERSION = 4
MOST_POINTS = 2**24  # of a box


def text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


class Volume:
    """What the file holds, decoded to float32, which is exact."""

    def __init__(self, name):
        with h5py.File(name, "r") as file:
            if text(file.attrs.get("format", "")) != "vdvr":
                raise RuntimeError(f"{name}: is no .vdvr file")
            if int(file.attrs["format_version"]) > NEWEST_VERSION:
                raise RuntimeError(f"{name}: format {file.attrs['format_version']}; this reader knows {NEWEST_VERSION}")
            grid = file["grid"].attrs
            self.cells = np.array(grid["cells"], np.int64)
            self.origin, self.spacing = np.array(grid["origin"]), np.array(grid["spacing"])
            self.unit, self.g = text(grid["unit"]), int(grid["granularity"])
            self.coarse = np.array(grid.get("coarsening", np.zeros(3)), np.int64)
            self.step = float(file.attrs.get("step", 0))
            self.level, self.tile = file["level"][...].astype(np.int64), file["tile"][...]
            self.bricks = np.array(self.level.shape[:3])
            base = file["base"]
            self.base = self.decoded(base[...], base.attrs.get("offset", 0), base.attrs.get("shift", 0))
            self.tiles = {}
            for triple in sorted({n[:3] for n in file.get("tiles", ())}):
                parts = [self.part(file["tiles"], triple + end) for end in ("", "_1", "_2") if triple + end in file["tiles"]]
                self.tiles[tuple(map(int, triple))] = np.concatenate(parts)
            self.certified = "certificate" in file
            record = file["certificate" if self.certified else "comparison"][()]
            self.certificate = json.loads(record[0] if isinstance(record, np.ndarray) else record)

    def decoded(self, samples, offset, shift):
        if samples.dtype.kind == "f":
            return samples.astype(np.float32)
        return (self.step * (offset + samples * np.exp2(shift))).astype(np.float32)

    def part(self, tiles, name):
        samples = tiles[name][...]
        if samples.dtype.kind == "f":
            return samples.astype(np.float32)
        column = (slice(None), None, None, None)
        return self.decoded(samples, tiles[name + "_offset"][...].astype(float)[column],
                            tiles[name + "_shift"][...].astype(float)[column])

    def samples_of(self, level, bricks):
        """[brick][z][y][x] of bricks [n][3] of one level triple."""
        if any(level):
            return self.tiles[level][self.tile[tuple(bricks.T)]]
        # Level 0 reads the base, which ends with the grid: a brick beyond repeats its last plane, as a tile does.
        side = self.g >> self.coarse
        index = [np.minimum(bricks[:, a, None] * side[a] + np.arange(side[a] + 1), self.base.shape[a] - 1) for a in range(3)]
        return self.base[index[0][:, :, None, None], index[1][:, None, :, None], index[2][:, None, None, :]]


def refined(samples, shifts):
    """Trilinear interpolation to 2^shift times as many samples along each axis."""
    for axis, shift in enumerate(shifts, start=1):
        if shift == 0:
            continue
        low, high = np.delete(samples, -1, axis), np.delete(samples, 0, axis)
        shape = list(low.shape)
        shape[axis] = (shape[axis] << shift) + 1
        out = np.empty(shape, np.float32)
        at = [slice(None)] * 4
        for i in range(1 << shift):
            t = np.float32(i / (1 << shift))
            at[axis] = slice(i, shape[axis] - 1, 1 << shift)
            out[tuple(at)] = (1 - t) * low + t * high
        at[axis] = slice(shape[axis] - 1, None)
        last = [slice(None)] * 4
        last[axis] = slice(-1, None)
        out[tuple(at)] = samples[tuple(last)]
        samples = out
    return samples


def partition(v, worth):
    """Boxes of bricks: (first brick [n][3], bricks [n][3], level [n][3]). From the bottom up over cubes of 2^k
    bricks, a cube is one box where that costs no more points than its parts, each box counted as `worth` points."""
    scales, cost, level = [], None, v.level
    k, done = 0, False
    while not done:
        shape = -(-v.bricks // (1 << k))
        extent = np.stack(np.meshgrid(*[np.minimum((np.arange(n) + 1) * (v.g << k), v.cells[a]) - np.arange(n) * (v.g << k)
                                        for a, n in enumerate(shape)], indexing="ij"), -1)
        single = np.prod(extent * np.exp2(level - v.coarse) + 1, -1)
        if k == 0:
            whole, cost = np.ones(shape, bool), single + worth
        else:
            whole = (single <= MOST_POINTS) & (single + worth <= cost)
            cost = np.where(whole, single + worth, cost)
        scales.append((whole, level))
        done = max(shape) == 1
        if not done:
            pad = [(0, n % 2) for n in shape]
            cost = np.pad(cost, pad)
            level = np.pad(level, pad + [(0, 0)])
            for a in range(3):
                cost = np.add.reduceat(cost, np.arange(0, cost.shape[a], 2), a)
                level = np.maximum.reduceat(level, np.arange(0, level.shape[a], 2), a)
        k += 1
    boxes, open_cubes = [], np.ones(scales[-1][0].shape, bool)
    for k in range(len(scales) - 1, -1, -1):
        whole, level = scales[k]
        taken = np.argwhere(open_cubes & whole)
        first = taken << k
        boxes.append(np.concatenate([first, np.minimum(v.bricks - first, 1 << k), level[tuple(taken.T)]], 1))
        if k:
            open_cubes &= ~whole
            n = scales[k - 1][0].shape
            open_cubes = np.repeat(np.repeat(np.repeat(open_cubes, 2, 0), 2, 1), 2, 2)[:n[0], :n[1], :n[2]]
    return joined(v, np.concatenate(boxes))


def joined(v, boxes):
    """Boxes of one triple and cross-section that follow one another become one."""
    for axis in range(3):
        others = [c for c in range(9) if c not in (axis, 3 + axis)]
        boxes = boxes[np.lexsort([boxes[:, axis]] + [boxes[:, c] for c in others])]
        out = [boxes[0]]
        for box in boxes[1:]:
            last = out[-1]
            both = last.copy()
            both[3 + axis] += box[3 + axis]
            follows = last[axis] + last[3 + axis] == box[axis] and (last[others] == box[others]).all()
            if follows and np.prod(box_points(v, both)) <= MOST_POINTS:
                out[-1] = both
            else:
                out.append(box)
        boxes = np.array(out)
    return boxes


def box_points(v, box):
    cells = np.minimum((box[:3] + box[3:6]) * v.g, v.cells) - box[:3] * v.g
    return ((cells << box[6:]) >> v.coarse) + 1


def blocks_of(v, most_blocks):
    worth = 256
    boxes = partition(v, worth)
    while len(boxes) > most_blocks and worth < 2**28:
        worth *= 2
        fewer = partition(v, worth)
        boxes = fewer if len(fewer) < len(boxes) else boxes
    return boxes


def filled(v, boxes):
    """V at the points of every box, [z][y][x] each. A point on a face belongs to the brick above it, so bricks are
    put down from the last to the first corner: what lies above is put last."""
    arrays = [np.empty(box_points(v, box), np.float32) for box in boxes]
    # Every box also takes the bricks just beyond its far faces, for the points there.
    for box, array in zip(boxes, arrays):
        first, level = box[:3], box[6:]
        end = np.minimum(first + box[3:6] + 1, v.bricks)
        axes = [np.arange(f, e) for f, e in zip(first, end)]
        bricks = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)  # ascending
        own = v.level[tuple(bricks.T)]
        side = (v.g << level) >> v.coarse
        for triple in np.unique(own, axis=0):
            of = bricks[(own == triple).all(1)]
            for some in np.array_split(of, max(1, len(of) * int(np.prod(side + 1)) >> 22)):
                place(v, array, first, level, side, tuple(map(int, triple)), some)
    return arrays


def place(v, array, first, level, side, triple, bricks):
    """The points that these bricks own, low faces and, at the end of the grid, far ones."""
    finer = np.maximum(np.array(triple) - level, 0)  # a brick beyond the box may be finer than it
    samples = v.samples_of(triple, bricks)[:, ::1 << finer[0], ::1 << finer[1], ::1 << finer[2]]
    samples = refined(samples, np.maximum(level - np.array(triple), 0))
    low = (bricks - first) * side
    for corner in np.ndindex(2, 2, 2):
        # Low parts of all bricks; the far plane along an axis only of the grid's last bricks.
        keep = np.ones(len(bricks), bool)
        for a in range(3):
            if corner[a]:
                keep &= bricks[:, a] == v.bricks[a] - 1
        if not keep.any():
            continue
        index, source = [], [keep]
        for a in range(3):
            if corner[a]:
                # Where the grid ends within a brick, its far plane lies there; beyond it nothing is kept.
                last = ((v.cells[a] - (v.bricks[a] - 1) * v.g) << level[a]) >> v.coarse[a]
                offsets = np.array([last])
            else:
                offsets = np.arange(side[a])
            index.append(low[keep][:, a, None] + offsets)
            source.append(offsets)
        values = samples[keep][np.ix_(np.arange(keep.sum()), *source[1:])]
        inside = [(i >= 0) & (i < array.shape[a]) for a, i in enumerate(index)]
        if not corner[0] and not corner[1] and not corner[2] and all(i.all() for i in inside):
            array[index[0][:, :, None, None], index[1][:, None, :, None], index[2][:, None, None, :]] = values
            continue
        mask = inside[0][:, :, None, None] & inside[1][:, None, :, None] & inside[2][:, None, None, :]
        where = np.nonzero(mask)
        array[index[0][where[0], where[1]], index[1][where[0], where[2]], index[2][where[0], where[3]]] = values[where]


def named(array, name):
    array.SetName(name)
    return array


def notes(v):
    """What the certificate promises, as field data."""
    if v.certified:
        number = named(vtkDoubleArray(), "epsilon_abs")
        number.InsertNextValue(v.certificate["epsilon_abs"])
        yield number
    for name, value in (("unit", v.unit), ("content_sha256", v.certificate.get("content_sha256", ""))):
        words = named(vtkStringArray(), name)
        words.InsertNextValue(value)
        yield words


def image_of(v, box, values):
    k = box[6:] - v.coarse
    spacing = np.ldexp(v.spacing, -k)
    first = ((box[:3] * v.g) << box[6:]) >> v.coarse
    last = first + np.array(values.shape) - 1
    image = vtkImageData()
    image.SetOrigin(*v.origin[::-1])
    image.SetSpacing(*spacing[::-1])
    image.SetExtent(*[int(e) for a in (2, 1, 0) for e in (first[a], last[a])])
    image.GetPointData().SetScalars(named(numpy_to_vtk(values.reshape(-1), deep=True), "density"))
    for note in notes(v):
        image.GetFieldData().AddArray(note)
    return image


def multi_block(name, most_blocks, output):
    v = Volume(name)
    boxes = blocks_of(v, most_blocks)
    arrays = filled(v, boxes)
    groups = {}
    for box, values in zip(boxes, arrays):
        groups.setdefault(tuple(int(n) for n in (box[6:] - v.coarse)[::-1]), []).append((box, values))
    count = lambda k: str(1 << k) if k >= 0 else f"1/{1 << -k}"
    for number, (per_cell, members) in enumerate(sorted(groups.items())):
        group = vtkMultiBlockDataSet()
        for i, (box, values) in enumerate(members):
            group.SetBlock(i, image_of(v, box, values))
        output.SetBlock(number, group)
        output.GetMetaData(number).Set(vtkMultiBlockDataSet.NAME(), " x ".join(map(count, per_cell)) + " samples a cell")
    for note in notes(v):
        output.GetFieldData().AddArray(note)


@smproxy.reader(name="VDVRReader", label="VDVR certified volume", extensions="vdvr", file_description="VDVR certified volumes")
class VDVRReader(VTKPythonAlgorithmBase):
    def __init__(self):
        VTKPythonAlgorithmBase.__init__(self, nInputPorts=0, nOutputPorts=1, outputType="vtkMultiBlockDataSet")
        self._name, self._most_blocks = None, 2000

    @smproperty.stringvector(name="FileName", panel_visibility="never")
    @smdomain.filelist()
    @smhint.filechooser(extensions="vdvr", file_description="VDVR certified volumes")
    def SetFileName(self, name):
        if name != self._name:
            self._name = name
            self.Modified()

    @smproperty.intvector(name="MostBlocks", default_values=2000)
    @smdomain.intrange(min=1, max=1000000)
    def SetMostBlocks(self, count):
        if count != self._most_blocks:
            self._most_blocks = count
            self.Modified()

    def RequestData(self, _request, _inputs, outputs):
        if not self._name or self._name == "None":
            raise RuntimeError("no file name")
        multi_block(self._name, self._most_blocks, vtkMultiBlockDataSet.GetData(outputs, 0))
        return 1
