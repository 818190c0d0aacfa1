"""Makes the conformance kit anew, into files/: make.py VDVR [--keep-built]. README.md says what it holds. Needs h5py and numpy.

With --keep-built the files that `vdvr build` made stay, since another processor may round their samples otherwise.
"""

import json
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import h5py
import numpy as np
from writer import ABSENT, File, finish

sys.dont_write_bytecode = True  # examples/ is installed as it is
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))
import verify  # noqa: E402

HERE = Path(__file__).resolve().parent / "files"
INTEGERS = {"base": "|u1", "step": 2.0**-7}


def mixed(brick):
    return brick[0] % 2, brick[1] % 3, (brick[2] + brick[0]) % 3


def by_turns(*kinds):
    return lambda brick: kinds[sum(brick) % len(kinds)]


# --- files that a reader opens ---

GOOD = {
    "base-alone": ("no brick has tiles, and there is no /tiles/ZYX", File(lambda b: (0, 0, 0)), {}),
    "one-brick": ("one brick, one cell: the last brick is closed", File(lambda b: (0, 0, 0), cells=[1, 1, 1], granularity=1), {}),
    "levels": ("float32, levels 0 to 2 along each axis by itself, hanging nodes on every face", File(mixed), {}),
    "finest": ("level 6 along an axis, rate 64", File(lambda b: (0, 0, 6) if b == (0, 0, 1) else (0, 0, 0), granularity=2,
                                                      rate=64, cells=[4, 4, 4]), {}),
    "cut-bricks": ("cells that the granularity does not divide: tiles reach beyond the grid",
                   File(mixed, cells=[5, 7, 9], origin=[0.0, 0.0, 0.0]), {}),
    "granularity-1": ("bricks of one cell", File(mixed, cells=[3, 4, 3], granularity=1), {}),
    "granularity-2": ("bricks of 2 cells", File(mixed, cells=[4, 6, 5], granularity=2), {}),
    "granularity-8": ("bricks of 8 cells", File(lambda b: (0, 1, 0), cells=[8, 8, 9], granularity=8), {}),
    "spacing": ("another spacing and origin along each axis, far from 0",
                File(mixed, spacing=[0.25, 2.0, 0.0078125], origin=[1000.0, -5.0, 64.5]), {}),
    "bytes": ("uint8, offsets of two kinds", File(mixed, by_turns("|u1"), **INTEGERS), {}),
    "words": ("uint16 tiles over a uint8 base: finer steps than the base's", File(mixed, by_turns("<u2"), **INTEGERS), {}),
    "word-base": ("uint16 base and tiles", File(mixed, by_turns("<u2"), base="<u2", step=2.0**-7), {}),
    "two-types": ("ZYX and ZYX_1: uint8 and float32 tiles of a triple",
                  File(lambda b: (b[0] % 2, 1, 1), by_turns("|u1", "<f4"), cells=[8, 8, 12], **INTEGERS), {}),
    "three-types": ("ZYX, ZYX_1 and ZYX_2: uint8, uint16 and float32 tiles of a triple",
                    File(lambda b: (1, 1, 0), by_turns("<f4", "|u1", "<u2"), cells=[8, 8, 12], **INTEGERS), {}),
    "least-step": ("the least step, 2^-126", File(mixed, by_turns("|u1"), base="|u1", step=2.0**-126, shift=16), {}),
    "largest-step": ("a step of 2^100, shifts of 16", File(mixed, by_turns("|u1"), base="|u1", step=2.0**100, shift=16), {}),
    "coarse-base": ("base samples every 2 x 4 x 1 cells (x, y, z): format_version 4",
                    File(lambda b: (0, b[1] % 4, b[2] % 3), cells=[8, 16, 8], coarsening=[0, 2, 1]), {}),
    "coarse-integers": ("a coarse base of integers, tiles of two types",
                        File(lambda b: (b[0] % 3, 1, 2), by_turns("|u1", "<u2"), cells=[8, 8, 8], coarsening=[1, 1, 1],
                             **INTEGERS), {}),
    "uncompressed": ("Fletcher32 alone", File(mixed), {"chain": "none"}),
    "deflate": ("deflate and Fletcher32, without shuffle", File(mixed), {"chain": "deflate"}),
    "variable-text": ("texts of variable length, as h5py writes them", File(mixed), {"variable": True}),
    "later-version": ("format_version 3 with contents that version 1 has", File(mixed), {"version": 3}),
    "not-coarse": ("format_version 4 with a coarsening of 0", File(mixed), {"version": 4}),
    "long-unit": ("a unit of 255 bytes of UTF-8", File(mixed, unit="\u00b5" * 127 + "m"), {}),
    "long-certificate": ("a certificate above 60,000 bytes, which is a dataset of one element",
                         File(mixed), {"notes": ["a long note " * 6000]}),
    "unsealed": ("no seal, as files of earlier programs have none", File(mixed), {"sealed": ABSENT}),
    "no-brick-totals": ("unsealed, without /brick_total", File(mixed), {"sealed": ABSENT, "brick_total": False}),
}

