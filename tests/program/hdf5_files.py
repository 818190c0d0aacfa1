"""Scans as others write them in HDF5 (h5py, hdf5plugin): virtual, linked, compressed, broken.

  hdf5_files.py VDVR FOLDER

Every whole variant gives the volume of the plain file to the bit, and every broken one ends with one line and exit code 2.
Remedies that messages name are run as they stand."""
import json
import os
import pathlib
import re
import shlex
import shutil
import struct
import subprocess
import sys

import h5py
import hdf5plugin
import numpy

VDVR, WORK = sys.argv[1], pathlib.Path(sys.argv[2])
WORK.mkdir(parents=True, exist_ok=True)
FRAMES_A_FILE = 7   # does not divide the frames: the last file is shorter
OLD = ("earliest", "v110")  # what the oldest HDF5 that is supported here reads
DEBIAN = {"LZ4": "hdf5-filter-plugin", "Blosc": "hdf5-filter-plugin-blosc-serial", "bitshuffle": "bitshuffle",
          "LZF": "bitshuffle", "bzip2": "hdf5-filter-plugin"}
failures = 0


def expect(condition, what):
    global failures
    if not condition:
        failures += 1
        print("FAILED:", what, flush=True)


def vdvr(*words, env=None):
    return subprocess.run([VDVR, *map(str, words)], capture_output=True, text=True, env={**os.environ, **(env or {})})


def volume_of(scan, *options, env=None, where=""):
    out = WORK / "volume.mha"
    run = vdvr("reconstruct", scan, "-o", out, "--force", "--quiet", *options, env=env)
    expect(run.returncode == 0, f"{where or scan}: {run.stderr}")
    return out.read_bytes() if run.returncode == 0 else b""


def refused(scan, *parts, options=(), env=None):
    """The line with which every command refuses this scan."""
    run = vdvr("info", scan, *options, env=env)
    line = run.stderr.strip()
    expect(run.returncode == 2, f"{scan}: exit code {run.returncode}: {run.stderr}")
    expect(line.count("\n") == 0 and line.startswith("vdvr info:"), f"{scan}: not one line: {line}")
    for part in (str(scan), *parts):
        expect(part in line, f"{scan}: '{part}' is not in: {line}")
    return line


def input_hash(scan, *options):
    run = vdvr("info", "--json", scan, *options)
    expect(run.returncode == 0, f"{scan}: {run.stderr}")
    found = re.search(r'"sha256": "([0-9a-f]{64})"', run.stdout)
    return found and found.group(1)


# --- what is in all of them ---

def make_counts():
    out = WORK / "lines.h5"
    run = vdvr("simulate", "--phantom", "shepp-logan", "--detector", "24x6", "--angles", "30", "-o", out, "--force", "--quiet")
    expect(run.returncode == 0, run.stderr)
    with h5py.File(out) as f:
        lines, theta = f["exchange/data"][:], f["exchange/theta"][:]
    return numpy.round(100 + 40000 * numpy.exp(-lines / lines.max())).astype("u2"), theta


COUNTS, THETA = make_counts()
FLATS = numpy.full((2, *COUNTS.shape[1:]), 40100, "u2")
DARKS = numpy.full((2, *COUNTS.shape[1:]), 100, "u2")


def fresh(name):
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def exchange(path, data=None, **filters):
    """A Data Exchange file; `data(file)` writes /exchange/data, else it is written with `filters`."""
    with h5py.File(path, "w", libver=OLD) as f:
        group = f.create_group("exchange")
        if data:
            data(f)
        else:
            group.create_dataset("data", data=COUNTS, **filters)
        group["theta"] = THETA
        group["theta"].attrs["units"] = "degrees"
        group["data_white"], group["data_dark"] = FLATS, DARKS
    return path


def parts_of(frames, folder, step=FRAMES_A_FILE, dataset="entry/data", **options):
    """The frames over several files: their names in order."""
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for first in range(0, len(frames), step):
        names.append(folder / f"part_{first:04d}.h5")
        with h5py.File(names[-1], "w", libver=OLD) as f:
            f.create_dataset(dataset, data=frames[first:first + step], **options)
    return names


