"""What examples/verify.py says of files of many kinds, and of forgeries of them: VDVR SOURCE. A forgery is hashed and sealed again, so that only the comparison with F can find it."""

import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

vdvr, script = sys.argv[1], Path(sys.argv[2]) / "examples/verify.py"
sys.dont_write_bytecode = True  # examples/ is installed as it is
spec = importlib.util.spec_from_file_location("verify", script)
verify = importlib.util.module_from_spec(spec)
spec.loader.exec_module(verify)

PARALLEL = "--detector 33x9 --angles 32"
CONE = "--detector 21x7 --angles 24 --cone 100,200 --pitch 2"
SCANS = {
    "plain.h5": PARALLEL,
    "counts.h5": PARALLEL + " --photons 20000",
    "tall.h5": "--detector 33x17 --angles 32 --arc 360",
    "row.h5": "--detector 33x1 --angles 48",
    "turn": CONE + " --tilt 2,3",
    "short": CONE + " --arc 220",
    "displaced": CONE + " --detector-offset 4.3 --tilt 1,2",
}
FILES = {
    "integers": ("plain.h5", "--epsilon 5%"),
    "floats": ("plain.h5", "--epsilon 5% --storage f32 --compression none"),
    "filter": ("plain.h5", "--epsilon 5% --filter hann --filter-cutoff 0.7 --granularity 8 --center 16.3"),
    "window": ("plain.h5", "--epsilon 5% --window 0.1,0.4"),
    "region": ("plain.h5", "--epsilon 5% --roi=-5,-4,-2,6,7,3"),
    "spacing": ("uneven.h5", "--epsilon 5% --filter cosine --spacing 1.5,0.8 --granularity 2 --views 0:12,14:32"),
    "sigma": ("counts.h5", "--epsilon 2sigma"),
    "coarse-base": ("tall.h5", "--epsilon 10% --base 2x2x2 --size 32x32x16 --origin=-16,-16,-8"),
    "row": ("row.h5", "--epsilon 3%"),
    "turn": ("turn", "--epsilon 20% --gold 4"),
    "short": ("short", "--epsilon 20% --gold 4"),
    "displaced": ("displaced", "--epsilon 20% --gold 4"),
}


def run(*words):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)


def must(*words):
    done = run(*words)
    assert done.returncode == 0, f"{words}: {done.stderr}"


def verified(file, scan, wanted, says=""):
    done = run(sys.executable, script, file, scan)
    told = f"{file.name}: {done.returncode}, not {wanted}\n{done.stdout}{done.stderr}"
    assert done.returncode == wanted and says in done.stdout + done.stderr, told + f"not a word of: {says}"
    return done.stdout


def reseal(file, edit=lambda certificate: None):
    """Edits the certificate, and puts hash and seal right, as a forger would."""
    for what in ("content_sha256", "seal"):
        volume = verify.Volume(file)
        certificate, right = volume.certificate, (volume.content_hash(), volume.seal())
        volume.file.close()
        with h5py.File(file, "a") as f:
            if what == "seal":
                f.attrs["seal"] = np.bytes_(right[1])
                return
            certificate["content_sha256"] = right[0]
            edit(certificate)
            del f["certificate"]
            f.create_dataset("certificate", data=np.bytes_(json.dumps(certificate)))


def numbers(volume, change):
    """Changes float samples, those of the base and of all tiles."""
    for array in (volume["base"], *volume["tiles"].values()):
        array[...] = change(array[...])


def one_tile(f):
    name = max((n for n in f["tiles"] if "_" not in n), key=lambda n: f["tiles"][n].size)
    f["tiles"][name][0] += np.float32(0.2)


def one_sample(f):
    name = max((n for n in f["tiles"] if "_" not in n), key=lambda n: f["tiles"][n].size)
    f["tiles"][name][0, 0, 0, 0] += np.float32(1e-4)


def swap_axes(f):
    """x and y of the field, of everything that says where it lies: the shape stays the same."""
    tiles = {name: f["tiles"][name][...].swapaxes(2, 3) for name in f["tiles"]}
    totals, base = f["brick_total"][...].swapaxes(1, 2), f["base"][...].swapaxes(1, 2)
    level, tile = f["level"][...].swapaxes(1, 2)[..., [0, 2, 1]], f["tile"][...].swapaxes(1, 2)
    for name in tiles:
        del f["tiles"][name]
    for name, values in tiles.items():
        write(f, f"tiles/{name[0]}{name[2]}{name[1]}", values)
    for name, values in (("brick_total", totals), ("base", base), ("level", level), ("tile", tile)):
        f[name][...] = values