# Of `vdvr build`: what a certificate may say. Scans of `vdvr simulate`.
PARALLEL, CONE = "--detector 17x7 --angles 16", "--detector 15x5 --angles 16 --cone 60,120 --pitch 2"
BUILT = {
    "built": ("a certified volume of parallel beam", PARALLEL, "--epsilon 12%"),
    "built-window": ("only where the field meets a window", PARALLEL, "--epsilon 12% --window 0.1,0.4"),
    "built-roi": ("only a box", PARALLEL, "--epsilon 12% --roi=-3,-3,-2,4,3,2"),
    "built-sigma": ("with noise, and sigma by brick", PARALLEL + " --photons 5000", "--epsilon 3sigma"),
    "built-cone": ("a certified volume of cone beam", CONE, "--epsilon 30% --gold 4"),
    "built-comparison": ("a volume for comparison: /comparison in the place of /certificate", PARALLEL, "--epsilon 12% --paper"),
}


# --- files that a reader refuses, a rule each: made of `words` and `two-types` by an edit, hashed and sealed again ---


def attribute(path, name, value):
    def edit(f):
        f[path].attrs[name] = value
    return edit


def replaced(path, change):
    """The dataset of another shape or type."""
    def edit(f):
        values, attributes = np.ascontiguousarray(change(f[path][...])), dict(f[path].attrs)
        del f[path]
        data = f.create_dataset(path, data=values, chunks=values.shape or None, fletcher32=True)
        for name, value in attributes.items():
            data.attrs[name] = value
    return edit


def element(path, index, value):
    def edit(f):
        f[path][index] = value(f[path][index]) if callable(value) else value
    return edit


def said(change):
    """Another certificate."""
    def edit(f):
        value = json.loads(f["certificate"][()])
        change(value)
        finish(f, value)
    return edit


def in_turn(*edits):
    return lambda f: [edit(f) for edit in edits]


def remove(*paths):
    return lambda f: [f.__delitem__(path) for path in paths]


def moved(f):
    """Two bricks with one tile, and a tile without a brick."""
    levels, tiles = f["level"][...], f["tile"][...]
    triple = next(t for t in np.unique(levels.reshape(-1, 3), axis=0) if t.any() and (levels == t).all(axis=3).sum() > 1)
    one, other = np.argwhere((levels == triple).all(axis=3))[:2]
    tiles[tuple(one)] = tiles[tuple(other)]
    f["tile"][...] = tiles


def soft_link(f):
    f.move("level", "elsewhere")
    f["level"] = h5py.SoftLink("/elsewhere")


def external_link(f):
    del f["level"]
    f["level"] = h5py.ExternalLink("levels.vdvr", "/level")


def unallocated(f):
    values = f["tile"][...]
    del f["tile"]
    f.create_dataset("tile", shape=values.shape, dtype="<u4", chunks=(1, *values.shape[1:]), fletcher32=True)[0] = values[0]


def other_filter(f):
    values = f["base"][...]
    attributes = dict(f["base"].attrs)
    del f["base"]
    f.create_dataset("base", data=values, chunks=values.shape, compression="lzf", fletcher32=True).attrs.update(attributes)