def virtual(names, at="exchange/data", dataset="entry/data", shape=COUNTS.shape, dtype="u2", skip=()):
    def write(f):
        layout, first = h5py.VirtualLayout(shape, dtype), 0
        for i, name in enumerate(names):
            n = min(FRAMES_A_FILE, shape[0] - first)
            if i not in skip:
                layout[first:first + n] = h5py.VirtualSource(str(name), dataset, (n, *shape[1:]), dtype)
            first += n
        f.create_virtual_dataset(at, layout)
    return write


def relative(names, to):
    return [name.relative_to(to) for name in names]


def esrf(path, names, links=True):
    """NXtomo as nxtomomill lays it out: the frames a virtual dataset over the detector's files, /entry0000/data soft links."""
    key = numpy.array([2, 2, 1, 1] + [0] * len(COUNTS), "i4")
    with h5py.File(path, "w", libver=OLD) as f:
        f.attrs["default"] = "entry0000"
        entry = f.create_group("entry0000")
        entry.attrs.update({"NX_class": "NXentry", "default": "data"})
        entry["definition"] = "NXtomo"
        for name, nx_class in (("instrument", "NXinstrument"), ("instrument/detector", "NXdetector"), ("sample", "NXsample"),
                               ("data", "NXdata"), ("instrument/beam", "NXbeam"), ("instrument/source", "NXsource")):
            entry.create_group(name).attrs["NX_class"] = nx_class
        at = "entry0000/instrument/detector/data"
        if names:
            virtual(names, at, "entry_0000/measurement/data", (len(key), *COUNTS.shape[1:]))(f)
        else:
            f[at] = all_frames()
        detector = entry["instrument/detector"]
        detector["image_key"] = detector["image_key_control"] = key
        for axis in "xy":
            detector[f"{axis}_pixel_size"] = 6.5e-6
            detector[f"{axis}_pixel_size"].attrs["units"] = "m"
        entry["sample/rotation_angle"] = numpy.concatenate([numpy.zeros(4), THETA])
        entry["sample/rotation_angle"].attrs["units"] = "degree"
        entry["data"].attrs.update({"signal": "data", "SILX_style/axis_scale_types": ["linear", "linear"]})
        for name, target in (("data", "instrument/detector/data"), ("image_key", "instrument/detector/image_key"),
                             ("rotation_angle", "sample/rotation_angle")):
            entry[f"data/{name}"] = h5py.SoftLink(f"/entry0000/{target}")
    return path


def all_frames():
    return numpy.concatenate([DARKS, FLATS, COUNTS])


def plugin_environment(filter_name):
    """Debian's plugins where they are installed, else those of hdf5plugin."""
    package = DEBIAN.get(filter_name)
    state = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status}", str(package)], capture_output=True, text=True) \
        if package and shutil.which("dpkg-query") else None
    if state and state.stdout == "installed":
        return {}
    print(f"{filter_name}: not by Debian's package, which is not installed, but by hdf5plugin")
    return {"HDF5_PLUGIN_PATH": hdf5plugin.PLUGIN_PATH}


def no_plugins():
    return {"HDF5_PLUGIN_PATH": str(fresh("no-plugins"))}


# --- whole files: the same volume ---

