#!/usr/bin/env python3
"""The same pictures by VTK's CPU ray-caster and by vdvr, compared and timed in one run.

VTK: vtkFixedPointVolumeRayCastMapper at full resolution (no automatic sample distances, one ray a pixel, one
sample a base cell), shading on. Ours: `vdvr bench render --method dvr`. Both: the same MHA volume, transfer
function, camera path (a full turn), 512 x 512 pixels, all cores. First the pictures are compared: without shading
they must agree (same camera, samples, colours and opacities); with it the weights of light are the same but not the
gradients (VTK: over two cells at the samples, as one of a table of directions, and places without one stay in the
dark; ours: over one cell at the point itself, fading out where there is none), so the limit is wider. Then rounds
alternate between the two. VTK's time is that of the mapper alone, without the window that would show its picture;
the time with the window is given beside it.

    python3 -m venv build/peers/vtk && build/peers/vtk/bin/pip install -r bench/peers/vtk_requirements.txt
    bench/peers/vtk_render.py                 # runs itself in that environment
    bench/peers/vtk_render.py --sizes 64,128 --vdvr build/vdvr
    bench/peers/vtk_render.py --volume FILE.mha --tf FILE.json [--certified FILE.vdvr --step S]

With --certified ours is that volume instead, on the same box, and --step is the distance of samples for both: what a
certified volume renders at beside the uniform grid that errs as little.

Prints one JSON line per volume, then a table. Exit code 1: the pictures differ; 3: VTK is missing.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# Behind the volume in our pictures, top and bottom row (docs/rendering.md).
TOP, BOTTOM = (0.13, 0.14, 0.16), (0.03, 0.03, 0.04)

# Clear below, a veil in the middle, dense above: rays neither stop at once nor run through emptiness alone.
POINTS = [
    (0.00, (0.20, 0.35, 0.60), 0.0),
    (0.45, (0.30, 0.55, 0.85), 0.0),
    (0.50, (0.60, 0.75, 0.90), 0.05),
    (0.70, (0.95, 0.80, 0.60), 0.20),
    (1.00, (1.00, 0.95, 0.85), 0.50),
]


def options():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--vdvr", default=os.path.join(ROOT, "build", "vdvr"), help="our program")
    p.add_argument("--venv", default=os.path.join(ROOT, "build", "peers", "vtk"), help="where VTK is installed")
    p.add_argument("--sizes", default="64,128,256", help="samples per axis of the volumes made here")
    p.add_argument("--volume", help="an MHA file instead; needs --tf")
    p.add_argument("--tf", help="a transfer function in our own JSON")
    p.add_argument("--certified", metavar="FILE", help="a certified volume for our side; needs --volume and --step")
    p.add_argument("--step", type=float, help="world distance of samples, and of opacities (default: the smallest spacing)")
    p.add_argument("--frames", type=int, default=12, help="over a full turn, each round (default 12)")
    p.add_argument("--rounds", type=int, default=3, help="default 3")
    p.add_argument("--pixels", type=int, default=512, help="each side (default 512)")
    p.add_argument("--elevation", type=float, default=20)
    p.add_argument("--limit", type=float, default=2.0,
                   help="mean absolute difference, of 255, allowed without shading where either picture differs from "
                        "the background (default 2)")
    p.add_argument("--shaded-limit", type=float, default=12.0, help="the same with shading (default 12)")
    p.add_argument("--device", default="cpu", help="our device (default cpu)")
    p.add_argument("--keep", metavar="DIR", help="keep the pictures compared in this folder")
    return p.parse_args()


def enter_venv(venv):
    """Starts again with the environment's Python where this one has no VTK."""
    python = os.path.join(venv, "bin", "python")
    if os.path.exists(python) and os.path.abspath(sys.prefix) != os.path.abspath(venv):
        os.execv(python, [python] + sys.argv)
    print(f"VTK is not installed: python3 -m venv {venv} && {venv}/bin/pip install -r "
          "bench/peers/vtk_requirements.txt", file=sys.stderr)
    sys.exit(3)