def no_checksum(f):
    values = f["tile"][...]
    del f["tile"]
    f.create_dataset("tile", data=values, chunks=values.shape, compression=4)


def set_in(name, value):
    return lambda members: members.__setitem__(name, value)


def as_note(c):
    c["notes"] = [float("nan")]


W = "words"
BROKEN = {
    "no-format": ("the attribute format is not vdvr", W, attribute("/", "format", np.bytes_(b"other"))),
    "version-5": ("a format_version above 4", W, attribute("/", "format_version", np.int64(5))),
    "version-0": ("a format_version below 1", W, attribute("/", "format_version", np.int64(0))),
    "version-4-alone": ("version 4 has coarsening", W, attribute("/", "format_version", np.int64(4))),
    "version-3-coarse": ("a coarse base needs format_version 4", "coarse-base", attribute("/", "format_version", np.int64(3))),
    "granularity-3": ("the granularity is 1, 2, 4 or 8", W, attribute("grid", "granularity", np.int64(3))),
    "rate-3": ("the rate is a power of two", W, attribute("grid", "rate", np.int64(3))),
    "rate-128": ("the rate is at most 64", W, attribute("grid", "rate", np.int64(128))),
    "rate-below-level": ("no level above the logarithm of the rate", W, attribute("grid", "rate", np.int64(2))),
    "no-cells": ("cells are positive", W, attribute("grid", "cells", np.array([0, 8, 8]))),
    "too-many-cells": ("at most 2^24 cells along an axis", W, attribute("grid", "cells", np.array([8, 8, 2**24 + 1]))),
    "plane-too-large": ("less than 2^32 samples in a plane", W, attribute("grid", "cells", np.array([8, 2**16, 2**16]))),
    "spacing-0": ("the spacing is positive", W, attribute("grid", "spacing", np.array([1.0, 0.0, 1.0]))),
    "origin-nan": ("the origin is finite", W, attribute("grid", "origin", np.array([0.0, np.nan, 0.0]))),
    "coarsening-granularity": ("2^c divides the granularity", "coarse-base", attribute("grid", "coarsening", np.array([0, 3, 1]))),
    "coarsening-cells": ("2^c divides the cells", W, in_turn(attribute("grid", "coarsening", np.array([0, 0, 2])),
                                                             attribute("grid", "cells", np.array([8, 8, 6])),
                                                             attribute("/", "format_version", np.int64(4)))),
    "unit-too-long": ("the unit has at most 255 bytes", W, attribute("grid", "unit", np.bytes_(b"m" * 256))),
    "unit-latin": ("the unit is UTF-8", W, attribute("grid", "unit", np.bytes_(b"\xb5m"))),
    "base-shape": ("the base has cells / 2^c + 1 samples an axis", W, replaced("base", lambda a: a[:, :-1])),
    "base-type": ("samples are float32, uint16 or uint8", "levels", replaced("base", lambda a: a.astype("<f8"))),
    "level-shape": ("a level for each brick and axis", W, replaced("level", lambda a: a[..., :2])),
    "level-type": ("levels are uint8", W, replaced("level", lambda a: a.astype("<i4"))),
    "tile-shape": ("a tile for each brick", W, replaced("tile", lambda a: a[:-1])),
    "tiles-shape": ("a tile has g 2^(l-c) + 1 samples an axis", W, replaced("tiles/011", lambda a: a[..., :-1])),
    "tile-twice": ("a tile belongs to one brick", "granularity-1", moved),
    "tile-beyond": ("a tile's number is below their count", W, element("tile", (0, 1, 0), 100)),
    "tile-of-base": ("a brick of level 0,0,0 has tile 0", W, element("tile", (0, 0, 0), 1)),
    "tile-unused": ("a tile belongs to a brick", W, in_turn(*(replaced(f"tiles/011{end}", lambda a: np.concatenate([a, a]))
                                                             for end in ("", "_offset", "_shift")))),
    "level-without-tiles": ("a brick's triple has tiles", W, remove("tiles/011", "tiles/011_offset", "tiles/011_shift")),
    "triple-empty": ("a triple without tiles is absent", "levels", lambda f: f.create_dataset(
        "tiles/222", shape=(0, 17, 17, 17), dtype="<f4", chunks=(1, 17, 17, 17), maxshape=(None, 17, 17, 17), fletcher32=True)),
    "triple-000": ("level 0,0,0 has no tiles", "levels", lambda f: f.create_dataset(
        "tiles/000", data=np.zeros((1, 5, 5, 5), "<f4"), chunks=(1, 5, 5, 5), fletcher32=True)),
    "unknown-name": ("no unknown names under /tiles", W, lambda f: f.create_dataset(
        "tiles/other", data=np.zeros(3, "<f4"), chunks=(3,), fletcher32=True)),
    "type-twice": ("each dataset of a triple has another type", "two-types", in_turn(
        replaced("tiles/011", lambda a: a.astype("<f4")), remove("tiles/011_offset", "tiles/011_shift"))),
    "second-type-alone": ("ZYX comes before ZYX_1", W, lambda f: [f.move(f"tiles/011{e}", f"tiles/011_1{e}")
                                                                 for e in ("", "_offset", "_shift")]),
    "sample-nan": ("samples are finite", "levels", element("tiles/011", (0, 1, 1, 1), np.nan)),
    "base-infinite": ("base samples are finite", "levels", element("base", (1, 1, 1), np.inf)),
    "step-missing": ("integers need a step", W, lambda f: f.attrs.__delitem__("step")),
    "step-of-floats": ("a step goes with integers", "levels", attribute("/", "step", 0.5)),
    "step-3": ("the step is a power of two", W, attribute("/", "step", 3.0)),
    "step-too-small": ("the step is at least 2^-126", W, attribute("/", "step", 2.0**-127)),
    "step-too-large": ("the step is at most 2^103", W, attribute("/", "step", 2.0**104)),
    "shift-25": ("a shift is at most 24", W, in_turn(element("tiles/011_shift", 0, 25), element("tiles/011_offset", 0, 0))),
    "offset-off-lattice": ("an offset is a multiple of 2^shift", W, element("tiles/011_offset", 0, lambda o: o + 1)),
    "sample-too-large": ("|o + n 2^s| is below 2^24", W, element("tiles/011_offset", 0, 2**24 - 4)),
    "offset-missing": ("integer tiles have offsets", W, remove("tiles/011_offset")),
    "offset-of-floats": ("float tiles have no offsets", "levels", lambda f: f.create_dataset(
        "tiles/011_offset", data=np.zeros(len(f["tiles/011"]), "<i4"), chunks=True, fletcher32=True)),
    "no-certificate": ("a certificate or a comparison", W, remove("certificate")),
    "two-certificates": ("not both a certificate and a comparison", W, lambda f: f.__setitem__("comparison", "{}")),
    "certificate-text": ("the certificate is JSON", W, in_turn(remove("certificate"), lambda f: f.create_dataset(
        "certificate", data=np.bytes_(b"{\"epsilon\": ")))),
    "certificate-nan": ("NaN never occurs in the certificate", W, said(as_note)),
    "certificate-member": ("the certificate has its members", W, said(lambda c: c.pop("measured_total"))),
    "brick-total-shape": ("a total for each brick", W, replaced("brick_total", lambda a: a[:-1])),
    "brick-total-above": ("no brick's total is above measured_total", W, element("brick_total", (0, 0, 0), 99)),
    "sigma-zero": ("sigma is positive", "built-sigma", element("brick_sigma", (1, 1, 1), 0)),
    "sigma-missing": ("a certificate with noise has /brick_sigma", "built-sigma", remove("brick_sigma")),
    "soft-link": ("no soft links", W, soft_link),
    "external-link": ("no external links", W, external_link),
    "other-filter": ("no other filters", "levels", other_filter),
    "no-checksum": ("arrays have Fletcher32", W, no_checksum),
    "chunk-unallocated": ("chunks are allocated", W, unallocated),
}