def whole_files():
    folder = fresh("whole")
    exchange(folder / "plain.h5")
    plain = volume_of(folder / "plain.h5")
    cases = {}

    parts = parts_of(COUNTS, folder / "raw")
    exchange(folder / "virtual.h5", virtual(relative(parts, folder)))
    exchange(folder / "external.h5", lambda f: f.__setitem__("exchange/data", h5py.ExternalLink("virtual.h5", "/exchange/data")))
    with h5py.File(folder / "all.h5", "w", libver=OLD) as f:
        f["exchange"] = h5py.ExternalLink("plain.h5", "/exchange")
    exchange(folder / "absolute.h5", virtual(parts))
    cases |= {"virtual": (), "external": (), "all": (), "absolute": ()}

    # As tomocupy's example files: everything behind one name of another file, and soft links in between.
    with h5py.File(folder / "soft.h5", "w", libver=OLD) as f:
        f["exchange"] = h5py.SoftLink("/there")
        f["there"] = h5py.ExternalLink("all.h5", "exchange")
    # A virtual dataset of virtual datasets, one of them of the same file; blocks that lie otherwise in their source.
    def nested(f):
        layout = h5py.VirtualLayout(COUNTS.shape, "u2")
        layout[:] = h5py.VirtualSource(str("virtual.h5"), "exchange/data", COUNTS.shape)
        f.create_virtual_dataset("inner", layout)
        layout = h5py.VirtualLayout(COUNTS.shape, "u2")
        layout[:, :3] = h5py.VirtualSource(".", "inner", COUNTS.shape)[:, :3]
        layout[:, 3:] = h5py.VirtualSource(".", "inner", COUNTS.shape)[:, 3:]
        f.create_virtual_dataset("exchange/data", layout)
    exchange(folder / "nested.h5", nested)
    # One frame a file, more files than stay open; two-dimensional sources; a name with a percent sign.
    singles = []
    (folder / "50%").mkdir()
    for i, frame in enumerate(COUNTS):
        for v, row in enumerate(frame):
            singles.append(folder / "50%" / f"{i}-{v}.h5")
            with h5py.File(singles[-1], "w", libver=OLD) as f:
                f["row"] = row
    def rows(f):
        layout = h5py.VirtualLayout(COUNTS.shape, "u2")
        for i in range(COUNTS.shape[0]):
            for v in range(COUNTS.shape[1]):
                layout[i, v] = h5py.VirtualSource(f"50%%/{i}-{v}.h5", "row", COUNTS.shape[2:])
        f.create_virtual_dataset("exchange/data", layout)
    exchange(folder / "rows.h5", rows)
    # Every second frame from one file, the others from another, each flat as one list of numbers.
    for k in range(2):
        with h5py.File(folder / f"half{k}.h5", "w", libver=OLD) as f:
            f["flat"] = COUNTS[k::2].reshape(-1)
    def halves(f):
        layout = h5py.VirtualLayout(COUNTS.shape, "u2")
        for k in range(2):
            layout[k::2] = h5py.VirtualSource(f"half{k}.h5", "flat", (COUNTS[k::2].size,))
        f.create_virtual_dataset("exchange/data", layout)
    exchange(folder / "halves.h5", halves)
    cases |= {"soft": (), "nested": (), "rows": (), "halves": ()}
    for name in cases:
        expect(volume_of(folder / f"{name}.h5") == plain, f"{name}: another volume than the plain file's")

    # Where the environment says that HDF5 shall look for sources is no matter.
    decoy = fresh("decoy")
    parts_of(COUNTS + 1, decoy / "raw")
    exchange(decoy / "virtual.h5", data=lambda f: f.__setitem__("exchange/data", COUNTS + 1))
    env = {"HDF5_VDS_PREFIX": str(decoy), "HDF5_EXT_PREFIX": str(decoy)}
    for name in ("virtual", "external"):
        expect(volume_of(folder / f"{name}.h5", env=env) == plain, f"{name}: files of another folder were read")

    # The folder of a scan.json: files in folders below it, and beside the HDF5 file in one of them.
    sub = folder / "sub"
    sub.mkdir()
    exchange(sub / "virtual.h5", virtual([pathlib.Path("..") / p for p in relative(parts, folder)]))
    (folder / "scan.json").write_text('{"hdf5": "sub/virtual.h5"}')
    expect(volume_of(folder) == plain, "scan.json: another volume")
    refused(sub / "virtual.h5", "outside", "part_0000.h5", "--follow-links", "h5repack --merge -l CONTI")

    tomo = fresh("esrf")
    esrf(tomo / "plain.nx", [])
    frames = parts_of(all_frames(), tomo / "raw", dataset="entry_0000/measurement/data", chunks=(1, *COUNTS.shape[1:]))
    esrf(tomo / "scan.nx", relative(frames, tomo))
    expect(volume_of(tomo / "scan.nx") == volume_of(tomo / "plain.nx") != b"", "NXtomo: another volume")

    # To the content of a certified volume.
    hashes = {}
    for name in ("plain", "virtual", "external", "nested"):
        run = vdvr("build", folder / f"{name}.h5", "--epsilon", "20%", "-o", folder / f"{name}.vdvr", "--quiet", "--force")
        expect(run.returncode == 0, run.stderr)
        run = vdvr("info", "--json", folder / f"{name}.vdvr")
        hashes[name] = json.loads(run.stdout)["certificate"]["content_sha256"]
    expect(len(set(hashes.values())) == 1, f"content hashes differ: {hashes}")
    return plain


