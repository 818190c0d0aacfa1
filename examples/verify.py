"""Holds a certified volume to its scan, and shares nothing with the program that made it.

    verify.py FILE.vdvr SCAN [--points N] [--seed S]

Needs numpy and h5py. Written from docs/file-format.md, docs/geometry.md and docs/inputs.md: F by its definition (ramp
filter, cosine series between the pixels, sum over the views), V by its own (trilinear between a brick's samples), both
in double precision, compared in every brick, half of the points where the file is worst. Points can refute a bound and
cannot prove it. Exit status: 0 nothing speaks against the certificate; 1 it is wrong, or was altered; 2 file or scan
cannot be read, or ask for what is not done here: it says what.
"""
import argparse, hashlib, json, re, sys  # noqa: E401
from pathlib import Path
import h5py
import numpy as np

TABLES = {"offset": "<i4", "shift": "|u1"}  # of integer tiles: datasets ZYX_offset and ZYX_shift

class Refused(Exception):
    """A file, a scan or a field that is not known here: exit status 2."""

def need(condition, message):
    if not condition:
        raise Refused(message)

def text(value):
    return value.encode() if isinstance(value, str) else bytes(value)

def digest(*parts):
    return hashlib.sha256(b"".join(part if isinstance(part, bytes) else part.tobytes() for part in parts)).hexdigest()

def lattice(shape):
    return np.indices(tuple(shape)).reshape(len(shape), -1).T