# --- below HDF5: bytes of a chunk ---


def fletcher32(data):
    """HDF5's: sums of 16-bit words, the first byte high, modulo 65535."""
    words = np.frombuffer(data + b"\0" * (len(data) % 2), ">u2").tolist()
    a = b = 0
    for word in words:
        a = (a + word) % 65535 or (65535 if a + word else 0)
        b = (b + a) % 65535 or (65535 if b + a else 0)
    return struct.pack("<I", (b << 16) | a)


def stream(change):
    """The deflated bytes of /level's one chunk, changed, with a checksum that is right."""
    def edit(f):
        data = f["level"]
        values = data[...]
        del f["level"]
        data = f.create_dataset("level", shape=values.shape, dtype="u1", chunks=values.shape, compression=4, fletcher32=True)
        packed = change(values.tobytes())
        data.id.write_direct_chunk((0,) * 4, packed + fletcher32(packed))
    return edit


def mask(f):
    """The chunk was left out of deflate."""
    values = f["level"][...]
    del f["level"]
    data = f.create_dataset("level", shape=values.shape, dtype="u1", chunks=values.shape, compression=4, fletcher32=True)
    data.id.write_direct_chunk((0,) * 4, values.tobytes() + fletcher32(values.tobytes()), filter_mask=1)