FILTERS = {
    "lz4": ("LZ4", hdf5plugin.LZ4()), "lz4-blocks": ("LZ4", hdf5plugin.LZ4(nbytes=64)),
    "blosc": ("Blosc", hdf5plugin.Blosc()), "blosc-none": ("Blosc", hdf5plugin.Blosc(clevel=0)),
    "bitshuffle": ("bitshuffle", hdf5plugin.Bitshuffle(cname="lz4")),
    "bitshuffle-blocks": ("bitshuffle", hdf5plugin.Bitshuffle(nelems=16, cname="lz4")),
    "bitshuffle-none": ("bitshuffle", hdf5plugin.Bitshuffle(cname="none")),
    "bzip2": ("bzip2", hdf5plugin.BZip2()),
    "zstd": ("zstd", hdf5plugin.Zstd()),
}


def filters(plain):
    folder = fresh("filters")
    chunks = (7, 4, 5)  # none divides its axis
    empty = no_plugins()
    for name, (shown, options) in FILTERS.items():
        for variant, more in (("", {}), ("+shuffle+fletcher32", {"shuffle": True, "fletcher32": True})):
            path = exchange(folder / f"{name}{variant}.h5", chunks=chunks, **options, **more)
            env = empty if shown == "zstd" else plugin_environment(shown)
            expect(volume_of(path, env=env, where=path.name) == plain, f"{path.name}: another volume")
    path = exchange(folder / "lzf.h5", chunks=chunks, compression="lzf")
    if plugin_environment("LZF") == {}:
        expect(volume_of(path) == plain, "lzf: another volume")
    # In a virtual dataset's sources, as detectors write them.
    parts = parts_of(COUNTS, folder / "raw", chunks=(1, *COUNTS.shape[1:]), **hdf5plugin.Bitshuffle(cname="lz4"))
    path = exchange(folder / "virtual.h5", virtual(relative(parts, folder)))
    expect(volume_of(path, env=plugin_environment("bitshuffle")) == plain, "virtual of bitshuffle: another volume")
    # Missing plugins, simulated: the package is named.
    for name in ("lz4", "blosc", "bitshuffle", "bzip2"):
        shown = FILTERS[name][0]
        refused(folder / f"{name}.h5", shown, f"apt-get install {DEBIAN[shown]}", env=empty)
    refused(folder / "virtual.h5", "mapping 1 of", "bitshuffle (32008)", "part_0000.h5", env=empty)
    # One without a package: the remedy of the message.
    path = exchange(folder / "blosc2.h5", chunks=chunks, **hdf5plugin.Blosc2())
    line = refused(path, "Blosc2 (32026)", "HDF5_PLUGIN_PATH")
    command = re.search(r"python3 (-c '.*?')", line).group(1)
    printed = subprocess.run([sys.executable, *shlex.split(command)], capture_output=True, text=True).stdout.strip()
    expect(volume_of(path, env={"HDF5_PLUGIN_PATH": printed}) == plain, "blosc2 by hdf5plugin: another volume")


# --- broken files ---

def mended_by_h5repack(line, path, plain):
    """The command that a refusal names makes a file that is read, in another folder."""
    command = re.search(r"h5repack [^;,]*IN OUT", line).group(0)
    if not shutil.which("h5repack"):
        print("h5repack is not installed: its remedy is not tried:", command)
        return
    mended = fresh("mended") / "one.h5"
    words = [{"IN": path, "OUT": mended}.get(word, word) for word in command.split()]
    run = subprocess.run(words, capture_output=True, text=True)
    expect(run.returncode == 0 and volume_of(mended) == plain, f"{path}: {command}: {run.stderr}")


