"""Holds examples/read_volume.py to `vdvr probe` at random points: read_volume.py VDVR. Called by read_volume_test.cmake."""

import csv
import random
import subprocess
import sys
import tempfile
from pathlib import Path

example, vdvr = sys.argv[1:]
# Double against float32 arithmetic: nine roundings of half an ulp, of values at most that large (docs/file-format.md).
ROUNDING = 9 * 2.0**-24


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{words}: {done.stderr}"
    return done.stdout


with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    scan, points, values = folder / "s.h5", folder / "points.csv", folder / "values.csv"
    run(vdvr, "simulate", "--phantom", "sphere", "--detector", "21x7", "--angles", "24", "-o", scan)
    random.seed(1)
    inside = [[random.uniform(-6, 6), random.uniform(-6, 6), random.uniform(-3, 3)] for _ in range(20)]
    points.write_text("x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in inside), encoding="utf-8")
    # Integers in two types, and float32 alone.
    for storage in ("auto", "u8", "f32"):
        file = folder / f"{storage}.vdvr"
        run(vdvr, "build", scan, "--epsilon", "5%", "--storage", storage, "-o", file)
        run(vdvr, "probe", file, "--points", points, "-o", values, "--force")
        with open(values, encoding="utf-8", newline="") as lines:
            rows = list(csv.DictReader(lines))
        assert len(rows) == len(inside) and all(row["covered"] == "1" for row in rows)
        assert len({row["level"] for row in rows}) > 1, "one level only: tiles were not read"
        for point, row in zip(inside, rows):
            value, expected = float(run(sys.executable, example, file, *point).split()[0]), float(row["value"])
            assert abs(value - expected) <= ROUNDING * 2, f"{storage} at {point}: {value}, not {expected}"