BYTES = {
    "chunk-short": ("a chunk inflates to its size: too little", stream(lambda raw: zlib.compress(raw[:-1], 4))),
    "chunk-long": ("a chunk inflates to its size: too much", stream(lambda raw: zlib.compress(raw + b"\0", 4))),
    "chunk-cut": ("a chunk's stream ends", stream(lambda raw: zlib.compress(raw, 4)[:-6])),
    "chunk-tail": ("nothing follows a chunk's stream", stream(lambda raw: zlib.compress(raw, 4) + b"tail")),
    "chunk-skips-filter": ("no chunk is left out of a filter", mask),
}


def flip(path):
    """A bit of a stored chunk of /level."""
    with h5py.File(path, "r") as f:
        at = f["level"].id.get_chunk_info(0).byte_offset
    data = bytearray(path.read_bytes())
    data[at + 4] ^= 8
    path.write_bytes(bytes(data))


def cut(path):
    path.write_bytes(path.read_bytes()[:-200])


# --- files that were altered: exit status 1 ---

ALTERED = {
    "altered-sample": ("the content hash is that of the samples", element("base", (2, 2, 2), lambda v: v + 1)),
    "altered-spacing": ("the content hash covers the grid", attribute("grid", "spacing", np.array([1.0, 1.0, 1.5]))),
    "altered-generator": ("the seal covers attributes", attribute("/", "generator", np.bytes_(b"another"))),
    "altered-totals": ("the seal covers /brick_total", element("brick_total", (0, 0, 0), lambda v: v / 2)),
    "altered-certificate": ("the seal covers the text of the certificate", lambda f: rewrite(f, lambda text: text + b" ")),
    "altered-sigma": ("brick_sigma_sha256 is that of /brick_sigma", element("brick_sigma", (1, 1, 1), lambda v: v / 2)),
    "epsilon-contradicts": ("epsilon_abs is epsilon of reference_range", said(set_in("epsilon", 0.9))),
    "total-contradicts": ("a total is the sum of its terms", said(lambda c: set_in("buffer", 0.01)(c["total"]))),
    "holds-contradicts": ("holds says whether the total is within epsilon_abs", said(lambda c: set_in("buffer", False)(c["holds"]))),
    "seal-missing": ("a certificate that says sealed has a seal", lambda f: f.attrs.__delitem__("seal")),
    "seal-unclaimed": ("a file with a seal has a certificate that says so", lambda f: rewrite(
        f, lambda text: text.replace(b'"sealed": true', b'"sealed":false'))),
}


def rewrite(f, change):
    value = change(f["certificate"][()])
    del f["certificate"]
    f.create_dataset("certificate", data=np.bytes_(value))


def reseal(f):
    """Hash and seal of what an edit left, so that only the broken rule can be the reason."""
    if isinstance(f.get("certificate"), h5py.Dataset):
        try:
            value = json.loads(f["certificate"][()])
            finish(f, value)
        except (ValueError, KeyError, OSError):
            pass