def broken_virtual(plain):
    folder = fresh("broken")
    parts = parts_of(COUNTS, folder / "raw")
    path = exchange(folder / "scan.h5", virtual(relative(parts, folder)))
    third = parts[2].read_bytes()

    parts[2].unlink()
    refused(path, "mapping 3 of 5", "raw/part_0014.h5", "is missing")
    with h5py.File(parts[2], "w", libver=OLD) as f:
        f["other"] = 1
    refused(path, "mapping 3 of 5", "part_0014.h5", "has no dataset 'entry/data'")
    with h5py.File(parts[2], "w", libver=OLD) as f:
        f["entry/data"] = COUNTS[:3]
    refused(path, "mapping 3 of 5", "part_0014.h5", "[3, 6, 24]")
    with h5py.File(parts[2], "w", libver=OLD) as f:
        f["entry/data"] = COUNTS[14:21].astype("f4")
    refused(path, "mapping 3 of 5", "a 4-byte float", "a 2-byte integer without sign")
    parts[2].write_bytes(third[:700])
    refused(path, "mapping 3 of 5", "part_0014.h5", "truncated")
    parts[2].write_bytes(b"")
    refused(path, "mapping 3 of 5", "part_0014.h5")
    parts[2].unlink()
    parts[2].mkdir()
    refused(path, "mapping 3 of 5", "part_0014.h5")
    parts[2].rmdir()
    with h5py.File(parts[2], "w", libver=OLD) as f:  # five of its seven frames were written
        data = f.create_dataset("entry/data", COUNTS[:7].shape, "u2", chunks=(1, *COUNTS.shape[1:]))
        data[:5] = COUNTS[14:19]
    refused(path, "part_0014.h5", "chunk at [5, 0, 0] was never written")
    with h5py.File(parts[2], "w", libver=OLD) as f:
        f.create_dataset("entry/data", COUNTS[:7].shape, "u2")
    refused(path, "part_0014.h5", "holds no data")
    parts[2].write_bytes(third)
    expect(vdvr("info", path).returncode == 0, "the mended scan is not read")

    exchange(folder / "gap.h5", virtual(relative(parts, folder), skip=(1,)))
    refused(folder / "gap.h5", "1008 of its 4320 elements have no source", "[7, 0, 0]")

    def circle(f):
        for name, source in (("exchange/data", "exchange/other"), ("exchange/other", "exchange/data")):
            layout = h5py.VirtualLayout(COUNTS.shape, "u2")
            layout[:] = h5py.VirtualSource(".", source, COUNTS.shape)
            f.create_virtual_dataset(name, layout)
    refused(exchange(folder / "circle.h5", circle), "circle")
    for a, b in (("ping", "pong"), ("pong", "ping")):
        with h5py.File(folder / f"{a}.h5", "w", libver=OLD) as f:
            f["exchange"] = h5py.ExternalLink(f"{b}.h5", "exchange")
    refused(folder / "ping.h5", "circle")
    def soft_circle(f):
        f["exchange/data"] = h5py.SoftLink("/exchange/data")
    refused(exchange(folder / "soft.h5", soft_circle), "circle")

    def unlimited(f):
        layout = h5py.VirtualLayout(COUNTS.shape, "u2", maxshape=(None, *COUNTS.shape[1:]))
        source = h5py.VirtualSource("growing.h5", "d", COUNTS.shape, maxshape=(None, *COUNTS.shape[1:]))
        layout[0:h5py.h5s.UNLIMITED] = source[0:h5py.h5s.UNLIMITED]
        f.create_virtual_dataset("exchange/data", layout)
    with h5py.File(folder / "growing.h5", "w", libver=OLD) as f:
        f.create_dataset("d", data=COUNTS, maxshape=(None, *COUNTS.shape[1:]))
    line = refused(exchange(folder / "unlimited.h5", unlimited), "unlimited", "h5repack --merge -l CONTI")
    mended_by_h5repack(line, folder / "unlimited.h5", plain)
    def pattern(f):
        space = h5py.h5s.create_simple(COUNTS.shape, (h5py.h5s.UNLIMITED, *COUNTS.shape[1:]))
        space.select_hyperslab((0, 0, 0), (h5py.h5s.UNLIMITED, 1, 1), (1, 1, 1), (1, *COUNTS.shape[1:]))
        creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        creation.set_virtual(space, b"frame_%b.h5", b"row", h5py.h5s.create_simple((1, *COUNTS.shape[1:])))
        h5py.h5d.create(f.id, b"exchange/data", h5py.h5t.STD_U16LE, space, creation)
    for i, frame in enumerate(COUNTS):
        with h5py.File(folder / f"frame_{i}.h5", "w", libver=OLD) as f:
            f["row"] = frame[None]
    line = refused(exchange(folder / "pattern.h5", pattern), "pattern (%b)", "h5repack --merge -l CONTI")
    mended_by_h5repack(line, folder / "pattern.h5", plain)

    exchange(folder / "dangling.h5", lambda f: f.__setitem__("exchange/data", h5py.ExternalLink("gone.h5", "/d")))
    refused(folder / "dangling.h5", "external link", "gone.h5", "is missing")
    with h5py.File(folder / "gone-group.h5", "w", libver=OLD) as f:
        f["exchange"] = h5py.ExternalLink("gone.h5", "/exchange")
    refused(folder / "gone-group.h5", "/exchange", "gone.h5", "is missing")
    def raw_storage(f):
        (folder / "frames.raw").write_bytes(COUNTS.tobytes())
        f.create_dataset("exchange/data", COUNTS.shape, "u2", external=[(str(folder / "frames.raw"), 0, COUNTS.nbytes)])
    line = refused(exchange(folder / "raw.h5", raw_storage), "external storage", "h5repack -l CONTI")
    mended_by_h5repack(line, folder / "raw.h5", plain)


