#!/usr/bin/env python3
"""What napari (npe2) and xarray read of a .vdvr file, by the packages themselves.

  readers.py
"""
import pickle
import subprocess
import sys

import numpy as np
import vdvr
import xarray
from npe2 import PluginManager, PluginManifest
from npe2.io_utils import read as npe2_read

assert not {"napari", "npe2", "xarray", "cil"} & set(
    subprocess.run([sys.executable, "-c", "import vdvr, sys; print(*sys.modules)"], capture_output=True, text=True,
                   check=True).stdout.split()), "import vdvr imports what only its readers need"

rng = np.random.default_rng(3)
# Few kinds of tiles, each of several of the file's chunks of 512 KiB.
scan = vdvr.Scan(rng.random((24, 96, 25)).astype(np.float32), np.arange(24) * 7.5, center=12.0, unit="mm", pitch=0.5)
vdvr.build(scan, "10%", levels="isotropic", storage="f32", gold=4, u_filter="cubic").save("noise.vdvr", overwrite=True)
volume = vdvr.open("noise.vdvr")
whole, bounds = volume.to_numpy(), volume.bound_to_numpy()

# --- napari ---
manifest = PluginManifest.from_distribution("vdvr")
manifest.validate_imports()
assert [r.filename_patterns for r in manifest.contributions.readers] == [["*.vdvr"]]
manager = PluginManager.instance()
manager.register(manifest, warn_disabled=False)
layers = npe2_read(["noise.vdvr"], stack=False)
assert [kind for _, _, kind in layers] == ["image", "image"]
for (data, options, _), expected in zip(layers, (whole, bounds)):
    assert np.array_equal(data, expected, equal_nan=True)
    assert options["scale"] == (0.5, 0.5, 0.5) and options["translate"] == tuple(volume.grid.origin[::-1])
    assert options["metadata"]["unit"] == "mm"
    assert options["metadata"]["certificate"] == volume.certificate
assert layers[1][1]["name"] == "noise bound" and layers[1][1]["contrast_limits"] == (0.0, volume.epsilon_abs)
assert vdvr.__version__ == manifest.package_metadata.version

# --- xarray ---
assert "vdvr" in xarray.backends.list_engines()


def read_by_process():
    """Bytes that this process has read, as the system counts them."""
    return int(open("/proc/self/io").readline().split()[1])


def samples_of(variable):
    """The lazy array behind a variable, and its count of bytes."""
    array = variable.variable._data
    while not hasattr(array, "_file"):
        array = array.array
    return array._file.lazy


with xarray.open_dataset("noise.vdvr", engine="vdvr") as data:
    lazy = samples_of(data.density)
    assert lazy.bytes_read == 0, "opening read samples"
    assert data.density.shape == whole.shape and data.density.dtype == np.float32
    assert data.epsilon_abs == volume.epsilon_abs and data.z.units == "mm"
    assert data.attrs["content_sha256"] == volume.content_sha256
    for axis, name in enumerate("xyz"):
        assert data[name][0] == volume.grid.origin[axis] and np.allclose(np.diff(data[name]), 0.5)
    before = read_by_process()
    slab = data.density[40:44, 3:20]
    assert lazy.bytes_read == 0, "indexing read samples"
    assert np.array_equal(slab.values, whole[40:44, 3:20])
    one = lazy.bytes_read
    taken = read_by_process() - before
    print(f"a slab of 4 of {whole.shape[0]} planes: {one} of {lazy.bytes_stored} bytes of samples; "
          f"the process read {taken}")
    # A slab lies in at most two chunks, each of 512 KiB before it is deflated, of each of the file's arrays.
    assert 0 < one < lazy.bytes_stored / 3 and taken < one + 65536
    assert np.array_equal(data.bound[40:44].values, bounds[40:44], equal_nan=True)
    assert lazy.bytes_read == one, "the bound read samples"
    for key in ((7,), (slice(None, None, 30),), (slice(90, 20, -7), slice(5, 9)), (0, 1, 2), (-1, -2),
                (slice(3, 3),), ([5, 1, 60], slice(2, 4)), (slice(None), [0, 3], [2, 2])):
        expected = whole[np.ix_(*[np.arange(n)[k] if isinstance(k, slice) else k for k, n in zip(key, whole.shape)])] \
            if any(isinstance(k, list) for k in key) else whole[key]
        assert np.array_equal(data.density[key].values, expected), key
    assert np.array_equal(data.density.sel(z=data.z[12], method="nearest").values, whole[12])
    assert np.array_equal(data.density.values, whole)
    assert lazy.bytes_read == lazy.bytes_stored
fine = xarray.open_dataset("noise.vdvr", engine="vdvr", spacing=0.125, box=(-4, -4, 0, 4, 4, 2), drop_variables="bound")
assert list(fine) == ["density"]
assert np.array_equal(fine.density.values, volume.to_numpy(0.125, (-4, -4, 0, 4, 4, 2)))
guessed = xarray.open_dataset("noise.vdvr")
assert np.array_equal(pickle.loads(pickle.dumps(guessed)).density[3].values, whole[3])
try:
    xarray.open_dataset(__file__, engine="vdvr")
    raise SystemExit("a script was opened as a volume")
except vdvr.FileError:
    pass
print("readers: npe2 validates and reads, xarray reads what is asked for")