def values_of(path):
    """V at points of a built file, by the reader of examples/verify.py: within its cylinder, or its box."""
    v = verify.Volume(path)
    rng, c = np.random.default_rng(6), v.certificate
    low, high = np.full(3, -0.6), np.full(3, 0.6)
    low, high = low * v.cells * v.spacing / 2, high * v.cells * v.spacing / 2
    if c.get("roi"):
        low, high = np.reshape(c["roi"], (2, 3))[:, ::-1]
    points = np.round((low + rng.random((24, 3)) * (high - low)) * 256) / 256
    u, largest = 2.0**-24, max(float(np.abs(a).max()) for a in v.tiles.values())
    slope = max(float(np.abs(np.diff(a, axis=i + 1)).max(initial=0)) * 2.0 ** (level[i] - v.coarsening[i]) * v.cells[i]
                for level, a in v.tiles.items() for i in range(3))
    values = [[*(float(x) for x in p[::-1]), float(f)] for p, f in zip(points, v.at(points))]
    return {"tolerance": 14 * u * largest + 6 * u * slope + 16 * 2.0**-149, "values": values}


def program(vdvr, *words):
    return subprocess.run([vdvr, *map(str, words)], capture_output=True, text=True, check=False)


def built(vdvr, name, scan, build, folder):
    projections = folder / ("scan" if "--cone" in scan else "scan.h5")
    program(vdvr, "simulate", "--phantom", "shepp-logan", *scan.split(), "-o", projections, "--force")
    done = program(vdvr, "build", projections, *build.split(), "-o", HERE / f"{name}.vdvr", "--force", "--quiet")
    assert (HERE / f"{name}.vdvr").exists(), done.stderr


def main():
    vdvr = sys.argv[1]
    HERE.mkdir(exist_ok=True)
    for path in HERE.glob("*.vdvr"):
        if not ("--keep-built" in sys.argv and path.stem in BUILT):
            path.unlink()
    kit = {"opens": {}, "refused": {}, "altered": {}}
    for name, (feature, file, options) in GOOD.items():
        file.write(HERE / f"{name}.vdvr", **options)
        values = [[*(float(x) for x in p[::-1]), float(file.at(p))] for p in file.points()]
        kit["opens"][name] = {"feature": feature, "tolerance": file.tolerance(), "values": values}
    with tempfile.TemporaryDirectory() as folder:
        for name, (feature, scan, build) in BUILT.items():
            if not (HERE / f"{name}.vdvr").exists():
                built(vdvr, name, scan, build, Path(folder))
            kit["opens"][name] = {"feature": feature, "command": [scan, build], **values_of(HERE / f"{name}.vdvr")}
    for kind, table in (("refused", BROKEN), ("refused", {n: (r, "uncompressed", e) for n, (r, e) in BYTES.items()}),
                        ("altered", {n: (r, "built-sigma" if n == "altered-sigma" else W, e) for n, (r, e) in ALTERED.items()})):
        for name, (rule, original, edit) in table.items():
            path = HERE / f"{name}.vdvr"
            shutil.copy(HERE / f"{original}.vdvr", path)
            with h5py.File(path, "a", libver=("v110", "v110")) as f:
                edit(f)
                if kind == "refused" and table is BROKEN:
                    reseal(f)
            kit[kind][name] = {"rule": rule, **({"below_hdf5": True} if table is not BROKEN and kind == "refused" else {})}
    for name, rule, edit in (("bit-flipped", "a chunk's bytes match their Fletcher32", flip), ("cut-off", "the file is whole", cut)):
        shutil.copy(HERE / "levels.vdvr", HERE / f"{name}.vdvr")
        edit(HERE / f"{name}.vdvr")
        kit["refused"][name] = {"rule": rule}
    lines = [f' "{kind}": {{\n' + ",\n".join(f'  "{name}": {json.dumps(told)}' for name, told in table.items()) + "\n }"
             for kind, table in kit.items()]
    (HERE.parent / "kit.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
