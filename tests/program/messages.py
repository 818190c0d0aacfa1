"""What `vdvr` says of bad input, a hundred times: exit code 2 (1 and 3 where noted), one line that names what, where, which
value and what to do, and nothing written.

messages.py VDVR"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

VDVR = sys.argv[1]
VIEWS, ROWS, COLUMNS = 24, 5, 17


def run(*words):
    return subprocess.run([VDVR, *words], capture_output=True, text=True, timeout=120)


def made(*words):
    ended = run(*words, "--quiet")
    assert ended.returncode == 0, ended.stderr


def exchange(name, **changed):
    """A Data Exchange file of counts with one thing changed; None: it is not there."""
    rng = np.random.default_rng(1)
    parts = {"data": (500 * np.exp(-0.5 * rng.random((VIEWS, ROWS, COLUMNS)))).astype("f4"),
             "data_white": np.full((2, ROWS, COLUMNS), 500, "f4"), "data_dark": np.zeros((2, ROWS, COLUMNS), "f4"),
             "theta": np.arange(VIEWS) * 7.5}
    with h5py.File(name, "w") as file:
        for key, value in {**parts, **changed}.items():
            if value is not None:
                file["exchange/" + key] = value


def folder(name, description):
    pathlib.Path(name).mkdir()
    text = description if isinstance(description, str) else json.dumps(description)
    pathlib.Path(name, "scan.json").write_text(text)


def prepare():
    made("simulate", "--phantom", "sphere", "--detector", f"{COLUMNS}x{ROWS}", "--angles", str(VIEWS), "-o", "scan.h5")
    made("simulate", "--phantom", "sphere", "--detector", "17x9", "--angles", "24", "--cone", "60,90", "-o", "cone")
    made("build", "scan.h5", "--epsilon", "8%", "-o", "v.vdvr")
    made("reconstruct", "scan.h5", "-o", "u.mha")
    angles = np.arange(VIEWS) * 7.5
    exchange("nodata.h5", data=None)
    exchange("notheta.h5", theta=None)
    exchange("shorttheta.h5", theta=angles[:20])
    exchange("nantheta.h5", theta=np.where(np.arange(VIEWS) == 3, np.nan, angles))
    exchange("flatshape.h5", data_white=np.full((2, 4, COLUMNS), 500, "f4"))
    exchange("data2d.h5", data=np.ones((VIEWS, COLUMNS), "f4"))
    exchange("noflats.h5", data_white=None, data_dark=None)
    exchange("oneview.h5", data=np.full((1, ROWS, COLUMNS), 400, "f4"), theta=np.zeros(1))
    exchange("sameangle.h5", theta=np.zeros(VIEWS))
    exchange("text.h5", data=np.array([b"a"] * 3))
    folder("nofile", {"projections": "none-*.tif"})
    folder("unknown", {"projections": "*.tif", "colour": 3})
    folder("nojson", "{bad")
    folder("outside", {"hdf5": "../scan.h5"})
    folder("nothing", {})
    pathlib.Path("emptydir").mkdir()
    texts = {"text.txt": "hello\n", "empty.h5": "", "p.csv": "x,y,z\n0,0,0\n", "head.csv": "a,b\n1,2\n", "line.csv": "x,y,z\n1,2\n",
             "tf.json": '{"points": 3}', "views.json": '{"views": []}',
             "ell.json": '{"ellipsoids": [{"density": 1, "center": [0, 0], "semi_axes": [1, 1, 1]}]}'}
    for name, text in texts.items():
        pathlib.Path(name).write_text(text)
    whole = bytearray(pathlib.Path("v.vdvr").read_bytes())
    pathlib.Path("cut.vdvr").write_bytes(whole[:3000])
    pathlib.Path("cut.mha").write_bytes(pathlib.Path("u.mha").read_bytes()[:500])


PLAN = "plan scan.h5 --epsilon 3% "
BUILD = "build scan.h5 --epsilon 8% "
RENDER = "render v.vdvr -o o.png "
# A command, what its message holds (what, where, value, remedy), and the exit code where it is not 2.
CASES = [
    ("info none.h5", ["none.h5", "no such file"]),
    ("info text.txt", ["text.txt", "Data Exchange", "scan.json"]),
    ("info empty.h5", ["empty.h5", "is empty"]),
    ("info nodata.h5", ["nodata.h5", "/exchange/data", "NXtomo"]),
    ("info emptydir", ["emptydir/scan.json", "cannot be opened"]),
    ("info nofile", ["nofile/scan.json", "'projections'", "none-*.tif", "no file in"]),
    ("info unknown", ["unknown/scan.json", "'colour'", "there are:", "projections"]),
    ("info nojson", ["nojson/scan.json", "line 1", "column 2"]),
    ("info outside", ["outside/scan.json", "'hdf5'", "../scan.h5", "stay within"]),
    ("info nothing", ["nothing/scan.json", "'projections'", "'hdf5'"]),
    ("info cut.vdvr", ["cut.vdvr", "truncated"]),
    ("verify cut.vdvr --projections scan.h5", ["cut.vdvr", "truncated"]),
    ("verify v.vdvr --projections nodata.h5", ["nodata.h5", "/exchange/data"]),
    ("verify v.vdvr", ["--projections", "usage:"]),
    ("verify scan.h5 --projections scan.h5", ["scan.h5", "not a certified volume", "vdvr build"]),
    ("verify v.vdvr --projections cone", ["cone", "other projections", "24 x 9 x 17", "24 x 5 x 17", "scan.h5"], 1),
    ("plan notheta.h5 --epsilon 3%", ["notheta.h5", "/exchange/theta", "--angles-file", "scan.json"]),
    ("plan shorttheta.h5 --epsilon 3%", ["shorttheta.h5", "20 angles", "24 frames", "--angles-file"]),
    ("plan nantheta.h5 --epsilon 3%", ["nantheta.h5", "angle 3", "nan", "--views"]),
    ("plan flatshape.h5 --epsilon 3%", ["flatshape.h5", "/exchange/data_white", "4 rows x 17", "5 x 17"]),
    ("plan data2d.h5 --epsilon 3%", ["data2d.h5", "/exchange/data", "24 x 17", "three axes", "[angle][v][u]"]),
    ("plan noflats.h5 --epsilon 3%", ["noflats.h5", "/exchange/data_white", "--flats LEVEL", "--transmission"]),
    ("plan oneview.h5 --epsilon 3%", ["oneview.h5", "1 view", "at least 2", "--views"]),
    ("plan sameangle.h5 --epsilon 3%", ["sameangle.h5", "24 views", "one direction", "own angle"]),
    ("plan text.h5 --epsilon 3%", ["text.h5", "/exchange/data", "not numeric"]),
    ("plan scan.h5", ["tolerance", "--epsilon 3%", "--epsilon-abs"]),
    ("plan scan.h5 --epsilon abc", ["--epsilon", "'abc'", "number"]),
    ("plan scan.h5 --epsilon -3%", ["--epsilon", "-3%", "above 0"]),
    ("plan scan.h5 --epsilon 0", ["--epsilon", "above 0"]),
    ("plan scan.h5 --epsilon 2sigma", ["scan.h5", "noise", "--photons", "--sigma-p", "--epsilon 3%"]),
    ("plan scan.h5 --epsilon 1e-9%", ["out of reach", "the smallest", "% of the range"], 1),
    (PLAN + "--center 900", ["scan.h5", "900", "-0.5 to 16.5"]),
    (PLAN + "--center x", ["--center", "'x'"]),
    (PLAN + "--filter foo", ["--filter", "'foo'", "ram-lak", "hann"]),
    (PLAN + "--filter-cutoff 2", ["--filter-cutoff", "2", "above 1"]),
    (PLAN + "--size 8x8", ["--size", "'8x8'", "3 sizes"]),
    (PLAN + "--size 0x8x8", ["--size", "0", "between 1 and"]),
    (PLAN + "--spacing -1", ["--spacing", "-1", "above 0"]),
    (PLAN + "--roi 0,0,0,1,1", ["--roi", "0,0,0,1,1", "6 numbers"]),
    (PLAN + "--roi=5,5,5,1,6,6", ["--roi", "5", "below 1", "along x", "lower corner"]),
    (PLAN + "--upsampling 3", ["--upsampling", "3", "power of two"]),
    (PLAN + "--gold 5", ["--gold", "5", "power of two"]),
    (PLAN + "--granularity 3", ["--granularity", "3", "1, 2, 4, 8"]),
    (PLAN + "--base 3x3x3", ["--base", "3", "1, 2, 4, 8"]),
    (PLAN + "--storage u4", ["--storage", "'u4'", "auto, f32, u16, u8"]),
    (PLAN + "--window 1,2", ["--window", "build"]),
    (PLAN + "--median 2", ["median", "2", "odd"]),
    (PLAN + "--binning 40", ["binning", "40", "17 x 5"]),
    (PLAN + "--phase 1,2", ["--phase", "2 numbers", "3"]),
    (PLAN + "--stripes x", ["--stripes", "'x'"]),
    (PLAN + "--outliers -1", ["outliers", "-1", "positive"]),
    (PLAN + "--photons -5", ["--photons", "-5", "above 0"]),
    (PLAN + "--sigma-p 0", ["--sigma-p", "0", "above 0"]),
    (PLAN + "--views 5:3", ["[5, 3)", "24 projections"]),
    (PLAN + "--views 0:900", ["[0, 900)", "24 projections"]),
    (PLAN + "--entry /nowhere", ["scan.h5", "'/nowhere'", "entries"]),
    (PLAN + "--device 99", ["--device '99'", "there are:", "0: "], 3),
    (PLAN + "--device nobody", ["--device 'nobody'", "there are:"], 3),
    (PLAN + "--max-memory 1M", ["MiB", "--max-memory", "--size"], 3),
    (PLAN + "--max-memory x", ["--max-memory", "'x'", "512M"]),
    (PLAN + "--machines 2", ["--machines", "--ranks"]),
    (PLAN + "--frobnicate", ["'--frobnicate'", "vdvr plan --help"]),
    ("plan scan.h5 extra --epsilon 3%", ["too many", "usage:"]),
    (PLAN + "--angles-file text.txt", ["text.txt", "line 1", "'hello'"]),
    ("plan u.mha --epsilon 3%", ["u.mha", "is a volume", "--angles-file"]),
    (PLAN + "--transmission", ["scan.h5", "dead", "flats", "darks"]),
    (PLAN + "--picture-tolerance 0", ["--picture-tolerance", "--picture-views"]),
    (PLAN + "--picture-tolerance 8 --picture-views views.json", ["views.json", "'views'", "at least one"]),
    ("build scan.h5 --epsilon 8%", ["--output", "usage:"]),
    (BUILD + "-o v.vdvr", ["v.vdvr", "exists already", "--force"]),
    (BUILD + "-o nowhere/o.vdvr", ["'nowhere'", "does not exist"]),
    (BUILD + "-o o.vdvr --share 5/3", ["--share", "5/3"]),
    ("run scan.h5 -o text.txt", ["text.txt", "not a folder"]),
    ("reconstruct scan.h5 -o o.xyz", ["o.xyz", ".mha", "--format"]),
    ("reconstruct scan.h5 -o o.mha --size 99999x99999x99999", ["--size", "99999x99999x99999", "2^40"]),
    ("probe v.vdvr --points none.csv -o o.csv", ["none.csv", "x,y,z"]),
    ("probe v.vdvr --points head.csv -o o.csv", ["head.csv", "'a,b'", "x,y,z"]),
    ("probe v.vdvr --points line.csv -o o.csv", ["line.csv", "line 2", "'1,2'"]),
    ("probe scan.h5 --points p.csv -o o.csv", ["scan.h5", "--exact"]),
    ("render v.vdvr", ["--output", "usage:"]),
    ("render v.vdvr -o o.bmp", ["o.bmp", ".png", ".npy"]),
    ("render none.vdvr -o o.png", ["none.vdvr", "no such file"]),
    (RENDER + "--mode x", ["--mode", "'x'", "slice"]),
    (RENDER + "--size 0x5", ["--size", "0"]),
    (RENDER + "--tf nope", ["'nope'", "default", "JSON"]),
    (RENDER + "--tf tf.json", ["tf.json", "'points'", "opacity"]),
    (RENDER + "--iso 1", ["--iso", "--mode iso"]),
    (RENDER + "--zoom 0", ["--zoom", "0", "above 0"]),
    (RENDER + "--step 0", ["--step", "0", "above 0"]),
    (RENDER + "--mode slice --slice-position 1e9", ["--slice-position", "1000000000", "-2 to 2", "z"]),
    (RENDER + "--certify foo", ["--certify", "'foo'", "exact, box, fast"]),
    ("render u.mha -o o.png --certify fast", ["u.mha", "--certify", "vdvr build"]),
    ("render cut.mha -o o.png", ["cut.mha", "truncated", "18 x 18 x 5", "230"]),
    (RENDER + "--turntable 0", ["--turntable", "0", "9999"]),
    (RENDER + "--mode error --projections cone", ["cone", "other projections"], 1),
    ("export v.vdvr -o o.foo", ["o.foo", ".mha", "--format"]),
    ("export scan.h5 -o o.mha", ["scan.h5", "not a certified volume", "vdvr build"]),
    ("export v.vdvr -o o.mha --oversampling 3", ["--oversampling", "'3'", "1, 2, 4, 8"]),
    ("export v.vdvr -o o.mha --samples u8", ["o.mha", "f32", "tiff"]),
    ("serve none.vdvr", ["none.vdvr", "no such file"]),
    ("serve v.vdvr --port 70000", ["--port", "70000", "65535"]),
    ("convert-geometry scan.h5 -o g.xml", ["scan.h5", "parallel beam", "cone beam"]),
    ("center scan.h5 --row 2", ["--row", "--output"]),
    ("center scan.h5 --count 4 -o o.png", ["--count", "4", "odd"]),
    ("residual scan.h5 u.mha -o r.png", ["u.mha", "not a certified volume", "vdvr build"]),
    ("residual cone v.vdvr -o r.png", ["cone", "other projections"], 1),
    ("simulate -o o.h5", ["--phantom", "--volume"]),
    ("simulate --phantom foo -o o.h5", ["'foo'", "marschner-lobb", "FILE.json"]),
    ("simulate --phantom ell.json -o o.h5", ["ell.json", "'ellipsoids[0].center'", "three numbers"]),
    ("simulate --phantom sphere --angles 0 -o o.h5", ["--angles", "0", "between 1"]),
    ("simulate --phantom sphere --detector 5 -o o.h5", ["--detector", "'5'", "2 sizes"]),
    ("simulate --phantom shepp-logan --detector 65x33 --angles 20 --photons 500 -o o.h5",
     ["--photons 500", "line integrals", "no photon", "--pitch"]),
    ("simulate --volume scan.h5 -o o.h5", ["scan.h5", "not a volume", ".mha"]),
    ("bench foo", ["'foo'", "fbp"]),
    ("bench", ["fbp", "render"]),
    ("frob", ["'frob'", "vdvr --help"]),
]


def failures_of(command, fragments, code=2):
    ended = run(*command.split())
    said = [line for line in ended.stderr.splitlines() if ": " in line and (code == 3 or not line.endswith(": read"))]
    found = [] if ended.returncode == code else [f"exit code {ended.returncode}, not {code}"]
    found += [f"lacks \"{fragment}\"" for fragment in fragments if fragment not in ended.stderr]
    if code != 3 and len([line for line in said if len(line.split(": ", 1)[1].split()) > 2]) != 1:
        found.append("is not one line")
    return [f"vdvr {command}: {what}; it says: {ended.stderr.strip()}" for what in found]


def main():
    assert len(CASES) >= 100
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        prepare()
        before = sorted(str(p) for p in pathlib.Path(".").rglob("*"))
        failures = [line for case in CASES for line in failures_of(*case)]
        left = sorted(set(str(p) for p in pathlib.Path(".").rglob("*")) - set(before))
        failures += [f"left behind: {name}" for name in left]
        os.chdir("/")
    print("\n".join(failures) or f"{len(CASES)} messages")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