def write(f, name, values):
    f.create_dataset(name, data=values, chunks=values.shape, fletcher32=True)


def scale_bounds(factor):
    """A tolerance that is smaller by that factor, and everything that follows from it."""
    def edit(c):
        c["epsilon_abs"], c["epsilon"] = c["epsilon_abs"] * factor, c["epsilon"] * factor
        c["measured_total"] *= factor
        c["measured_max"] *= factor
        c["budget"]["grid"]["value"] = c["measured_max"]
        terms = c["measured_total"] + c["budget"]["arithmetic"]["value"]
        for name, sampler in c["budget"]["sampler"].items():
            c["total"][name] = terms + sampler["value"]
            c["holds"][name] = c["total"][name] <= c["epsilon_abs"]
    return edit


def turn_angles(folder, scan):
    """A scan whose angles were altered, and its hash."""
    forged = folder / "turned.h5"
    shutil.copy(folder / scan, forged)
    with h5py.File(forged, "a") as f:
        f["exchange/theta"][...] *= 0.98
        theta = np.radians(f["exchange/theta"][...]).tolist()

    def edit(c):
        c["input"]["sha256"] = verify.digest(forged.read_bytes())
        c["options"]["geometry"]["theta_rad"] = theta
    return forged, edit


def set_in(path, value):
    def edit(c):
        for name in path[:-1]:
            c = c[name]
        c[path[-1]] = value(c[path[-1]]) if callable(value) else value
    return edit


def forgeries(folder):
    """Name, file, scan, change of the arrays, change of the certificate, and a part of what is said."""
    none = lambda _: None  # noqa: E731
    plain, turned, angles = folder / "plain.h5", *turn_angles(folder, "plain.h5")
    far, shared = "|V - F| is", "share"
    first_matrix = lambda m: [m[0] * (1 + 1e-6), *m[1:]]  # noqa: E731
    return [
        ("scaled samples", "floats", plain, lambda f: numbers(f, lambda a: a * np.float32(1.2)), none, far),
        ("moved samples", "floats", plain, lambda f: numbers(f, lambda a: a + np.float32(0.06)), none, far),
        ("one tile", "floats", plain, one_tile, none, shared),
        ("one sample", "floats", plain, one_sample, none, shared),
        ("swapped axes", "floats", plain, swap_axes, none, far),
        ("mirrored integers", "integers", plain, mirror, none, far),
        ("halved bounds", "floats", plain, lambda f: halve(f, 0.5), scale_bounds(0.5), far),
        ("halved bounds of integers", "integers", plain, lambda f: halve(f, 0.5), scale_bounds(0.5), far),
        ("smaller total", "floats", plain, none, set_in(["total", "buffer"], lambda x: x / 2), "total.buffer"),
        ("smaller epsilon", "floats", plain, none, set_in(["epsilon"], 0.01), "epsilon_abs"),
        ("larger range", "floats", plain, none, larger_range, "reference_range"),
        ("lower brick", "floats", plain, lower_bricks, none, far),
        ("smaller measured_max", "integers", plain, none, smaller_measured, "nodes"),
        ("angles of the certificate", "floats", plain, none,
         set_in(["options", "geometry", "theta_rad"], lambda t: [x * 0.98 for x in t]), "theta_rad"),
        ("angles of the scan", "floats", turned, none, angles, far),
        ("matrices", "turn", folder / "turn", none, set_in(["options", "geometry", "cone", "matrices"], first_matrix), "matrices"),
        ("redundancy", "short", folder / "short", none, set_in(["options", "geometry", "cone", "redundancy"], "full-turn"), far),
        ("cone samples", "turn", folder / "turn", mirror, none, far),
        ("filter", "floats", plain, none, set_in(["field", "filter"], "hann"), far),
        ("cutoff", "filter", plain, none, set_in(["field", "cutoff"], 1.0), far),
        ("centre", "floats", plain, none, set_in(["field", "center"], lambda x: x + 0.5), far),
        ("another scan", "floats", folder / "counts.h5", none, none, "sha256"),
        ("worst_at", "floats", plain, none, set_in(["worst_at"], [0.0, 0.0, 0.0]), "worst_at"),
        ("sigma", "sigma", folder / "counts.h5", lambda f: halve(f, 0.5, "brick_sigma"), none, "brick_sigma_sha256"),
    ]