def outside(plain):
    """Links that leave the folder: refused, read with --follow-links, and mended by the remedy of the message."""
    away = fresh("away")
    parts = parts_of(COUNTS, away)
    folder = fresh("outside")
    up = [pathlib.Path("..") / "away" / p.name for p in parts]
    exchange(folder / "up.h5", virtual(up))
    exchange(folder / "absolute.h5", virtual(parts))
    exchange(away / "plain.h5")
    exchange(folder / "link.h5", lambda f: f.__setitem__("exchange/data", h5py.ExternalLink("../away/plain.h5", "/exchange/data")))
    (folder / "symlink.h5").symlink_to(away / "plain.h5")
    with h5py.File(folder / "by-symlink.h5", "w", libver=OLD) as f:
        f["exchange"] = h5py.ExternalLink("symlink.h5", "exchange")
    for name in ("up", "absolute", "link", "by-symlink"):
        path = folder / f"{name}.h5"
        line = refused(path, "outside the scan's folder", "--follow-links", "h5repack --merge -l CONTI")
        expect(volume_of(path, "--follow-links") == plain, f"{name} --follow-links: another volume")
        mended_by_h5repack(line, path, plain)
    # Every command that reads scans takes it, and verify sees a change of a file out there.
    path, certified = folder / "up.h5", folder / "up.vdvr"
    tolerance = ("--epsilon", "20%")
    points = folder / "points.csv"
    points.write_text("x,y,z\n0,0,0\n")
    commands = {"info": (), "plan": tolerance,
                "probe": ("--exact", "--points", points, "-o", folder / "values.csv", "--force"), "build": (*tolerance, "-o", certified, "--force"),
                "run": (*tolerance, "-o", folder / "run", "--force"), "reconstruct": ("-o", folder / "r.mha", "--force")}
    for command, words in commands.items():
        with_links = vdvr(command, path, "--follow-links", *words)
        expect(with_links.returncode == 0, f"{command} --follow-links: {with_links.returncode} {with_links.stderr}")
        without = vdvr(command, path, *words)
        expect(without.returncode == 2 and "--follow-links" in without.stderr, f"{command}: {without.stderr}")
    run = vdvr("verify", certified, "--projections", path)
    expect(run.returncode == 2 and "--follow-links" in run.stderr, f"verify: {run.stderr}")
    seen_change(certified, path, parts[3], "--follow-links")


