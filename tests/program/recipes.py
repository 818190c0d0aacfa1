"""Runs the Python of docs/file-format.md on files of ours: DOCUMENT VDVR."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

document, vdvr = Path(sys.argv[1]), sys.argv[2]
recipes = re.findall(r"^```python\n(.*?)^```", document.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
names = ("content", "seal")
assert len(recipes) == len(names), f"{len(recipes)} recipes in {document}"


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, check=False)


def says(file):
    """The last word of each recipe: whether the hash is right."""
    words = []
    for name, recipe in zip(names, recipes):
        done = run(sys.executable, "-c", recipe, str(file))
        assert done.returncode == 0, f"{name}: {done.stderr}"
        words.append(done.stdout.split()[-1])
    return words


def info(file):
    return run(vdvr, "info", str(file))


def expect(what, found, wanted):
    assert found == wanted, f"{what}: {found}, not {wanted}"


with tempfile.TemporaryDirectory() as folder:
    scan = Path(folder) / "s.h5"
    assert run(vdvr, "simulate", "--phantom", "sphere", "--detector", "21x7", "--angles", "24", "-o", str(scan)).returncode == 0
    for storage in ("u8", "f32"):
        file = Path(folder) / f"{storage}.vdvr"
        built = run(vdvr, "build", str(scan), "--epsilon", "20%", "--storage", storage, "-o", str(file))
        assert built.returncode == 0, built.stderr
        expect(storage, says(file), ["True", "True"])
        expect("info", info(file).returncode, 0)

        # The same text in variable length, as h5py writes it, is the same file.
        with h5py.File(file, "a") as f:
            certificate, generator = f["certificate"][()], f.attrs["generator"]
            del f["certificate"]
            f["certificate"] = certificate.decode()
            f.attrs["generator"] = generator.decode()
        expect("rewritten", says(file), ["True", "True"])
        expect("info of the rewritten", info(file).returncode, 0)

        with h5py.File(file, "a") as f:
            f.attrs["generator"] = "another"
        expect("edited", says(file), ["True", "False"])
        expect("info of the edited", info(file).returncode, 1)
        with h5py.File(file, "a") as f:
            f.attrs["generator"] = generator.decode()
            del f.attrs["seal"]
        expect("taken out", says(file), ["True", "False"])
        expect("info without", info(file).returncode, 1)
        with h5py.File(file, "a") as f:
            del f["certificate"]
            f["certificate"] = certificate.decode().replace('"sealed": true,', "")
        expect("unsealed", says(file), ["True", "unsealed"])
        done = info(file)
        expect("info of the unsealed", (done.returncode, "unsealed" in done.stdout), (0, True))