try:
    import numpy as np
    import vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy
except ImportError:
    enter_venv(options().venv)


def write_signal(path, n):
    """The Marschner-Lobb signal in a ball, on n samples per axis of spacing 1, centred."""
    s = np.linspace(-1, 1, n)
    z, y, x = np.meshgrid(s, s, s, indexing="ij")
    f_m, alpha = 6.0, 0.25
    rho = np.cos(2 * np.pi * f_m * np.cos(np.pi * np.hypot(x, y) / 2))
    v = (1 - np.sin(np.pi * z / 2) + alpha * (1 + rho)) / (2 * (1 + alpha))
    # A smooth edge: a cut one would be shaded by how each program treats a step.
    v *= 1 / (1 + np.exp((np.sqrt(x * x + y * y + z * z) - 0.85) * 40))
    first = -(n - 1) / 2
    header = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
              "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n"
              f"Offset = {first} {first} {first}\nElementSpacing = 1 1 1\nDimSize = {n} {n} {n}\n"
              "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n")
    with open(path, "wb") as f:
        f.write(header.encode())
        f.write(v.astype("<f4").tobytes())


def write_transfer(path):
    with open(path, "w") as f:
        json.dump({"points": [{"value": v, "rgb": c, "opacity": o} for v, c, o in POINTS]}, f)


class Peer:
    """VTK's side: one volume, one camera that goes round it."""

    def __init__(self, volume, transfer, pixels, elevation, step):
        reader = vtk.vtkMetaImageReader()
        reader.SetFileName(volume)
        reader.Update()
        self.image = reader.GetOutput()
        self.cell = step or min(self.image.GetSpacing())
        self.elevation = elevation
        self.mapper = vtk.vtkFixedPointVolumeRayCastMapper()
        self.mapper.SetInputData(self.image)
        self.mapper.AutoAdjustSampleDistancesOff()
        self.mapper.SetImageSampleDistance(1)
        self.mapper.SetSampleDistance(self.cell)
        self.mapper.SetInteractiveSampleDistance(self.cell)
        self.volume = vtk.vtkVolume()
        self.volume.SetMapper(self.mapper)
        self.volume.SetProperty(self.property(transfer))
        self.renderer = vtk.vtkRenderer()
        self.renderer.AddVolume(self.volume)
        self.renderer.SetBackground(*BOTTOM)
        self.renderer.SetBackground2(*TOP)
        self.renderer.GradientBackgroundOn()
        # VTK multiplies its ambient weight by the light's ambient colour, which is black by default.
        light = vtk.vtkLight()
        light.SetLightTypeToHeadlight()
        light.SetAmbientColor(1, 1, 1)
        self.renderer.AddLight(light)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(pixels, pixels)
        self.window.AddRenderer(self.renderer)

    def property(self, transfer):
        p = vtk.vtkVolumeProperty()
        colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
        with open(transfer) as f:
            for q in json.load(f)["points"]:
                colour.AddRGBPoint(q["value"], *q["rgb"])
                opacity.AddPoint(q["value"], q["opacity"])
        p.SetColor(colour)
        p.SetScalarOpacity(opacity)
        p.SetScalarOpacityUnitDistance(self.cell)
        p.SetInterpolationTypeToLinear()
        p.ShadeOn()
        # The weights of our shading: a light at the eye, ambient 1/4, diffuse 3/4, highlight 1/5.
        p.SetAmbient(0.25)
        p.SetDiffuse(0.75)
        p.SetSpecular(0.2)
        p.SetSpecularPower(24)
        return p

    def look(self, azimuth):
        """docs/rendering.md: azimuth 0 looks along -y with +x to the right, view-up -z; zoom 1 of the grid."""
        b = self.image.GetBounds()
        middle = [(b[2 * a] + b[2 * a + 1]) / 2 for a in range(3)]
        radius = math.dist(b[0::2], b[1::2]) / 2
        az, el, half = math.radians(azimuth), math.radians(self.elevation), math.radians(15)
        towards = (math.cos(el) * math.sin(az), math.cos(el) * math.cos(az), -math.sin(el))
        camera = self.renderer.GetActiveCamera()
        camera.SetFocalPoint(*middle)
        camera.SetPosition(*[m + radius / math.sin(half) * t for m, t in zip(middle, towards)])
        camera.SetViewUp(0, 0, -1)
        camera.SetViewAngle(30)
        self.renderer.ResetCameraClippingRange()

    def picture(self, azimuth, shaded):
        self.look(azimuth)
        self.volume.GetProperty().SetShade(shaded)
        self.window.Render()
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ShouldRerenderOff()
        grab.Update()
        w, h, _ = grab.GetOutput().GetDimensions()
        return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(h, w, 3)[::-1].astype(int)

    def seconds(self, azimuth):
        """Of the mapper alone, and with the window."""
        self.look(azimuth)
        start = time.perf_counter()
        self.window.Render()
        whole = time.perf_counter() - start
        start = time.perf_counter()
        self.mapper.PerVolumeInitialization(self.renderer, self.volume)
        self.mapper.PerSubVolumeInitialization(self.renderer, self.volume, 0)
        self.mapper.RenderSubVolume()
        return time.perf_counter() - start, whole