def seen_change(certified, scan, file, *options):
    """`verify` accepts the scan, and no longer when one count of `file` differs, nor when its bytes do."""
    run = vdvr("verify", certified, "--projections", scan, *options)
    expect(run.returncode == 0, f"verify {scan}: {run.returncode} {run.stderr}")
    before, whole = input_hash(scan, *options), file.read_bytes()
    with h5py.File(file, "r+") as f:
        f["entry/data"][-1, -1, -1] += 1
    run = vdvr("verify", certified, "--projections", scan, *options)
    expect(run.returncode == 1, f"verify after a change of {file}: {run.returncode} {run.stderr}")
    expect(input_hash(scan, *options) != before, f"the input hash does not see {file}")
    file.write_bytes(whole + b"\0")
    expect(input_hash(scan, *options) != before, f"the input hash does not see a longer {file}")
    file.write_bytes(whole)
    expect(input_hash(scan, *options) == before, "the input hash differs for the same files")


def hashes():
    folder = fresh("hashes")
    parts = parts_of(COUNTS, folder / "raw")
    path = exchange(folder / "scan.h5", virtual(relative(parts, folder)))
    run = vdvr("build", path, "--epsilon", "20%", "-o", folder / "scan.vdvr", "--quiet")
    expect(run.returncode == 0, run.stderr)
    for part in (parts[0], parts[-1]):
        seen_change(folder / "scan.vdvr", path, part)
    # The hash is of names below the folder, which may move.
    before, moved = input_hash(path), WORK / "moved"
    shutil.rmtree(moved, ignore_errors=True)
    folder.rename(moved)
    expect(input_hash(moved / "scan.h5") == before, "the input hash differs after the folder moved")
    # Of a plain file it stays the file's own.
    path = exchange(moved / "plain.h5")
    run = subprocess.run(["sha256sum", path], capture_output=True, text=True)
    expect(input_hash(path) == run.stdout.split()[0], "the input hash of a plain file is not its SHA-256")


# --- broken chunks ---

def rewrite_chunk(path, change):
    """The first chunk's stored bytes through `change`."""
    with h5py.File(path, "r+") as f:
        data = f["exchange/data"].id
        mask, stored = data.read_direct_chunk((0, 0, 0))
        data.write_direct_chunk((0, 0, 0), bytes(change(bytearray(stored))), mask)
    return path


def put(at, form, value):
    def change(stored):
        struct.pack_into(form, stored, at, value)
        return stored
    return change