def by_matrices(folder):
    """The same scan with its geometry as matrices, of any scale."""
    described = json.loads((folder / "scan.json").read_text())
    matrices = verify.Scan(folder, {"options": {}}).matrices
    np.save(folder / "P.npy", matrices * np.linspace(0.5, 2, len(matrices))[:, None, None])
    described.pop("geometry")
    (folder / "scan.json").write_text(json.dumps({**described, "matrices": "P.npy"}))


def mirror(f):
    """The samples of the base backwards along x; tiles, levels and totals with them."""
    for name in f["tiles"]:
        if not name.endswith(("_offset", "_shift")):
            f["tiles"][name][...] = f["tiles"][name][...][..., ::-1]
    f["base"][...] = f["base"][...][..., ::-1]


def halve(f, factor, name="brick_total"):
    values = f[name][...]
    f[name][...] = np.where(values > 0, values * np.float32(factor), values)


def lower_bricks(f):
    """All bounds of bricks but the largest are a tenth of what they were."""
    values = f["brick_total"][...]
    f["brick_total"][...] = np.where((values > 0) & (values < values.max()), values * np.float32(0.1), values)


def larger_range(c):
    c["reference_range"] *= 1.5
    c["epsilon"] /= 1.5


def smaller_measured(c):
    c["measured_max"] *= 0.5
    c["budget"]["grid"]["value"] = c["measured_max"]


with tempfile.TemporaryDirectory() as place:
    folder = Path(place)
    for name, options in SCANS.items():
        must(vdvr, "simulate", "--phantom", "shepp-logan", *options.split(), "-o", folder / name)
    shutil.copy(folder / "plain.h5", folder / "uneven.h5")
    with h5py.File(folder / "uneven.h5", "a") as f:  # unequal steps, a direction twice, a wedge that was not seen
        f["exchange/theta"][...] = np.sort(np.append(np.arange(31) * 4.8 + np.arange(31) % 3, 9.6))
    by_matrices(folder / "turn")
    for name, (scan, options) in FILES.items():
        must(vdvr, "build", folder / scan, *options.split(), "-o", folder / f"{name}.vdvr", "--quiet")
        print(verified(folder / f"{name}.vdvr", folder / scan, 0), flush=True)

    for name, original, scan, change, edit, says in forgeries(folder):
        forged = folder / "forged.vdvr"
        shutil.copy(folder / f"{original}.vdvr", forged)
        with h5py.File(forged, "a") as f:
            change(f)
        reseal(forged, edit)
        found = verified(forged, scan, 1, says)
        print(name, *[line for line in found.splitlines() if "WRONG" in line], sep="\n", flush=True)

    # What was altered without a new hash or seal, and what promises nothing or is not read here.
    shutil.copy(folder / "floats.vdvr", forged)
    with h5py.File(forged, "a") as f:
        f["base"][0, 0, 0] += np.float32(1)
    verified(forged, folder / "plain.h5", 1, "content_sha256")
    shutil.copy(folder / "floats.vdvr", forged)
    with h5py.File(forged, "a") as f:
        f.attrs["generator"] = np.bytes_("another")
    verified(forged, folder / "plain.h5", 1, "seal")
    with h5py.File(forged, "a") as f:
        del f.attrs["seal"]
    verified(forged, folder / "plain.h5", 1, "seal")
    run(vdvr, "build", folder / "plain.h5", "--epsilon", "5%", "--paper", "-o", folder / "paper.vdvr", "--quiet")
    verified(folder / "paper.vdvr", folder / "plain.h5", 2, "promises nothing")
    must(vdvr, "build", folder / "plain.h5", "--epsilon", "5%", "--median", "3", "-o", folder / "median.vdvr", "--quiet")
    verified(folder / "median.vdvr", folder / "plain.h5", 2, "preparation")
    verified(folder / "plain.h5", folder / "plain.h5", 2)
    verified(folder / "floats.vdvr", folder / "none.h5", 2)