def run_vdvr(arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout


def our_side(o, volume):
    """What we render, and how: our --step counts base cells."""
    ours = o.certified or volume
    how = [] if o.certified else ["--method", "dvr"]
    if o.step:
        if o.certified:
            cell = min(json.loads(run_vdvr([o.vdvr, "info", ours, "--json"]))["grid"]["spacing"])
        else:
            reader = vtk.vtkMetaImageReader()
            reader.SetFileName(volume)
            reader.UpdateInformation()
            cell = min(reader.GetDataSpacing())
        how += ["--step", f"{o.step / cell!r}"]
    return [ours] + how


def our_picture(o, volume, transfer, azimuth, shaded, folder):
    path = os.path.join(folder, f"vdvr-{azimuth:g}{'' if shaded else '-unshaded'}.png")
    run_vdvr([o.vdvr, "render", *our_side(o, volume), "-o", path, "--force", "--tf", transfer, "--frame", "grid", "--azimuth",
              f"{azimuth}", "--elevation", f"{o.elevation}", "--size", f"{o.pixels}x{o.pixels}", "--device", o.device,
              "--quiet"] + ([] if shaded else ["--no-shading"]))
    reader = vtk.vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    w, h, _ = reader.GetOutput().GetDimensions()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(h, w, 3)[::-1].astype(int)


def save(path, rgb):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    image = vtk.vtkImageData()
    image.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    image.GetPointData().SetScalars(numpy_to_vtk(rgb[::-1].reshape(-1, 3).astype(np.uint8).copy(), deep=1))
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputData(image)
    writer.Write()


def difference(o, peer, volume, transfer, shaded, folder):
    """The largest over three azimuths of the mean absolute difference where either picture shows the volume."""
    h = o.pixels
    f = ((np.arange(h) + 0.5) / h)[:, None, None]
    background = np.rint(255 * ((1 - f) * np.array(TOP) + f * np.array(BOTTOM)))
    worst = 0.0
    for azimuth in (0.0, 35.0, 200.0):
        ours = our_picture(o, volume, transfer, azimuth, shaded, folder)
        theirs = peer.picture(azimuth, shaded)
        if o.keep:
            save(os.path.join(folder, f"vtk-{azimuth:g}{'' if shaded else '-unshaded'}.png"), theirs)
        shown = (abs(ours - background).max(2) > 2) | (abs(theirs - background).max(2) > 2)
        if not shown.any():
            sys.exit("the volume shows nothing in either picture")
        worst = max(worst, abs(ours - theirs)[shown].mean())
    return worst


def spread(values):
    return {"min": min(values), "median": statistics.median(values), "max": max(values)}


def compare(o, name, volume, transfer, folder):
    peer = Peer(volume, transfer, o.pixels, o.elevation, o.step)
    plain = difference(o, peer, volume, transfer, False, folder)
    shaded = difference(o, peer, volume, transfer, True, folder)
    for what, found, limit in (("without", plain, o.limit), ("with", shaded, o.shaded_limit)):
        if not found <= limit:
            sys.exit(f"{name}: {what} shading the pictures differ by {found:.2f} of 255 on average, above the limit "
                     f"{limit}: not timed")
    theirs, theirs_whole, ours = [], [], []
    for r in range(o.rounds):
        # Each round starts elsewhere on the turn; both take the same azimuths.
        start = 360.0 * r / (o.rounds * o.frames)
        line = json.loads(run_vdvr(
            [o.vdvr, "bench", "render", *our_side(o, volume), "--tf", transfer, "--frames", str(o.frames),
             "--azimuth", f"{start}", "--elevation", f"{o.elevation}", "--size", f"{o.pixels}x{o.pixels}", "--device",
             o.device, "--quiet"]).splitlines()[-1])
        ours.append(line["fps"])
        for f in range(o.frames):
            mapper, window = peer.seconds(start + 360.0 * f / o.frames)
            theirs.append(1 / mapper)
            theirs_whole.append(1 / window)
    result = {
        "case": "peer render", "volume": name, "size": [o.pixels, o.pixels],
        "cells": [n - 1 for n in peer.image.GetDimensions()], "device": line["device"], "driver": line["driver"],
        "peer": "VTK " + vtk.vtkVersion().GetVTKVersion(), "threads": peer.mapper.GetNumberOfThreads(),
        "frames": o.frames, "rounds": o.rounds,
        "difference": {"unshaded": plain, "limit": o.limit, "shaded": shaded, "shaded_limit": o.shaded_limit,
                       "of": 255},
        "fps": {"min": min(x["min"] for x in ours), "median": statistics.median(x["median"] for x in ours),
                "max": max(x["max"] for x in ours)},
        "peer_fps": spread(theirs), "peer_fps_with_window": spread(theirs_whole),
    }
    result["ratio"] = result["fps"]["median"] / result["peer_fps"]["median"]
    # On a machine that others use too, the fastest frames of both were disturbed least.
    result["ratio_of_fastest"] = result["fps"]["max"] / result["peer_fps"]["max"]
    print(json.dumps(result), flush=True)
    return result


def main():
    o = options()
    vtk.vtkObject.GlobalWarningDisplayOff()
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)
    if o.volume and not o.tf:
        sys.exit("--volume needs --tf: both programs must show the same")
    if o.certified and not (o.volume and o.step):
        sys.exit("--certified needs --volume, a uniform grid on the same box, and --step: one distance for both")
    results = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = o.keep or scratch
        os.makedirs(folder, exist_ok=True)
        transfer = o.tf or os.path.join(scratch, "transfer.json")
        if not o.tf:
            write_transfer(transfer)
        cases = [(o.volume, o.volume)] if o.volume else []
        for n in [] if o.volume else map(int, o.sizes.split(",")):
            path = os.path.join(scratch, f"signal-{n}.mha")
            write_signal(path, n)
            cases.append((f"marschner-lobb {n}^3", path))
        for name, path in cases:
            results.append(compare(o, name, path, transfer, folder))
    print(f"\n{'volume':<24} {'vdvr fps':>9} {'VTK fps':>9} {'ratio':>7} {'of fastest':>11} {'difference of 255, unshaded / shaded':>37}")
    for r in results:
        print(f"{r['volume']:<24} {r['fps']['median']:>9.2f} {r['peer_fps']['median']:>9.2f} {r['ratio']:>7.2f} "
              f"{r['ratio_of_fastest']:>11.2f} {r['difference']['unshaded']:>28.2f} / {r['difference']['shaded']:.2f}")


if __name__ == "__main__":
    main()
