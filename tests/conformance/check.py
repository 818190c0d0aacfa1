"""Holds the program and the reader of examples/verify.py to the kit: check.py VDVR SOURCE."""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

vdvr, source = sys.argv[1], Path(sys.argv[2])
sys.dont_write_bytecode = True  # examples/ is installed as it is
sys.path.insert(0, str(source / "examples"))
import verify  # noqa: E402

files, kit = source / "tests/conformance/files", json.loads((source / "tests/conformance/kit.json").read_text())
wrong = []


def program(*words):
    return subprocess.run([vdvr, *map(str, words)], capture_output=True, text=True, errors="replace", check=False)


def probed(path, points, folder):
    """What `probe` says at points, None where it says nothing."""
    asked, answered = folder / "points.csv", folder / "values.csv"
    lines = ["x,y,z", *(",".join(repr(x) for x in point) for point in points)]
    asked.write_text("\n".join(lines) + "\n")
    done = program("probe", path, "--points", asked, "-o", answered, "--force", "--quiet")
    assert done.returncode == 0, f"{path.name}: probe ends with {done.returncode}: {done.stderr}"
    with open(answered, newline="") as f:
        return [float(row["value"]) if row["value"] else None for row in csv.DictReader(f)]


def expect(what, found, wanted):
    if found != wanted:
        wrong.append(f"{what}: {found}, not {wanted}")


def opens(name, told, folder):
    path = files / f"{name}.vdvr"
    done = program("info", path)
    expect(f"{name} ({told['feature']}): info {done.stderr}", done.returncode, 0)
    points, values = np.array(told["values"])[:, :3], np.array(told["values"])[:, 3]
    volume = verify.Volume(path)
    # The reader works in double precision, with the rounding of some ten operations; the program in single.
    most = np.abs(volume.at(points[:, ::-1]) - values).max()
    expect(f"{name}: verify.py errs by {most}", most <= told["tolerance"] * 2.0**-20, True)
    if not volume.comparison:
        expect(f"{name}: verify.py's hash", volume.content_hash(), volume.certificate["content_sha256"])
    expect(f"{name}: samples that differ", volume.differing_samples(), 0)
    if done.returncode == 0:
        found = probed(path, points.tolist(), folder)
        expect(f"{name}: probe is silent at points", [p for p, v in zip(points.tolist(), found) if v is None], [])
        far = [(p, v, w) for p, v, w in zip(points.tolist(), found, values) if v is not None and not abs(v - w) <= told["tolerance"]]
        expect(f"{name}: probe differs", far, [])


def ends_with(name, rule, status, folder):
    """Both `info` and `probe` end with a status, and say why."""
    (folder / "point.csv").write_text("x,y,z\n0,0,0\n")
    answered = folder / f"{name}.csv"
    for words in (("info", files / f"{name}.vdvr"), ("probe", files / f"{name}.vdvr", "--points", folder / "point.csv", "-o", answered)):
        done = program(*words)
        expect(f"{name} ({rule}): {words[0]} {done.stderr.strip()}", done.returncode, status)
        expect(f"{name}: {words[0]} gives no reason", len(done.stderr + done.stdout) > 0, True)
    expect(f"{name}: probe leaves values", answered.exists(), False)


def refused(name, told, folder):
    ends_with(name, told["rule"], 2, folder)
    try:
        verify.Volume(files / f"{name}.vdvr")
        if told.get("below_hdf5"):  # HDF5 inflates for verify.py, and does not mind
            return
        wrong.append(f"{name} ({told['rule']}): verify.py opens it")
    except verify.Refused:
        pass


def altered(name, told, folder):
    ends_with(name, told["rule"], 1, folder)
    volume = verify.Volume(files / f"{name}.vdvr")
    complaints = []
    try:
        for right, message in verify.contradictions(volume.certificate, volume, None, None):
            complaints += [] if right else [message]
    except AttributeError:  # here it asks for the scan
        pass
    expect(f"{name} ({told['rule']}): verify.py has nothing to say", bool(complaints), True)


with tempfile.TemporaryDirectory() as place:
    for kind, held in (("opens", opens), ("refused", refused), ("altered", altered)):
        for name, told in kit[kind].items():
            held(name, told, Path(place))
expect("files without an entry", sorted(p.stem for p in files.glob("*.vdvr") if not any(p.stem in part for part in kit.values())), [])
print(*wrong, sep="\n")
print(f"{len(kit['opens'])} files to open, {len(kit['refused'])} to refuse, {len(kit['altered'])} altered: {len(wrong)} wrong")
sys.exit(1 if wrong else 0)
