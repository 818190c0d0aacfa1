"""export_readers.py VDVR SOURCE: what `vdvr export` writes, read by the programs that it is written for: VTK, zarr, tifffile,
h5py and NumPy, and share/paraview/vdvr_reader.py. Values against `vdvr probe`; faces that VTK blocks share; iso-surfaces."""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import tifffile
import vtk
import zarr
from vtk.util.numpy_support import vtk_to_numpy

vdvr, source = sys.argv[1], pathlib.Path(sys.argv[2])
# The plugin interpolates along other axes first than the sampler: nine roundings either way, of values below 2.
ROUNDING = 2 * 9 * 2.0**-24 * 2
GAP = 1 / 20  # of a cell: issue's own figure


def run(*words, code=0):
    done = subprocess.run([vdvr, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == code, f"{words}: {done.returncode}, {done.stderr}"
    return done.stdout


def probed(volume, points, folder):
    """V at points [n][3] x, y, z: every grid here has cell coordinates that float32 holds, so to the bit."""
    asked, given = folder / "points.csv", folder / "values.csv"
    asked.write_text("x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in points.tolist()), encoding="utf-8")
    run("probe", volume, "--points", asked, "-o", given, "--force")
    with open(given, encoding="utf-8", newline="") as lines:
        return np.array([float(row["value"] or "nan") for row in csv.DictReader(lines)])


class Grid:
    def __init__(self, volume):
        with h5py.File(volume) as file:
            g = file["grid"].attrs
            self.cells, self.g = g["cells"][:], int(g["granularity"])
            self.origin, self.spacing = g["origin"][:], g["spacing"][:]
            self.coarse = g.get("coarsening", np.zeros(3, int))
            self.level = file["level"][...].astype(int)
            base = file["base"].attrs
            self.step = file.attrs["step"] * 2.0 ** base["shift"] if "step" in file.attrs else 0.0
        self.bricks = np.array(self.level.shape[:3])

    def points(self, index, per_cell):
        """World x, y, z of samples [n][3] z, y, x."""
        return (self.origin + index * self.spacing / per_cell)[:, ::-1]


def check_values(what, array, volume, grid, per_cell, folder, tolerance=0.0, decode=lambda v: v):
    random = np.random.default_rng(5)
    shape = grid.cells * per_cell + 1
    assert tuple(array.shape) == tuple(shape), f"{what}: shape {array.shape}, not {shape}"
    index = np.stack([random.integers(0, n, 500) for n in shape], 1)
    index[:8] = np.array(list(np.ndindex(2, 2, 2))) * (shape - 1)  # corners
    wanted = probed(volume, grid.points(index, per_cell), folder)
    # Where no view covers the point, probe gives nothing.
    seen = np.isfinite(wanted)
    assert seen.sum() > 100, f"{what}: {seen.sum()} covered points"
    got = decode(np.asarray(array)[tuple(index.T)].astype(float))
    worst = np.abs(got - wanted)[seen].max()
    assert worst <= tolerance, f"{what}: differs from probe by {worst}"


def check_uniform(volume, grid, folder):
    out = folder / "uniform"
    out.mkdir(exist_ok=True)
    for per_cell in (1, 2):
        export = lambda name, *more: run("export", volume, "-o", out / name, "--oversampling", per_cell, "--force", *more)
        check = lambda what, array, **more: check_values(what, array, volume, grid, per_cell, folder, **more)
        spacing = grid.spacing / per_cell
        export("v.npy")
        check("npy", np.load(out / "v.npy", mmap_mode="r"))
        export("v.raw")
        note = json.loads((out / "v.raw.json").read_text())
        check("raw", np.fromfile(out / "v.raw", np.dtype(note["type"]).newbyteorder("<")).reshape(note["shape"]))
        assert np.allclose(note["spacing"], spacing, rtol=1e-15) and note["epsilon_abs"] > 0
        export("v.h5")
        with h5py.File(out / "v.h5") as file:
            check("hdf5", file["volume"][...])
            a = file["volume"].attrs
            assert np.array_equal(a["spacing"], spacing) and np.array_equal(a["origin"], grid.origin) and a["epsilon_abs"] > 0
        export("v.tif")
        with tifffile.TiffFile(out / "v.tif") as file:
            check("tiff", file.asarray())
            assert file.is_imagej and file.imagej_metadata["spacing"] == spacing[0]
            assert file.series[0].axes == "ZYX"
        export("slices", "--format", "tiff")
        names = sorted((out / "slices").glob("slice_*.tif"))
        check("tiff folder", np.stack([tifffile.imread(n) for n in names]))
        for samples, top in (("u16", 65535), ("u8", 255)):
            r = json.loads(export("i.tif", "--samples", samples, "--json"))
            array = tifffile.imread(out / "i.tif")
            assert array.dtype == np.dtype(np.uint8 if top == 255 else np.uint16)
            with tifffile.TiffFile(out / "i.tif") as file:
                scale, offset = file.imagej_metadata["c1"], file.imagej_metadata["c0"]
            assert (scale, offset, r["clipped"]) == (r["scale"], r["offset"], 0)
            # Half a step, and rounding in double of numbers below 2^16 steps.
            check(f"tiff {samples}", array, tolerance=scale / 2 * (1 + 2.0**-30), decode=lambda v, s=scale, o=offset: o + s * v)
        r = json.loads(export("c.npy", "--samples", "u8", "--range", "0.2,0.4", "--json"))
        clipped, exact = np.load(out / "c.npy"), np.load(out / "v.npy")
        assert r["clipped"] == ((exact < 0.2 - r["scale"] / 2) | (exact > 0.4 + r["scale"] / 2)).sum() > 0
        assert clipped.min() == 0 and clipped.max() == 255


def check_zarr(volume, grid, folder):
    for compression in ("deflate", "none"):
        run("export", volume, "-o", folder / "v.zarr", "--compression", compression, "--force")
        group = zarr.open_group(folder / "v.zarr", mode="r", zarr_format=3)
        ome = group.attrs["ome"]
        assert ome["version"] == "0.5"
        multiscale = ome["multiscales"][0]
        assert [a["name"] for a in multiscale["axes"]] == ["z", "y", "x"]
        assert [d["path"] for d in multiscale["datasets"]] == ["0", "1", "2"]
        for dataset, per_cell in zip(multiscale["datasets"], (4, 2, 1)):
            scale, translation = dataset["coordinateTransformations"]
            assert scale["type"] == "scale" and np.array_equal(scale["scale"], grid.spacing / per_cell)
            assert translation["type"] == "translation" and np.array_equal(translation["translation"], grid.origin)
            array = group[dataset["path"]]
            assert array.metadata.dimension_names == ("z", "y", "x") and array.dtype == np.float32
            check_values(f"zarr level {dataset['path']}", array[...], volume, grid, per_cell, folder)


def images_of(data):
    """(group number, vtkImageData) of a multi-block dataset of multi-block datasets."""
    for group in range(data.GetNumberOfBlocks()):
        inner = data.GetBlock(group)
        for i in range(inner.GetNumberOfBlocks()):
            yield group, inner.GetBlock(i)


def values_of(image):
    x0, x1, y0, y1, z0, z1 = image.GetExtent()
    return vtk_to_numpy(image.GetPointData().GetArray("density")).reshape(z1 - z0 + 1, y1 - y0 + 1, x1 - x0 + 1)


def fine_index(image, grid, finest):
    """Of a block's points along z, y, x: places in units of the finest sampling, exact integers."""
    extent, spacing = image.GetExtent(), np.array(image.GetSpacing())[::-1]
    assert np.array_equal(np.array(image.GetOrigin())[::-1], grid.origin)
    factor = spacing / grid.spacing * 2**finest
    assert np.array_equal(factor, np.round(factor))
    return [(np.arange(extent[2 * a], extent[2 * a + 1] + 1) * int(factor[2 - a])) for a in (2, 1, 0)]


def check_blocks(what, data, volume, grid, folder, tolerance):
    """Values, that the blocks fill the grid, and that points which several blocks have have one value."""
    finest = int((grid.level - grid.coarse).max())
    held, cells, asked, got = {}, 0, [], []
    random = np.random.default_rng(6)
    images = list(images_of(data))
    for _, image in images:
        values, axes = values_of(image), fine_index(image, grid, finest)
        cells += np.prod([int(a[-1] - a[0]) for a in axes])
        some = np.stack([random.integers(0, n, 20) for n in values.shape], 1)
        asked.append(np.stack([axes[a][some[:, a]] for a in range(3)], 1))
        got.append(values[tuple(some.T)])
        edge = np.zeros(values.shape, bool)
        for a in range(3):
            edge[(slice(None),) * a + (0,)] = edge[(slice(None),) * a + (-1,)] = True
        for index, value in zip(np.argwhere(edge).tolist(), values[edge].tolist()):
            held.setdefault(tuple(int(axes[a][index[a]]) for a in range(3)), []).append(value)
    assert cells == np.prod(grid.cells * 2**finest), f"{what}: blocks do not fill the grid"
    shared = [max(v) - min(v) for v in held.values() if len(v) > 1]
    assert len(shared) > 100 and max(shared) <= tolerance, f"{what}: {len(shared)} shared points differ by {max(shared)}"
    wanted = probed(volume, grid.points(np.concatenate(asked), 2**finest), folder)
    seen, worst = np.isfinite(wanted), np.abs(np.concatenate(got) - wanted)
    assert seen.sum() > 100 and worst[seen].max() <= tolerance, f"{what}: differs from probe by {worst[seen].max()}"
    return images


def contour(image, value):
    cut = vtk.vtkFlyingEdges3D()
    cut.SetInputData(image)
    cut.SetValue(0, value)
    cut.ComputeNormalsOff()
    cut.Update()
    return cut.GetOutput()


def merged(surfaces):
    append, clean = vtk.vtkAppendPolyData(), vtk.vtkCleanPolyData()
    for surface in surfaces:
        append.AddInputData(surface)
    clean.SetInputConnection(append.GetOutputPort())
    clean.SetToleranceIsAbsolute(True)
    clean.SetAbsoluteTolerance(1e-5)  # of a pixel: float32 coordinates below 32 have steps of 2e-6
    clean.Update()
    return clean.GetOutput()


def boundary_points(surface):
    edges = vtk.vtkFeatureEdges()
    edges.SetInputData(surface)
    edges.BoundaryEdgesOn()
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.NonManifoldEdgesOff()
    edges.Update()
    out = edges.GetOutput()
    middles = [np.mean([out.GetPoint(out.GetCell(i).GetPointId(k)) for k in (0, 1)], 0) for i in range(out.GetNumberOfCells())]
    return np.array(middles).reshape(-1, 3)


def check_surfaces(what, images, grid):
    everything = np.concatenate([values_of(i).ravel() for _, i in images])
    value = float(everything.min() + everything.max()) / 2
    # Which group each brick is in, from the blocks' boxes.
    group_of = np.full(grid.bricks, -1)
    for group, image in images:
        low, high = np.array(image.GetBounds()[::2])[::-1], np.array(image.GetBounds()[1::2])[::-1]
        first = np.round((low - grid.origin) / grid.spacing / grid.g).astype(int)
        end = np.ceil((high - grid.origin) / grid.spacing / grid.g - 1e-6).astype(int)
        group_of[tuple(slice(f, e) for f, e in zip(first, end))] = group
    assert (group_of >= 0).all()
    groups = sorted({g for g, _ in images})
    surfaces = {g: merged([contour(i, value) for h, i in images if h == g]) for g in groups}
    surfaces = {g: s for g, s in surfaces.items() if s.GetNumberOfCells()}
    assert len(surfaces) > 1, f"{what}: the surface lies in one triple"
    assert any(sum(1 for h, i in images if h == g and contour(i, value).GetNumberOfCells()) > 1 for g in surfaces)
    widest, edges = 0.0, 0
    for group, surface in surfaces.items():
        rest = merged([s for g, s in surfaces.items() if g != group])
        locator, closest, cell, part, square = vtk.vtkStaticCellLocator(), [0.0] * 3, vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
        locator.SetDataSet(rest)
        locator.BuildLocator()
        for middle in boundary_points(surface):
            place = ((middle[::-1] - grid.origin) / grid.spacing) / grid.g
            around = [sorted({int(np.floor(p - 1e-4)), int(np.floor(p + 1e-4))}) for p in place]
            inside = [b for b in np.ndindex(*[len(a) for a in around])]
            bricks = [tuple(around[a][b[a]] for a in range(3)) for b in inside]
            outer = any(not 0 <= b[a] < grid.bricks[a] for b in bricks for a in range(3))
            others = [] if outer else [b for b in bricks if group_of[b] != group]
            assert outer or others, f"{what}: a boundary edge within a triple, at {middle}"
            if outer:
                continue
            edges += 1
            locator.FindClosestPoint(middle, closest, cell, part, square)
            widest = max(widest, float(np.linalg.norm((np.array(closest) - middle)[::-1] / grid.spacing)))
    assert edges > 0 and widest <= GAP, f"{what}: a gap of {widest} cells"
    print(f"{what}: {edges} edges between triples, widest gap {widest:.4f} cells")


def read_vtm(path):
    reader = vtk.vtkXMLMultiBlockDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def check_vtk(volume, grid, folder):
    sys.path.insert(0, str(source / "share" / "paraview"))
    import vdvr_reader  # pylint: disable=import-outside-toplevel

    for what, words in (("vtm", ()), ("raw vtm of few blocks", ("--compression", "none", "--blocks", "12"))):
        run("export", volume, "-o", folder / "v.vtm", "--force", *words)
        data = read_vtm(folder / "v.vtm")
        images = check_blocks(what, data, volume, grid, folder, 0.0)
        assert images[0][1].GetFieldData().GetArray("epsilon_abs").GetValue(0) > 0
        assert not words or len(images) <= 12
        if not words:
            check_surfaces(what, images, grid)
    reader = vdvr_reader.VDVRReader()
    reader.SetFileName(str(volume))
    reader.Update()
    images = check_blocks("plugin", reader.GetOutputDataObject(0), volume, grid, folder, ROUNDING)
    check_surfaces("plugin", images, grid)


with tempfile.TemporaryDirectory() as name:
    home = pathlib.Path(name)
    run("simulate", "--phantom", "sphere", "--detector", "45x21", "--angles", "72", "--band-limited", "-o", home / "s.h5")
    for storage, epsilon in (("auto", "5%"), ("f32", "6%")):
        certified = home / f"{storage}.vdvr"
        run("build", home / "s.h5", "--epsilon", epsilon, "--storage", storage, "-o", certified)
        layout = Grid(certified)
        assert len(np.unique(layout.level.reshape(-1, 3), axis=0)) > 2
        check_vtk(certified, layout, home)
        check_uniform(certified, layout, home)
        check_zarr(certified, layout, home)
    for made in home.rglob(".*"):
        raise AssertionError(f"{made} is left behind")