def broken_chunks():
    folder = fresh("chunks")
    env = {"HDF5_PLUGIN_PATH": hdf5plugin.PLUGIN_PATH}
    huge = 1 << 31
    lies = {  # where each format states its size
        "lz4": put(0, ">Q", huge), "lz4-blocks": put(8, ">I", 1), "blosc": put(4, "<I", huge),
        "bitshuffle": put(0, ">Q", huge), "bitshuffle-blocks": put(8, ">I", 48)}
    for name, (shown, options) in FILTERS.items():
        def variant(what):
            return exchange(folder / f"{name}-{what}.h5", chunks=(5, 6, 24), **options)
        for cut, change in (("cut", lambda s: s[:len(s) // 2]), ("stub", lambda s: s[:3])):
            refused(rewrite_chunk(variant(cut), change), "/exchange/data", "chunk at [0, 0, 0]", env=env)
        if name in lies:
            refused(rewrite_chunk(variant("lie"), lies[name]), "chunk at [0, 0, 0]", env=env)
    path = exchange(folder / "bitshuffle-zstd.h5", chunks=(5, 6, 24), **hdf5plugin.Bitshuffle(cname="zstd"))
    refused(path, "bitshuffle with compression 3", env=env)
    # zstd frames by hand (RFC 8878, 3.1.1): magic, descriptor, content size, blocks.
    def frame(stated, blocks):
        return b"\x28\xb5\x2f\xfd" + b"\xe0" + struct.pack("<Q", stated) + blocks
    def block(kind, size, content, last):
        return struct.pack("<I", last | kind << 1 | size << 3)[:3] + content
    need = 5 * 6 * 24 * 2
    run_of = lambda n, last=1: block(1, n, b"\7", last)
    zstd = hdf5plugin.Zstd()
    def with_frame(name, content):
        return rewrite_chunk(exchange(folder / f"frame-{name}.h5", chunks=(5, 6, 24), **zstd), lambda _: content)
    expect(vdvr("info", with_frame("right", frame(need, run_of(need)))).returncode == 0, "a frame of a run is not read")
    refused(with_frame("bomb", frame(1 << 40, run_of(1 << 17))), "claims to unpack to 1099511627776 bytes")
    refused(with_frame("short", frame(need, run_of(need - 1))), "/exchange/data")
    refused(with_frame("long", frame(need, run_of(need, 0) + run_of(1 << 17))), "/exchange/data")
    refused(with_frame("silent", b"\x28\xb5\x2f\xfd\x00\x58" + run_of(need)), "does not state its size")
    refused(with_frame("two", frame(need, run_of(need)) * 2), "are stored")
    refused(with_frame("none", b"nothing of zstd"), "no zstd frame")
    with h5py.File(exchange(folder / "holes.h5", lambda f: f.create_dataset("exchange/data", COUNTS.shape, "u2", chunks=(1, 6, 24))),
                   "r+") as f:
        f["exchange/data"][:4] = COUNTS[:4]
    refused(folder / "holes.h5", "chunk at [4, 0, 0] was never written")
    # A filter that nobody has.
    unknown = folder / "unknown.h5"
    exchange(unknown, chunks=(5, 6, 24), **hdf5plugin.Zstd())
    content = unknown.read_bytes()
    at = content.index(struct.pack("<H", 32015))
    unknown.write_bytes(content[:at] + struct.pack("<H", 32999) + content[at + 2:])
    refused(unknown, "32999", "not installed")


# --- locks ---

def locks(plain):
    folder = fresh("locks")
    parts = parts_of(COUNTS, folder / "raw")
    paths = {"plain": exchange(folder / "plain.h5"), "virtual": exchange(folder / "virtual.h5", virtual(relative(parts, folder)))}
    for name, held in (("plain", paths["plain"]), ("virtual", parts[1])):
        with h5py.File(held, "r+", locking=True):
            refused(paths[name], "is locked", "HDF5_USE_FILE_LOCKING=FALSE", held.name)
            off = volume_of(paths[name], env={"HDF5_USE_FILE_LOCKING": "FALSE"})
            expect(off == plain, f"{name}: another volume without locks")
        expect(volume_of(paths[name]) == plain, f"{name}: another volume after the writer closed it")
    # A writer that died leaves its mark in files of the newer layout.
    crashed = folder / "crashed.h5"
    with h5py.File(crashed, "w", libver=("v110", "v110")) as f:
        f.create_group("exchange")
        f["exchange/data"], f["exchange/theta"] = COUNTS, THETA
        f["exchange/data_white"], f["exchange/data_dark"] = FLATS, DARKS
    subprocess.run([sys.executable, "-c", "import h5py, os, sys\n"
                    f"f = h5py.File({str(crashed)!r}, 'r+', libver=('v110', 'v110')); f.flush(); os._exit(0)"])
    line = refused(crashed, "h5clear -s")
    if shutil.which("h5clear"):
        command = re.search(r"h5clear -s \S+", line).group(0)
        expect(subprocess.run(command.split()).returncode == 0, command)
        expect(volume_of(crashed) == plain, "crashed.h5: another volume after h5clear")
    else:
        print("h5clear is not installed: it is not tried")



plain_volume = whole_files()
filters(plain_volume)
broken_virtual(plain_volume)
outside(plain_volume)
hashes()
broken_chunks()
locks(plain_volume)
print(f"hdf5_files: {failures} failures")
sys.exit(1 if failures else 0)
