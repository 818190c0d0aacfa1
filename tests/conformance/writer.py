"""A writer of .vdvr files for the conformance kit, from docs/file-format.md alone. Needs h5py and numpy.

Files are made sample by sample, and what V is at points is worked out in fractions from what is stored: neither the program
nor examples/verify.py has a part in it.
"""

import hashlib
import itertools
import json
from fractions import Fraction

import h5py
import numpy as np

CHAINS = {"none": {}, "deflate": {"compression": 4}, "shuffle": {"compression": 4, "shuffle": True}}
ABSENT = object()


def text(value):
    return value.encode() if isinstance(value, str) else bytes(value)


# --- hashes, without a check of what they are over ---


def content_hash(f):
    h, g = hashlib.sha256(), f["grid"].attrs
    for name, kind in (("cells", "<i8"), ("origin", "<f8"), ("spacing", "<f8")):
        h.update(np.asarray(g[name], kind).tobytes())
    h.update(text(g["unit"]))
    h.update(np.array([g["granularity"], g["rate"]], "<i8").tobytes())
    if np.any(g.get("coarsening", 0)):
        h.update(np.asarray(g["coarsening"], "<i8").tobytes())
    if "step" in f.attrs:
        h.update(np.asarray(f.attrs["step"], "<f8").tobytes())
    names = sorted(n for n in f["tiles"] if isinstance(f["tiles"].get(n), h5py.Dataset) and not n.endswith(("_offset", "_shift")))
    for name in ("base", "level", "tile", *("tiles/" + n for n in names)):
        h.update(f[name][...].tobytes())
    for table in ("offset", "shift"):
        if table in f["base"].attrs:
            h.update(np.asarray(f["base"].attrs[table], "<i8").tobytes())
        for name in names:
            if f"{name}_{table}" in f["tiles"]:
                h.update(f["tiles"][f"{name}_{table}"][...].tobytes())
    return h.hexdigest()


def seal(f):
    h = hashlib.sha256(b"vdvr seal 1\n")

    def add(part, count=None):
        h.update(np.array(len(part) if count is None else count, "<i8").tobytes() + part)

    said = f["certificate" if "certificate" in f else "comparison"]
    add(text(said[()] if said.shape == () else said[0]))
    totals = f["brick_total"][...] if "brick_total" in f else np.empty(0, "<f4")
    add(totals.tobytes(), totals.size)
    known = ("base", "brick_total", "certificate", "comparison", "grid", "level", "tile", "tiles")
    tiles = ["/tiles/" + n for n in f["tiles"] if isinstance(f["tiles"].get(n), h5py.Dataset)]
    for path in sorted(["/", *("/" + n for n in known if n in f), *tiles]):
        for name in sorted(f[path].attrs):
            if (path, name) == ("/", "seal"):
                continue
            value = f[path].attrs[name]
            add(path.encode())
            add(name.encode())
            if isinstance(value, (str, bytes)):
                h.update(b"t")
                add(text(value))
            else:
                values = np.atleast_1d(value).ravel()
                real = values.dtype.kind == "f"
                h.update(b"f" if real else b"i")
                add(values.astype("<f8" if real else "<i8").tobytes(), values.size)
    return h.hexdigest()


# --- certificates ---


def certificate(grid, totals, **more):
    """Of a scan that covers all of the grid."""
    worst = np.argwhere(totals == totals.max())[0]
    at = np.array(grid["origin"]) + worst * grid["granularity"] * np.array(grid["spacing"])
    total, arithmetic, sampler = float(totals.max()), 2.0**-10, {"buffer": 2.0**-10}
    budget = {"grid": total / 2, "gold": total / 4, "projection": 2.0**-12, "arithmetic": arithmetic}
    return {
        "epsilon": 0.5, "epsilon_abs": 64.0, "reference_range": 128.0, "sealed": True, "holds": {"buffer": True},
        "total": {"buffer": total + arithmetic + sampler["buffer"]},
        "budget": {**{name: {"value": value, "method": "made by hand"} for name, value in budget.items()},
                   "sampler": {name: {"value": value, "method": "made by hand"} for name, value in sampler.items()}},
        "measured_max": total / 2, "measured_total": total, "worst_at": at[::-1].tolist(),
        "rates": {"upsampling_u": 8, "u_filter": "six-taps", "gold": grid["rate"]}, "bounds": {},
        "field": {"filter": "ram-lak", "cutoff": 1.0, "center": 4095.5, "padding": 16384}, "window": None, "roi": None,
        "not_covered": {"count": 0, "fraction": 0.0, "rule": "made by hand"},
        "input": {"name": "none", "sha256": "0" * 64, "shape": [2, 8192, 8192], "angles": 2},
        "device": "none", "driver": "none", "version": "0.1.0",
        "options": {"granularity": grid["granularity"], "base": [1 << c for c in grid["coarsening"][::-1]], "closing": "coarse",
                    "coefficients": "sampled", "levels": "anisotropic", "storage": "auto", "terms": "all", "epsilon_of": "range",
                    "upsampling": 8, "u_filter": "six-taps", "gold": grid["rate"],
                    "geometry": {"columns": 8192, "rows": 8192, "pitch_u": 1.0, "pitch_v": 1.0,
                                 "center": 4095.5, "unit": grid["unit"], "theta_rad": [0.0, np.pi / 2]}},
        "notes": ["a file of the conformance kit: its samples are no reconstruction"], **more}


