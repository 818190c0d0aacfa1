"""paraview_plugin.py VDVR PLUGIN, in pvpython: the plugin and an exported .vtm show ParaView the same volume."""
import pathlib
import subprocess
import sys
import tempfile

from paraview import simple

vdvr, plugin = sys.argv[1:]
# The plugin interpolates along other axes first than the sampler: nine roundings either way, of values below 2.
ROUNDING = 2 * 9 * 2.0**-24 * 2


def run(*words):
    done = subprocess.run([vdvr, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def facts(proxy):
    proxy.UpdatePipeline()
    data = proxy.GetDataInformation()
    return data.GetBounds(), data.GetPointDataInformation().GetArrayInformation("density").GetComponentRange(0)


def value_at(proxy, point):
    probe = simple.ProbeLocation(Input=proxy, ProbeType="Fixed Radius Point Source")
    probe.ProbeType.Center, probe.ProbeType.NumberOfPoints, probe.ProbeType.Radius = point, 1, 0.0
    probe.UpdatePipeline()
    array = simple.servermanager.Fetch(probe).GetPointData().GetArray("density")
    return array.GetValue(0)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run("simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "48", "-o", folder / "s.h5")
    run("build", folder / "s.h5", "--epsilon", "10%", "-o", folder / "v.vdvr")
    run("export", folder / "v.vdvr", "-o", folder / "v.vtm")
    simple.LoadPlugin(plugin, ns=globals())
    ours, exported = simple.OpenDataFile(str(folder / "v.vdvr")), simple.OpenDataFile(str(folder / "v.vtm"))
    assert ours is not None, "no reader for .vdvr: the plugin did not load"
    (bounds, span), (wanted_bounds, wanted_span) = facts(ours), facts(exported)
    assert bounds == wanted_bounds, f"{bounds}, not {wanted_bounds}"
    assert max(abs(a - b) for a, b in zip(span, wanted_span)) <= ROUNDING, f"{span}, not {wanted_span}"
    assert span[1] - span[0] > 0.1
    for point in ([0.3, 1.1, -2.2], [5.3, -4.9, 1.7], [-8.1, 2.6, 3.0], [0.0, 9.2, 0.4]):
        a, b = value_at(ours, point), value_at(exported, point)
        assert abs(a - b) <= ROUNDING, f"{a}, not {b}, at {point}"
    surface = simple.Contour(Input=ours, ContourBy=["POINTS", "density"], Isosurfaces=[sum(span) / 2])
    surface.UpdatePipeline()
    assert surface.GetDataInformation().GetNumberOfCells() > 100
