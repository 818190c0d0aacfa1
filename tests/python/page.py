#!/usr/bin/env python3
"""Runs the code blocks of docs/python.md, and compares what they make with the command line's.

  page.py VDVR DOCUMENT
"""
import json
import pathlib
import re
import subprocess
import sys

import h5py
import numpy as np

vdvr_program, document = sys.argv[1], pathlib.Path(sys.argv[2])


def run(*words):
    subprocess.run([vdvr_program, *map(str, words), "--quiet", "--force"], check=True, stdout=subprocess.DEVNULL)


blocks = re.findall(r"^```python\n(.*?)^```$", document.read_text(encoding="utf-8"), re.S | re.M)
assert len(blocks) >= 6, "the page has lost its code"
space = {}
for block in blocks:
    exec(compile(block, str(document), "exec"), space)
np_ = space["np"]

# The same projections as a file, for the program. NumPy's degrees are what Scan was given.
with h5py.File("ball.h5", "w") as file:
    data = file.create_dataset("/exchange/data", data=space["tomo"].astype(np.float32))
    data.attrs.update({"description": "line integrals", "pitch_u": 1.0, "pitch_v": 1.0, "center": 16.0, "unit": "pixel"})
    file["/exchange/theta"] = np.rad2deg(space["theta"])
run("build", "ball.h5", "--epsilon", "4%", "-o", "theirs.vdvr")
info = json.loads(subprocess.run([vdvr_program, "info", "theirs.vdvr", "--json"], check=True, capture_output=True).stdout)
volume = space["volume"]
mine, theirs = volume.content_sha256, info["certificate"]["content_sha256"]
assert mine == theirs, f"content: {mine} from Python, {theirs} from the program"
assert volume.certificate["total"] == info["certificate"]["total"]

# Values at points.
points = space["points"]
with open("points.csv", "w", encoding="utf-8") as file:
    file.write("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in points))
run("probe", "theirs.vdvr", "--points", "points.csv", "-o", "values.csv")
rows = [line.split(",") for line in open("values.csv", encoding="utf-8").read().splitlines()[1:]]
values = np.array([float(r[3]) if r[3] else np.nan for r in rows], dtype=np.float32)
assert np.array_equal(values, volume(points), equal_nan=True), (values, volume(points))
assert np.isnan(volume(points)[-1]) and not np.isnan(values[:-1]).any()
total = float(rows[0][4])
assert (volume.bound(points)[:-1] <= np.nextafter(np.float32(total), np.float32(np.inf))).all()
assert np.isnan(volume.bound(points)[-1])

# Uniform samples.
for factor in (1, 4):
    run("export", "theirs.vdvr", "-o", "samples.npy", "--oversampling", factor)
    spacing = [s / factor for s in volume.grid.spacing]
    assert np.array_equal(np.load("samples.npy"), volume.to_numpy(spacing=spacing)), f"samples, {factor}x"
whole = volume.to_numpy(spacing=0.25)
at = volume.lattice(spacing=0.25, box=(0, -4, -4, 8, 4, 4))
first = [round((o - g) / 0.25) for o, g in zip(at.origin, volume.grid.origin)]
part = tuple(slice(f, f + n) for f, n in zip(first[::-1], at.count[::-1]))
assert np.array_equal(whole[part], space["fine"]), "a part is not that of the whole"

# Pictures: compared decoded, so that the way a PNG is packed does not matter.
from PIL import Image  # noqa: E402

size = ["--size", "320x240"]
for name, words in {
    "picture": ["--azimuth", 40, "--elevation", 15],
    "surface": ["--mode", "iso", "--iso", 0.5],
    "slice_of_bounds": ["--mode", "error"],
}.items():
    run("render", "theirs.vdvr", "-o", "picture.png", *size, *words)
    assert np.array_equal(np.asarray(Image.open("picture.png").convert("RGB")), space[name]), name
for words in (["--mode", "slice", "--plain"], ["--mode", "error"]):
    run("render", "theirs.vdvr", "-o", "picture.png", "--size", "512x512", *words)
    drawn = volume.render(size=(512, 512), mode=words[1])
    assert np.array_equal(np.asarray(Image.open("picture.png").convert("RGB")), drawn), words
run("render", "theirs.vdvr", "-o", "bounds.npy", *size, "--mode", "error")
drawn = volume.render(size=(320, 240), mode="error", values=True)
assert np.array_equal(np.load("bounds.npy"), drawn, equal_nan=True)
assert space["picture"].std() > 5, "the picture shows nothing"
run("render", "theirs.vdvr", "-o", "errors.npy", *size, "--show", "error")
assert np.array_equal(np.load("errors.npy"), space["errors"], equal_nan=True)
Image.fromarray(space["picture"]).save("page.png")

# Prepared and windowed, from a file with lengths.
with h5py.File("ball.h5") as file, h5py.File("mm.h5", "w") as other:
    for name in ("/exchange/data", "/exchange/theta"):
        file.copy(name, other.require_group("/exchange"))
    other["/exchange/data"].attrs["unit"] = "mm"
options = ["--phase", "20,25,100", "--stripes", "on", "--window", "0.1,0.6", "--size", "32x32x20", "--base", "2x1x2"]
run("build", "mm.h5", "--epsilon", "10%", "-o", "prepared.vdvr", *options)
prepared = space["vdvr"].build(
    space["vdvr"].read_scan("mm.h5", phase=(20, 25, 100), stripes=True), "10%", window=(0.1, 0.6), size=(32, 32, 20),
    base=(2, 1, 2))
theirs = space["vdvr"].open("prepared.vdvr")
assert prepared.content_sha256 == theirs.content_sha256
assert prepared.certificate["window"] == theirs.certificate["window"] == [0.1, 0.6]
assert prepared.certificate["total"] == theirs.certificate["total"]

# What Python wrote, the program reads and verifies; the program's file, Python.
vdvr = space["vdvr"]
assert vdvr.verify(vdvr.open("theirs.vdvr"), vdvr.read_scan("ball.h5"))
space["scan"].save("saved.h5")
assert np.array_equal(vdvr.read_scan("saved.h5").data, space["scan"].data)
try:
    vdvr.verify("ball.vdvr", vdvr.Scan(space["tomo"] + 1e-3, np.rad2deg(space["theta"]), center=16.0))
    raise SystemExit("a certificate was verified with other projections")
except vdvr.MismatchError:
    pass
print("docs/python.md: content, values, bounds, samples and pictures are the command line's")