# --- files ---


def whole(place):
    """0 to 150, by the place of a sample in 64ths of a cell, so that bricks agree on what they share."""
    z, y, x = (int(i) for i in place)
    return (z * 7919 ^ y * 104729 ^ x * 1299709) % 151


class Tile:
    """Samples of a brick, or of the base, of one type: what is stored, and what that stands for."""

    def __init__(self, kind, low, shape, spread, inside, grid, number):
        """Sample (k, j, i) lies at low + (k, j, i) spread, in 64ths of a cell."""
        self.kind, top = kind, np.array(grid["cells"]) * 64
        places = [tuple(np.minimum(np.array(low) + np.array(i) * spread, top)) for i in np.ndindex(*shape)]
        numbers = np.array([whole(p) for p in places]).reshape(shape)
        face = np.zeros(shape, bool)
        for axis in range(3):
            face |= np.isin(np.arange(shape[axis]), (0, shape[axis] - 1)).reshape([-1 if a == axis else 1 for a in range(3)])
        fraction = np.where(face | (not inside), 0, numbers % 4)  # inside of a brick a quarter of the base's step
        shift, self.offset = grid.get("shift", 4), 0
        if kind == "<f4":
            self.stored = ((numbers - 100) / 8 + fraction / 32).astype("<f4") * np.float32(grid.get("scale", 1.0))
            self.values = [Fraction(float(v)) for v in self.stored.ravel()]
        else:
            self.shift = shift - 2 if kind == "<u2" and inside else shift
            lower = 100 if number % 2 and inside else 0  # another offset for every other tile
            self.offset = (-100 - lower) << shift
            self.stored = (((numbers + lower) << (shift - self.shift)) + (fraction if kind == "<u2" and inside else 0)).astype(kind)
            step = Fraction(grid["step"])
            self.values = [step * (self.offset + int(n) * 2**self.shift) for n in self.stored.ravel()]
        self.shape = shape

    def __getitem__(self, index):
        return self.values[int(np.ravel_multi_index(tuple(int(i) for i in index), self.shape))]


