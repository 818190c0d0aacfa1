"""What the peer scripts share: the throw-away virtual environment, running vdvr, and tables.

Nothing here is installed into the system: packages come from PyPI into one folder, which may be deleted."""
import json
import os
import pathlib
import resource
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SKIP = 77
# What each peer needs. silx runs on OpenCL: the machine's own driver, the one that vdvr uses.
PACKAGES = {
    "astra": ["numpy", "astra-toolbox"],
    "silx": ["numpy", "pyopencl", "silx"],
    "rtk": ["numpy", "itk-rtk"],
    "skimage": ["numpy", "scikit-image"],
    "tomopy": ["numpy", "tomopy"],
    "h5py": ["numpy", "h5py"],  # reads our scans
    "zfp": ["numpy", "numba", "h5py", "zfpy"],
    "sz3": ["numpy", "pysz"],
}


def add_options(parser):
    parser.add_argument("--venv", type=pathlib.Path, default=ROOT / "build/peers", help="virtual environment (default build/peers)")
    parser.add_argument("--vdvr", type=pathlib.Path, default=ROOT / "build/vdvr", help="the program (default build/vdvr)")
    parser.add_argument("--no-install", action="store_true", help="take only what the environment already has")


def enter(args, peers):
    """Installs what is missing and starts the script again inside the environment. Returns once inside."""
    python = args.venv / "bin/python"
    if os.environ.get("VDVR_PEERS_INSIDE") == str(args.venv):
        return
    if not python.exists():
        made = subprocess.run([sys.executable, "-m", "venv", str(args.venv)], stdout=subprocess.DEVNULL)
        if made.returncode != 0:
            print("peers: skipped: no virtual environment; install python3-venv", file=sys.stderr)
            sys.exit(SKIP)
    if not args.no_install:
        for peer in peers:
            done = subprocess.run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
                                   *PACKAGES[peer]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if done.returncode != 0:
                last = (done.stdout.strip().splitlines() or ["no message"])[-1]
                print(f"peers: {peer} cannot be installed here: {last}", file=sys.stderr)
    inside = dict(os.environ, VDVR_PEERS_INSIDE=str(args.venv))
    inside.setdefault("OCL_ICD_VENDORS", "/etc/OpenCL/vendors")
    os.execve(str(python), [str(python), *sys.argv], inside)


def version_of(package):
    from importlib import metadata
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def run_vdvr(args, *options):
    """One JSON object from a vdvr command."""
    done = subprocess.run([str(args.vdvr), *map(str, options)], stdout=subprocess.PIPE, check=True, text=True)
    return json.loads(done.stdout.strip().splitlines()[-1])


def run_vdvr_json(args, *options):
    """The one object of a command with --json."""
    done = subprocess.run([str(args.vdvr), *map(str, options), "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return json.loads(done.stdout)


def read_mha(path, mapped=False):
    """A volume vdvr wrote: samples [z][y][x] in memory or where they lie on disk, spacing and origin as x, y, z."""
    import numpy
    with open(path, "rb") as file:
        header = {}
        while "ElementDataFile" not in header:
            key, value = file.readline().decode().split("=", 1)
            header[key.strip()] = value.strip()
        if header["ElementDataFile"] != "LOCAL" or header["ElementType"] != "MET_FLOAT":
            raise ValueError(f"{path}: not a volume of floats in one file")
        size = [int(n) for n in header["DimSize"].split()]
        count = size[0] * size[1] * size[2]
        data = numpy.memmap(path, "<f4", "r", file.tell(), count) if mapped else numpy.fromfile(file, "<f4", count)
    vector = lambda *keys: [float(v) for v in next(header[k] for k in keys if k in header).split()]
    return data.reshape(size[::-1]), vector("ElementSpacing"), vector("Offset", "Origin", "Position")


def processor_seconds_of_children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def load_average():
    return [round(v, 2) for v in os.getloadavg()]


def markdown(header, rows):
    yield "| " + " | ".join(header) + " |"
    yield "|" + " --- |" * len(header)
    for row in rows:
        yield "| " + " | ".join(str(v) for v in row) + " |"