# --- V: docs/file-format.md ---
class Volume:
    """A .vdvr file, whole in memory. Axes are z, y, x, as in the file."""
    def __init__(self, name):
        try:
            self.file = h5py.File(name, "r")
            self._check_objects(self.file)
            self._read_grid()
            self._read_index()
            self._read_certificate()
        except (OSError, KeyError, ValueError, RuntimeError, TypeError, AttributeError, Refused) as error:
            raise Refused(f"{name}: {error}") from None

    def _check_objects(self, group):
        for name in group:
            need(isinstance(group.get(name, getlink=True), h5py.HardLink), f"{group.name}/{name} is a link")
            item = group[name]
            if isinstance(item, h5py.Group):
                self._check_objects(item)
            elif item.shape:
                plist, n = item.id.get_create_plist(), item.id.get_num_chunks()
                chain = [plist.get_filter(i)[0] for i in range(plist.get_nfilters())]  # 2 shuffle, 1 deflate, 3 Fletcher32
                need(chain in ([3], [1, 3], [2, 1, 3]), f"{item.name}: the chain of filters {chain} is not known")
                need(n == np.prod(-(-np.array(item.shape) // item.chunks)), f"{item.name}: chunks are missing")
                need(not any(item.id.get_chunk_info(i).filter_mask for i in range(n)), f"{item.name}: a chunk skips a filter")

    def _read_grid(self):
        root, grid = self.file.attrs, self.file["grid"].attrs
        self.version = int(root["format_version"])
        need(text(root["format"]) == b"vdvr" and 1 <= self.version <= 4, f"no vdvr, or of version {self.version}")
        self.cells = np.array(grid["cells"], int)
        self.coarsening = np.array(grid["coarsening"] if self.version == 4 else (0, 0, 0), int)
        self.origin, self.spacing = (np.array(grid[a], float) for a in ("origin", "spacing"))
        self.g, self.rate, self.unit = int(grid["granularity"]), int(grid["rate"]), text(grid["unit"])
        n, c = self.cells, self.coarsening
        need(all(a.shape == (3,) for a in (n, c, self.origin, self.spacing)), "/grid: three numbers an axis")
        need(self.g in (1, 2, 4, 8) and self.rate in (1, 2, 4, 8, 16, 32, 64), f"granularity {self.g}, rate {self.rate}")
        need((n > 0).all() and (n <= 1 << 24).all() and (n[1] + 1) * (n[2] + 1) < 1 << 32, f"cells {n} out of range")
        need(np.isfinite(self.origin + self.spacing).all() and (self.spacing > 0).all(), "origin or spacing is no length")
        need((c >= 0).all() and not (self.g % 2.0**c).any() and not (n % 2.0**c).any(), f"2^{c} must divide granularity and cells")
        need(len(self.unit) <= 255 and "\0" not in self.unit.decode(), "unit is too long, or has a zero")
        self.step = float(root["step"]) if "step" in root else None
        mantissa, power = np.frexp(1.0 if self.step is None else self.step)
        need(mantissa == 0.5 and -125 <= power <= 104, f"step {self.step} is no power of two, or out of range")

    def _array(self, name, shape, *kinds):
        data = self.file[name]
        need(isinstance(data, h5py.Dataset) and data.dtype.str in kinds, f"/{name} is not of type {kinds}")
        need(data.shape == tuple(n or data.shape[0] for n in shape), f"/{name}: {data.shape} is not {tuple(shape)}")
        return data[...]

    def _samples(self, name, shape, tables):
        """Samples in float64, step * (offset + stored 2^shift) of integers; and their type."""
        stored = self._array(name, shape, "<f4", "<u2", "|u1").reshape(-1, *shape[-3:])
        whole = stored.dtype.kind == "u"
        need(all((table is not None) == whole for table in tables), f"/{name}: offset and shift are for integers")
        if not whole:
            need(np.isfinite(stored).all(), f"/{name}: a sample is not finite")
            return stored.astype(float), stored.dtype.str
        need(self.step is not None, f"/{name}: integers need the attribute step")
        offset, shift = (np.array(table, np.int64).reshape(-1, 1, 1, 1) for table in tables)
        need(len(offset) == len(shift) == len(stored), f"/{name}: one offset and one shift a tile")
        need((0 <= shift).all() and (shift <= 24).all() and not (offset % (1 << shift)).any(), f"/{name}: a wrong offset or shift")
        number = offset + (stored.astype(np.int64) << shift)
        need((np.abs(number) < 1 << 24).all(), f"/{name}: a sample of 2^24 steps or more")
        return self.step * number, stored.dtype.str

    def _read_index(self):
        f, bricks = self.file, -(-self.cells // self.g)
        self.level, self.tile = self._array("level", (*bricks, 3), "|u1"), self._array("tile", bricks, "<u4")
        tables = [f["base"].attrs.get(name) for name in TABLES]
        base, kind_of_base = self._samples("base", (self.cells >> self.coarsening) + 1, tables)
        self.tiles, types, names = {(0, 0, 0): base}, set(), sorted(f["tiles"])
        self.triples = [name for name in names if not name.endswith(tuple(TABLES))]
        for name in names:
            need(re.fullmatch(r"[0-6]{3}(_[12])?(_offset|_shift)?", name), f"/tiles/{name} is an unknown name")
            need(re.sub("_offset|_shift", "", name) in self.triples, f"/tiles/{name}: its tiles are missing")
        for name in self.triples:
            level, count = np.array([*map(int, name[:3])]), len(f[f"tiles/{name}"])
            known = level.any() and (level <= np.log2(self.rate) + self.coarsening).all()
            need(known and count, f"/tiles/{name}: empty, or a level above the rate")
            shape = np.ldexp(self.g, level - self.coarsening).astype(int) + 1
            tables = [self._array(f"tiles/{name}_{table}", (count,), kind) if f"{name}_{table}" in names else None
                      for table, kind in TABLES.items()]
            values, kind = self._samples(f"tiles/{name}", (0, *shape), tables)
            triple, before = tuple(level.tolist()), [n for n in (name[:3], name[:3] + "_1") if n < name]
            need((triple, kind) not in types and {*before} <= {*names}, f"/tiles/{name}: a type twice, or without the one before")
            types.add((triple, kind))
            self.tiles[triple] = np.concatenate([self.tiles[triple], values]) if before else values
        for triple in {*map(tuple, self.level.reshape(-1, 3).tolist()), *self.tiles}:
            used = np.sort(self.tile[(self.level == triple).all(axis=3)])
            numbers = np.arange(len(self.tiles.get(triple, ()))) if any(triple) else 0 * used
            need(np.array_equal(used, numbers), f"level {triple}: every tile belongs to exactly one brick")
        floats = {kind_of_base, *(stored for _, stored in types)} == {"<f4"}
        need(floats == (self.step is None), "the attribute step goes with integers")

    def _read_certificate(self):
        f = self.file
        need(("certificate" in f) != ("comparison" in f), "either /certificate or /comparison is needed")
        value = f["certificate" if "certificate" in f else "comparison"]
        self.text = text(value[()] if value.shape == () else value[0])
        self.certificate = json.loads(self.text, parse_constant=lambda name: need(False, f"the certificate has {name}"))
        self.comparison = "comparison" in f or self.certificate.get("comparison", False)
        self.totals, self.sigma = (self._array(name, self.tile.shape, "<f4") if name in f else None
                                   for name in ("brick_total", "brick_sigma"))
        most = self.certificate["measured_total"] * (1 + 2.0**-20)
        need(self.totals is None or (self.totals <= most).all(), "a brick's total is above measured_total")
        need(("noise" not in self.certificate) or (0 < self.sigma).all() and (self.sigma < np.inf).all(), "a wrong sigma")

    def content_hash(self):
        f, base = self.file, self.file["base"].attrs
        parts = [self.cells.astype("<i8"), self.origin.astype("<f8"), self.spacing.astype("<f8"), self.unit]
        parts += [np.array([self.g, self.rate], "<i8")] + [self.coarsening.astype("<i8")] * bool(self.coarsening.any())
        parts += [np.array(self.step, "<f8")] * (self.step is not None)
        parts += [f[name][...] for name in ("base", "level", "tile", *("tiles/" + name for name in self.triples))]
        for table in TABLES:
            parts += [np.array(base.get(table, 0), "<i8")] * (table in base)
            parts += [f[f"tiles/{name}_{table}"][...] for name in self.triples if f"{name}_{table}" in f["tiles"]]
        return digest(*parts)

    def seal(self):
        f, totals = self.file, np.empty(0, "<f4") if self.totals is None else self.totals
        counted = lambda part, n=None: [np.array(len(part) if n is None else n, "<i8"), part]
        parts = [b"vdvr seal 1\n", *counted(self.text), *counted(totals, totals.size)]
        known = ("base", "brick_sigma", "brick_total", "certificate", "comparison", "grid", "level", "tile", "tiles")
        for path in sorted(["/", *("/" + n for n in known if n in f), *("/tiles/" + n for n in f["tiles"])]):
            for name in sorted(set(f[path].attrs) - ({"seal"} if path == "/" else set())):
                value, parts = f[path].attrs[name], parts + counted(path.encode()) + counted(name.encode())
                if isinstance(value, (str, bytes)):
                    parts += [b"t", *counted(text(value))]
                else:
                    kind, size = ("i", "f")[np.asarray(value).dtype.kind == "f"], np.size(value)
                    parts += [kind.encode(), *counted(np.asarray(value, "<" + kind + "8"), size)]
        return digest(*parts)

    def brick_of(self, points):
        cell = (points - self.origin) / self.spacing
        return np.clip(cell // self.g, 0, np.array(self.tile.shape) - 1).astype(int)

    def at(self, points):
        """V: trilinear between the samples of the brick that each point belongs to."""
        brick, result = self.brick_of(points), np.empty(len(points))
        levels = self.level[tuple(brick.T)]
        for triple in map(tuple, np.unique(levels, axis=0).tolist()):
            mine, samples = (levels == triple).all(axis=1), self.tiles[triple]
            cell = (points[mine] - self.origin) / self.spacing - (brick[mine] * self.g if any(triple) else 0)
            place = cell * 2.0 ** (np.array(triple) - self.coarsening)
            low = np.clip(np.floor(place).astype(int), 0, np.array(samples.shape[1:]) - 2)
            number = self.tile[tuple(brick[mine].T)]
            result[mine] = sum(np.prod(np.where(corner, place - low, 1 - place + low), axis=1)
                               * samples[(number, *(low + corner).T)] for corner in np.ndindex(2, 2, 2))
        return result

    def differing_samples(self):
        """How many samples at one place differ between bricks, which must not be; places count in 64ths of a cell."""
        keys, values, size = [], [], self.cells * 64 + 1
        for triple in map(tuple, np.unique(self.level.reshape(-1, 3), axis=0).tolist()):
            step = np.ldexp(64, self.coarsening - triple).astype(int)
            brick, place = np.argwhere((self.level == triple).all(axis=3)), lattice(self.g * 64 // step + 1)
            place = place[((place == 0) | (place * step == self.g * 64)).any(axis=1)]  # on the brick's faces
            at = (brick[:, None] * self.g * 64 + place * step).reshape(-1, 3)
            inside = (at < size).all(axis=1)
            number = np.repeat(self.tile[tuple(brick.T)], len(place))[inside]
            index = np.tile(place, (len(brick), 1))[inside] if any(triple) else at[inside] // step
            keys.append(np.ravel_multi_index(tuple(at[inside].T), size))
            values.append(self.tiles[triple][(number, *index.T)])
        keys, values = np.concatenate(keys), np.concatenate(values)
        order = np.argsort(keys, kind="stable")
        return int(((np.diff(keys[order]) == 0) & (np.diff(values[order]) != 0)).sum())

# --- the scan: docs/inputs.md ---
class Scan:
    """Line integrals p [view][row][column], and where the views stand."""
    def __init__(self, path, certificate):
        self.options, self.used, path = certificate["options"].get("input", {}), {}, Path(path)
        path = path.parent if path.name == "scan.json" else path
        self.alone, self.folder = not path.is_dir(), path if path.is_dir() else path.parent
        m = self.members = {"hdf5": path.name} if self.alone else json.loads(self._use("scan.json").read_text("utf-8-sig"))
        known = "hdf5 entry description geometry matrices angles angle_unit center pitch unit redundancy comment use"
        need("hdf5" in m and not set(m) - {*known.split()}, f"scan.json: read here is HDF5, with {known}")
        with h5py.File(self._use(m["hdf5"]), "r") as f:
            self._read(f, self.options.get("entry") or m.get("entry") or "exchange")
        angles = m.get("geometry", {}).get("angles", m.get("angles", self.theta))
        if isinstance(angles, str):
            angles = [*map(float, re.sub("#.*|,", " ", self._use(angles).read_text("utf-8-sig")).split())]
        need(angles is not None and len(angles) == len(self.p), f"there must be {len(self.p)} angles")
        unit = self.options.get("angle_unit") or m.get("angle_unit") or (self.theta_unit if angles is self.theta else "degrees")
        views = self.options.get("views") or m.get("use") or [0, len(self.p)]
        chosen = np.concatenate([np.arange(*r) for r in (views if isinstance(views[0], list) else [views])])
        self.theta, self.p = np.array(angles, float)[chosen], self.p[chosen]
        self.theta, self.cone = self.theta if unit.lower().startswith("rad") else np.radians(self.theta), bool({"geometry", "matrices"} & set(m))
        need(np.isfinite(self.p).all(), "the scan holds values that are not finite")
        self.matrices = self._matrices(m) if self.cone else None

    def _use(self, name):
        self.used[name] = digest((self.folder / name).read_bytes())
        return self.folder / name

    def sha256(self):
        lines = sorted(f"{value} {name}\n".encode() for name, value in self.used.items())
        return lines[0][:64].decode() if self.alone else digest(*lines)

    def _read(self, f, entry):
        need(entry in f and "data" in f[entry], f"/{entry}/data is missing: of HDF5 only Data Exchange is read here")
        data, theta = f[entry]["data"], f[entry].get("theta")
        axes = text(data.attrs.get("axes", b"theta:y:x"))
        need(axes in (b"theta:y:x", b"y:theta:x"), f"axes {axes} are not read here")
        values = data[...] if axes == b"theta:y:x" else data[...].transpose(1, 0, 2)
        self.theta = None if theta is None else theta[...]
        self.theta_unit = "degrees" if theta is None else text(theta.attrs.get("units", b"degrees")).decode()
        pitch = [data.attrs.get(name, 1.0) for name in ("pitch_u", "pitch_v")]
        self.pitch = np.broadcast_to(self.members.get("pitch", pitch), 2)
        described = text(data.attrs.get("description", b"")).decode()
        self.p = values.astype(float)
        if (self.options.get("values") or self.members.get("description") or described) != "line integrals":
            need(not {"values", "dark", "flat"} & set(self.options), f"not done here: {self.options}")
            flat, dark = (f[entry][name][...].astype(float).mean(axis=0) for name in ("data_white", "data_dark"))
            self.p = line_integrals(values, flat - dark, dark)

    def _matrices(self, m):
        """3x4 matrices P, (u lambda, v lambda, lambda) = P (x, y, z, 1), scaled so that lambda = 1 at the origin."""
        if "matrices" in m:
            given = np.load(self._use(m["matrices"])).astype(float)
            return given / given[:, 2:, 3:]
        g, (pu, pv) = m["geometry"], np.broadcast_to(m["geometry"]["pitch"], 2)
        known = "source_to_axis source_to_detector pitch angles center row offset_u offset_v tilt sense"
        need(not set(g) - {*known.split()}, f"geometry has members beside {known}")
        (psi, phi), result, up = np.radians(g.get("tilt", (0, 0))), [], np.array([0, 0, 1])
        u = g.get("center", (self.p.shape[2] - 1) / 2) - g.get("offset_u", 0) / pu
        v = g.get("row", (self.p.shape[1] - 1) / 2) - g.get("offset_v", 0) / pv
        for theta in self.theta * g.get("sense", 1):
            x, source = np.array([[np.cos(theta), np.sin(theta), 0], [np.sin(theta), -np.cos(theta), 0]])
            y, source = up * np.cos(phi) + source * np.sin(phi), source * np.cos(phi) - up * np.sin(phi)
            x, y = x * np.cos(psi) + y * np.sin(psi), y * np.cos(psi) - x * np.sin(psi)
            depth, scale = np.append(-source / g["source_to_axis"], 1), g["source_to_detector"] / g["source_to_axis"]
            result.append([np.append(x * scale / pu, 0) + u * depth, np.append(y * scale / pv, 0) + v * depth, depth])
        return np.array(result)

def line_integrals(counts, gain, dark):
    """-log of the transmission. A dead pixel takes the median of the valid ones in the smallest square about it."""
    floor = 0.5 / np.median(gain) if counts.dtype.kind in "ui" else 2.0**-17
    with np.errstate(all="ignore"):
        through = (counts - dark) / gain
        p = -np.log(through)
        valid = (gain > 0) & (through > floor) & np.isfinite(p)
    for k, j, i in np.argwhere(~valid):
        boxes = ((k, slice(max(j - r, 0), j + r + 1), slice(max(i - r, 0), i + r + 1)) for r in range(1, max(p.shape)))
        box = next(box for box in boxes if valid[box].any())
        p[k, j, i] = np.median(p[box][valid[box]])
    return p.astype(np.float32).astype(float)

# --- F: docs/geometry.md ---
WINDOWS = {"ram-lak": np.ones_like, "shepp-logan": lambda x: np.sinc(x / 2), "cosine": lambda x: np.cos(np.pi * x / 2),
           "hamming": lambda x: 0.54 + 0.46 * np.cos(np.pi * x), "hann": lambda x: 0.5 + 0.5 * np.cos(np.pi * x)}

def filtered(p, tau, name, cutoff):
    """Rows convolved, linearly, with taps that are the integral over |w| < pi cutoff of |w| window cos(w n)."""
    need(name in WINDOWS, f"filter {name} is not known")
    n = np.arange(p.shape[-1])
    x, weight = np.polynomial.legendre.leggauss(2 * len(n) + 64)
    x = (x + 1) / 2
    taps = np.cos(np.outer(n, np.pi * cutoff * x)) @ (weight * cutoff**2 * x * WINDOWS[name](x)) / (4 * tau)
    return p @ taps[np.abs(n[:, None] - n)]

def cosine_coefficients(q):
    """a [view][m][n], with q(u, v) = sum of a cos(pi m (v + 1/2) / V) cos(pi n (u + 1/2) / U)."""
    matrix = lambda n: np.cos(np.pi / n * np.outer(np.arange(n), np.arange(n) + 0.5)) * (2 - np.eye(n)[0])[:, None] / n
    return matrix(q.shape[1]) @ q @ matrix(q.shape[2]).T

def view_weights(angle, period):
    """Half the gaps to both neighbouring directions, shared by the views of one; a wedge counts as four usual gaps."""
    order = np.argsort(angle % period, kind="stable")
    a = (angle % period)[order]
    start = (np.diff(a, append=a[0] + period).argmax() + 1) % len(a)
    order, a = np.roll(order, -start), np.append(a[start:], a[:start] + period)
    gap, runs, i = np.diff(a, append=a[0] + period), [], 0
    while i < len(a):
        last = max(j for j in range(i, len(a)) if a[j] - a[i] <= min(gap[i - 1], gap[j]) / (4 if j - i > 1 else 1000))
        runs.append((i, i := last + 1))
    mean = np.array([a[i:j].mean() for i, j in runs])
    gap = np.diff(mean, append=mean[0] + period)
    wide = np.sort(gap)[::-1]
    for wedges in range(min(7, len(gap) - 1), -1, -1):  # the widest gaps, as many as stand apart
        rest = wide[wedges:][::-1]
        usual = rest[(np.cumsum(rest) > (0.5 + 1e-9) * (rest.sum() + wedges * rest)).argmax()]
        if not wedges or wide[wedges - 1] > max(2 * rest[-1], min(4 * rest[-1], (np.log(len(gap)) + 8) * usual / 1.678)):
            break
    need(wedges < 4, "angles with four or more wide gaps are not weighed here: they may be a coarse part of the scan")
    gap, weight = np.where(gap > rest[-1], 4 * usual, gap), np.empty(len(a))
    for n, (i, j) in enumerate(runs):
        weight[order[i:j]] = (gap[n - 1] + gap[n]) / 2 / (j - i)
    return weight

def places(matrices, points):
    """Where views see points (z, y, x): columns, rows and lambda, [view][point] each."""
    n = matrices @ np.vstack([points[:, ::-1].T, np.ones(len(points))])
    return n[:, 0] / n[:, 2], n[:, 1] / n[:, 2], n[:, 2]

class Field:
    """F: coefficients of each view's cosine series, times its weight, and the matrices by which views see points."""
    def __init__(self, scan, certificate):
        field, self.shape = certificate["field"], scan.p.shape
        need("preparation" not in field, f"preparation is not done here: {field.get('preparation')}")
        kind, center = (field["filter"], field["cutoff"]), field["center"]
        need(center is not None, "the certificate does not state the centre")
        if scan.cone:
            self.seen = scan.matrices.copy()
            shift = center - self.seen[:, 0, 3].mean()
            self.seen[:, 0] += (abs(shift) > 1e-9) * shift * self.seen[:, 2]
            self._fdk(scan, kind, certificate["options"]["geometry"]["cone"]["redundancy"])
        else:
            a, weights = cosine_coefficients(filtered(scan.p, scan.pitch[0], *kind)), view_weights(scan.theta, np.pi)
            self.seen = np.zeros((len(scan.p), 3, 4))
            self.seen[:, 0, :2] = np.stack([np.cos(scan.theta), np.sin(scan.theta)], axis=1) / scan.pitch[0]
            self.seen[:, 0, 3], self.seen[:, 2, 3] = center, 1
            self.seen[:, 1, 2:] = 1 / scan.pitch[1], (self.shape[1] - 1) / 2
            self.coefficients, self.matrices = a * weights[:, None, None], self.seen
        self.rounding = 2.0**-49 * (sum(self.coefficients.shape[1:]) + 64) * np.abs(self.coefficients).sum()

    def _fdk(self, scan, kind, redundancy):
        """Feldkamp, Davis and Kress: redundancy, cosine, the ramp at the axis, the view's weight."""
        need(redundancy in ("full-turn", "short-scan", "displaced"), f"redundancy {redundancy} is not known")
        P, columns, rows = self.seen, np.arange(self.shape[2]), np.arange(self.shape[1])[:, None]
        source = -np.linalg.solve(P[:, :, :3], P[:, :, 3:])[:, :, 0]
        beta, axis = np.arctan2(source[:, 0], -source[:, 1]) % (2 * np.pi), P[:, 0, 3].mean()
        turn, weight = np.sort(beta), view_weights(beta, 2 * np.pi) / 2
        gap = np.diff(turn, append=turn[0] + 2 * np.pi)
        beta, delta = (beta - turn[(gap.argmax() + 1) % len(turn)]) % (2 * np.pi), (np.pi - gap.max()) / 2
        lack = columns[-1] - 2 * axis if redundancy == "displaced" else 0
        pad, q = int(np.ceil(abs(lack) - 1e-9)), []
        for k, view in enumerate(scan.p):
            depth = P[k, 2, :3]
            r = 1 / np.linalg.norm(depth)  # from the source to the axis, along the detector's normal
            foot = P[k, :2, :3] @ depth * r * r  # where that normal meets the detector: column, row
            pitch = 1 / np.linalg.norm(P[k, :2, :3] - foot[:, None] * depth, axis=1)  # at the axis
            x, y, aside = (columns - foot[0]) * pitch[0], (rows - foot[1]) * pitch[1], (P[k, 0, 3] - foot[0]) * pitch[0]
            away = np.hypot(aside, r)  # from the source to the axis, in the plane of the rows
            view = view * (x * aside + r * r) / away / np.sqrt(x * x + y * y + r * r)
            fan = np.arctan((columns - P[k, 0, 3]) * pitch[0] / r)
            if redundancy == "short-scan":
                rise, fall = beta[k] / (delta + fan), (np.pi + 2 * delta - beta[k]) / (delta - fan)
                view = view * 2 * np.sin(np.pi / 4 * np.minimum(np.minimum(rise, fall), 2)) ** 2
            elif redundancy == "displaced":
                overlap = np.arctan(min(axis, columns[-1] - axis) * pitch[0] / r)
                view = view * (1 + np.sign(lack) * np.sin(np.pi / 2 * np.clip(fan / overlap, -1, 1)))
            view = np.pad(view, ((0, 0), (pad, 0) if lack > 0 else (0, pad)))
            q.append(filtered(view, pitch[0], *kind) * weight[k] * away / r)
        self.coefficients, self.matrices = cosine_coefficients(np.array(q)), P.copy()
        self.matrices[:, 0] += (pad if lack > 0 else 0) * P[:, 2]

    def sees(self, points):
        """Which points every view sees: between the outer columns' outer edges and the outer rows' centres."""
        u, v, _ = places(self.matrices, points)
        _, V, U = self.coefficients.shape
        return ((np.abs(2 * u - U + 1) <= U + 1e-9) & (np.abs(2 * v - V + 1) <= V - 1 + 1e-9)).all(axis=0)

    def at(self, points):
        """F: the sum over the views of lambda^-2 q(u, v)."""
        u, v, scale = places(self.matrices, points)
        m, n = (np.pi / size * np.arange(size) for size in self.coefficients.shape[1:])
        return sum(((np.cos((v[k, :, None] + 0.5) * m) @ a) * np.cos((u[k, :, None] + 0.5) * n)).sum(axis=1)
                   / scale[k] ** 2 for k, a in enumerate(self.coefficients))

# --- the certificate: docs/file-format.md ---
def contradictions(c, v, scan, field):
    """What the certificate says wrongly of itself, of the arrays and of the scan, without a look at F."""
    def same(a, b, relative=2.0**-40):
        return np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=relative, atol=1e-12 * c["epsilon_abs"])

    seal, sealed, sigma = v.file.attrs.get("seal"), c.get("sealed", False), None if v.sigma is None else digest(v.sigma)
    parts = c["measured_total"], c["budget"]["arithmetic"]["value"], c["budget"]["sampler"]["buffer"]["value"]
    yield c["content_sha256"] == v.content_hash(), "content_sha256 is not that of the samples"
    yield (seal is not None) == sealed and (not sealed or text(seal).decode() == v.seal()), "the seal is not the file's"
    yield not sealed or v.totals is not None, "a sealed file must have /brick_total"
    yield "noise" not in c or c["noise"]["brick_sigma_sha256"] == sigma, "noise.brick_sigma_sha256 is not that of /brick_sigma"
    yield v.differing_samples() == 0, "bricks store different values of a sample that they share"
    yield same(c["epsilon_abs"], c["epsilon"] * c["reference_range"]), "epsilon_abs is not epsilon of reference_range"
    yield same(c["total"]["buffer"], sum(parts)), "total.buffer is not the sum of its terms"
    for name, total in c["total"].items():
        yield total is None or c["holds"][name] == (total <= c["epsilon_abs"]), f"holds.{name} contradicts total.{name}"
    yield c["holds"]["buffer"], "it says itself that it does not hold"
    yield c["budget"]["grid"]["value"] == c["measured_max"] <= c["measured_total"], "measured_max is not budget.grid"
    if v.totals is not None:
        at = (np.array(c["worst_at"][::-1]) - v.origin) / v.spacing / v.g
        box = tuple(slice(int(max(np.ceil(a - 1 - 1e-9), 0)), int(a + 1e-9) + 1) for a in at)
        worst = [same(float(part.max(initial=-1)), c["measured_total"], 2.0**-20) for part in (v.totals, v.totals[box])]
        yield all(worst), "measured_total is not the largest of /brick_total, or worst_at lies in another brick"
    yield c["input"]["sha256"] == scan.sha256(), "input.sha256 is not that of the scan"
    yield c["input"]["shape"] == list(field.shape), "input.shape is not that of the scan"
    yield c["rates"]["gold"] == v.rate, "rates.gold is not the rate of the file"
    yield same((geometry := c["options"]["geometry"])["theta_rad"], scan.theta) or scan.cone, "options.geometry.theta_rad are not the scan's angles"
    if scan.cone:
        given, scale = np.ravel(geometry["cone"]["matrices"]), np.abs(field.seen).max(axis=2, keepdims=True)
        equal = given.size == field.seen.size and same(given.reshape(-1, 3, 4) / scale, field.seen / scale)
        yield equal, "options.geometry.cone.matrices are not those of the scan"

def certified(c, scan, field, points):
    """The points of which the certificate speaks: seen by every view (of cone beam: in the cylinder), in its region."""
    inside = field.sees(points)
    if scan.cone:
        low, high = c["covered"]["z"]
        within = np.hypot(points[:, 1], points[:, 2]) <= c["covered"]["radius"]
        within &= (points[:, 0] >= low) & (points[:, 0] <= high)
        need(inside[within].all(), "the certificate's covered holds points that a view does not see")
        inside = within
    low, high = np.reshape(c["roi"] or [-np.inf] * 3 + [np.inf] * 3, (2, 3))[:, ::-1]
    return points[inside & ((points >= low) & (points <= high)).all(axis=1)]

def choose(c, v, scan, count, rng):
    """Points, half anywhere, brick by brick, half middles of gold cells in the 64 worst bricks; and nodes of gold."""
    bricks = lattice(v.tile.shape)
    worst = rng.permutation(len(bricks))[:64] if v.totals is None else np.argsort(-v.totals, axis=None)[:64]
    brick = np.vstack([np.resize(rng.permutation(bricks), (count, 3)), np.resize(bricks[worst], (count, 3))])
    cell = brick * v.g + rng.random(brick.shape) * np.minimum(v.g, v.cells - brick * v.g)
    nodes = np.vstack([np.round(cell * v.rate) / v.rate * v.spacing + v.origin, c["worst_at"][::-1]])
    cell[count:] = (np.floor(cell[count:] * v.rate) + 0.5) / v.rate
    points = cell * v.spacing + v.origin
    if not scan.cone:  # of a scan of one row only a plane is seen
        points[:, 0] = points[:, 0].clip(*np.array([-1, 1]) * (scan.p.shape[1] - 1) / 2 * scan.pitch[1])
    return points, nodes

def distances(c, v, scan, field, count, seed):
    """|V - F| at points, held to the bounds of their bricks; at nodes of gold, to measured_max."""
    budget, window = c["budget"], c["window"] or (-np.inf, np.inf)
    beside = budget["arithmetic"]["value"] + budget["sampler"]["buffer"]["value"] + field.rounding
    for points, what in zip(choose(c, v, scan, count, np.random.default_rng(seed)), ("points", "nodes")):
        points = certified(c, scan, field, points)
        f = field.at(points)
        asked = (f >= window[0]) & (f <= window[1])
        points, error = points[asked], np.abs(v.at(points) - f)[asked]
        limit = np.full(len(points), c["measured_max"] + budget["projection"]["value"])
        if what == "points":
            limit = v.totals[tuple(v.brick_of(points).T)] if v.totals is not None else limit * 0 + c["measured_total"]
            yield (limit >= 0).all(), "a brick with covered points was not tested"
        share = error / (limit + beside)
        print(f"  {len(points)} {what}: |V - F| at most {error.max(initial=0):.6g}; {share.max(initial=0):.3f} of its bound")
        for k in [share.argmax()] if not (share <= 1).all() else []:
            yield False, f"|V - F| is {error[k]:.6g} at {points[k, ::-1]}, where it may be {limit[k] + beside:.6g}"
    points = certified({**c, "roi": None}, scan, field, v.origin + lattice(v.cells + 1) * v.spacing)
    if len(points) and c["window"] is None and c["roi"] is None:  # F is largest and least where V leaves it open
        values, margin = v.at(points), 2 * c["total"]["buffer"]
        points = points[(values >= values.max() - margin) | (values <= values.min() + margin)]
    span = np.ptp(field.at(points)) if len(points) else c["reference_range"]  # a scan of one row covers no sample
    print(f"  range of F {span:.6g}, reference_range {c['reference_range']:.6g}")
    yield abs(span - c["reference_range"]) <= 2 * (beside + budget["projection"]["value"]), "reference_range is not F's"

def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, kind, default in (("file", str, None), ("scan", str, None), ("--points", int, 4000), ("--seed", int, 1)):
        parser.add_argument(name, type=kind, default=default)
    words = parser.parse_args()
    try:
        c = (v := Volume(words.file)).certificate
        need(not v.comparison, f"{words.file}: a comparison, which promises nothing")
        field = Field(scan := Scan(words.scan, c), c)
        print(f"{words.file}: format {v.version}, {'x'.join(map(str, v.cells[::-1]))} cells, {len(scan.p)} views, "
              f"{'cone' if scan.cone else 'parallel'} beam; total {c['total']['buffer']:.6g} of {c['epsilon_abs']:.6g}")
        wrong = [message for right, message in contradictions(c, v, scan, field) if not right]
        wrong += [message for right, message in distances(c, v, scan, field, words.points // 2, words.seed) if not right]
    except (Refused, KeyError, OSError, ValueError, TypeError, AttributeError, IndexError) as error:
        print(f"verify.py: {'' if isinstance(error, Refused) else type(error).__name__ + ' '}{error}", file=sys.stderr)
        return 2
    print(*(f"  WRONG: {message}" for message in wrong), "FAILS" if wrong else "nothing speaks against it", sep="\n")
    return 1 if wrong else 0

if __name__ == "__main__":
    sys.exit(main())