class File:
    """A volume whose bricks have the levels and types that two functions say."""

    def __init__(self, level, kind=lambda brick: "<f4", base="<f4", **grid):
        self.grid = {"cells": [8, 8, 8], "origin": [-4.0, -4.0, -4.0], "spacing": [1.0, 1.0, 1.0], "unit": "mm", "granularity": 4,
                     "rate": 8, "coarsening": [0, 0, 0], **grid}
        cells, g, self.c = np.array(self.grid["cells"]), self.grid["granularity"], np.array(self.grid["coarsening"])
        self.bricks = -(-cells // g)
        self.base = Tile(base, (0, 0, 0), tuple((cells >> self.c) + 1), 64 << self.c, False, self.grid, 0)
        self.levels, self.tiles, self.datasets = {}, {}, {}
        for brick in np.ndindex(*self.bricks):
            self.levels[brick] = tuple(level(brick))
        for brick in reversed(list(self.levels)):  # numbers against the order of bricks: only /tile says whose a tile is
            triple = self.levels[brick]
            if any(triple):
                shape = tuple((g * 2.0 ** (np.array(triple) - self.c)).astype(int) + 1)
                spread = (64 * 2.0 ** (self.c - np.array(triple))).astype(int)
                kinds = self.datasets.setdefault(triple, {})
                tiles = kinds.setdefault(kind(brick), [])
                tile = Tile(kind(brick), np.array(brick) * g * 64, shape, spread, True, self.grid, len(tiles))
                tiles.append((brick, tile))
                self.tiles[brick] = tile

    def at(self, point):
        """V, exactly, at a point z, y, x."""
        grid = self.grid
        cell = [(Fraction(p) - Fraction(o)) / Fraction(s) for p, o, s in zip(point, grid["origin"], grid["spacing"])]
        brick = tuple(min(int(c // grid["granularity"]), int(b) - 1) for c, b in zip(cell, self.bricks))
        tile, level, first = self.tiles.get(brick, self.base), self.levels[brick], [b * grid["granularity"] for b in brick]
        first = first if any(level) else [0, 0, 0]
        place = [(c - f) * Fraction(2) ** int(l - k) for c, f, l, k in zip(cell, first, level, self.c)]
        low = [min(int(p), n - 2) for p, n in zip(place, tile.shape)]
        total = Fraction(0)
        for corner in itertools.product((0, 1), repeat=3):
            weight = Fraction(1)
            for p, l, one in zip(place, low, corner):
                weight *= p - l if one else 1 - (p - l)
            total += weight * tile[[l + one for l, one in zip(low, corner)]] if weight else 0
        return total

    def points(self):
        """The corners, points of faces and of edges, and in every level."""
        rng, cells = np.random.default_rng(5), np.array(self.grid["cells"])
        places = [np.zeros(3), cells, cells / 2, cells * [0, 1, 0], cells * [1, 0, 1]]
        g = self.grid["granularity"]
        for triple in sorted(set(self.levels.values())):
            mine = [b for b, l in self.levels.items() if l == triple]
            for brick in [mine[0], mine[-1]] + [mine[i] for i in rng.integers(len(mine), size=2)]:
                size = np.minimum(g, cells - np.array(brick) * g)
                within = rng.integers(0, 257, size=3) / 256
                places.append(np.array(brick) * g + within * size)
                within[rng.integers(3)] = 0  # on a face, an edge where 0 stands already
                places.append(np.array(brick) * g + within * size)
        return np.array(places) * self.grid["spacing"] + self.grid["origin"]

    def tolerance(self):
        """What fp32 may err: docs/error-bounds.md, section 8, with the coordinates' part by the largest difference per cell."""
        tiles = [self.base, *self.tiles.values()]
        most = max(abs(float(v)) for tile in tiles for v in tile.values)
        steps = 0.0
        for tile, level in [(self.base, (0, 0, 0)), *((t, self.levels[b]) for b, t in self.tiles.items())]:
            values = np.array([float(v) for v in tile.values]).reshape(tile.shape)
            for axis in range(3):
                slope = np.abs(np.diff(values, axis=axis)).max(initial=0) * 2.0 ** (level[axis] - self.c[axis])
                steps = max(steps, slope * self.grid["cells"][axis])
        u = 2.0**-24
        return 14 * u * most + 3 * 2 * u * steps + 16 * 2.0**-149

    def write(self, path, chain="shuffle", version=None, variable=False, **more):
        grid, integers = self.grid, self.grid.get("step") is not None
        several = any(len(kinds) > 1 for kinds in self.datasets.values())
        least = 4 if any(grid["coarsening"]) else 3 if several else 2 if integers else 1
        as_text = (lambda s: s) if variable else (lambda s: np.bytes_(s.encode()))
        options = {"fletcher32": True, **CHAINS[chain]}
        with h5py.File(path, "w", libver=("v110", "v110")) as f:
            def put(name, values):
                values = np.ascontiguousarray(values)
                kept = {k: v for k, v in options.items() if k != "shuffle" or values.itemsize > 1}
                return f.create_dataset(name, data=values, chunks=values.shape, **kept)

            f.attrs["format"], f.attrs["generator"] = as_text("vdvr"), as_text("the conformance kit")
            f.attrs["format_version"] = np.int64(version or least)
            g = f.create_group("grid").attrs
            for name in ("cells", "granularity", "rate"):
                g[name] = np.array(grid[name], np.int64)
            g["origin"], g["spacing"], g["unit"] = np.array(grid["origin"]), np.array(grid["spacing"]), as_text(grid["unit"])
            if any(grid["coarsening"]) or version == 4:
                g["coarsening"] = np.array(grid["coarsening"], np.int64)
            base = put("base", self.base.stored)
            if integers:
                f.attrs["step"] = float(grid["step"])
            if self.base.kind != "<f4":
                base.attrs["offset"], base.attrs["shift"] = np.int64(self.base.offset), np.int64(self.base.shift)
            put("level", np.array([self.levels[b] for b in np.ndindex(*self.bricks)], "u1").reshape(*self.bricks, 3))
            numbers = np.zeros(self.bricks, "<u4")
            f.create_group("tiles")
            for triple, kinds in self.datasets.items():
                first = 0
                for part, kind in enumerate(sorted(kinds, key=lambda k: ("|u1", "<u2", "<f4").index(k))):
                    name = "tiles/" + "".join(map(str, triple)) + (f"_{part}" if part else "")
                    put(name, np.array([tile.stored for _, tile in kinds[kind]]))
                    if kind != "<f4":
                        put(name + "_offset", np.array([tile.offset for _, tile in kinds[kind]], "<i4"))
                        put(name + "_shift", np.array([tile.shift for _, tile in kinds[kind]], "u1"))
                    for i, (brick, _) in enumerate(kinds[kind]):
                        numbers[brick] = first + i
                    first += len(kinds[kind])
            put("tile", numbers)
            totals = (np.arange(numbers.size, dtype="<f4").reshape(self.bricks) % 7 + 1) / 4
            if more.pop("brick_total", True):
                put("brick_total", totals)
            finish(f, certificate(grid, totals, **more), variable)


def finish(f, said, variable=False):
    """Writes the certificate with the hash of what the file holds, and the seal."""
    said = {**said, "content_sha256": content_hash(f)}
    said = {name: value for name, value in said.items() if value is not ABSENT}
    name = "comparison" if said.pop("in_comparison", False) else "certificate"
    if name in f:
        del f[name]
    written = json.dumps(said)
    if variable:
        f[name] = written
    elif len(written) > 60000:
        f.create_dataset(name, data=np.array([np.bytes_(written)]), chunks=(1,), fletcher32=True)
    else:
        f.create_dataset(name, data=np.bytes_(written))
    if said.get("sealed"):
        f.attrs["seal"] = np.bytes_(seal(f))
    elif "seal" in f.attrs:
        del f.attrs["seal"]
