#!/usr/bin/env python3
"""What users of the module rely on beside the page: recon, errors, interruption, threads.

  module.py
"""
import inspect
import os
import signal
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pyvista
import vdvr
from skimage.transform import iradon

rng = np.random.default_rng(1)


def raises(kind, text, call):
    try:
        call()
    except kind as error:
        assert text in str(error), f"'{text}' is not in: {error}"
        return
    raise SystemExit(f"{kind.__name__} was not raised")


# --- recon against iradon: an object without symmetry, on an odd detector ---
views, columns = 90, 41
theta = np.linspace(0, np.pi, views, endpoint=False)
u = np.arange(columns) - 20.0
sinogram = np.zeros((views, columns))
for x, y, radius, density in ((6, 3, 5, 1.0), (-7, 4, 3, 0.6), (2, -9, 4, 0.8)):
    away = u[None, :] - (x * np.cos(theta) - y * np.sin(theta))[:, None]
    sinogram += 2 * density * np.sqrt(np.maximum(0, radius**2 - away**2))
tomo = np.repeat(sinogram[:, None, :], 2, axis=1)
theirs = iradon(sinogram.T, theta=np.rad2deg(theta), filter_name="ramp", interpolation="linear", circle=True)
ys, xs = np.mgrid[:columns, :columns] - 20
inside = xs**2 + ys**2 <= 19**2
plain = vdvr.recon(tomo, theta, upsampling=1)[1]
# float32 of `views` terms, each at most the largest filtered value: u = 2^-24 a term, and its sum; 8 for
# the filter's own sums of up to 41 products, whose rounding error grows as their square root.
largest = np.abs(sinogram).max() * np.pi / 4
rounding = 8 * (views + columns) * 2.0**-24 * largest
difference = np.abs(plain - theirs)[inside].max()
print(f"recon(upsampling=1) - iradon: at most {difference:.3g}; rounding allows {rounding:.3g}")
assert difference <= rounding
fine = vdvr.recon(tomo, theta)[1]
print(f"recon() - iradon: at most {np.abs(fine - theirs)[inside].max():.3g} of {theirs.max():.3g}, "
      f"rms {np.sqrt(np.mean((fine - theirs)[inside]**2)):.3g}: iradon's interpolation")
assert np.array_equal(vdvr.recon(tomo, theta, (columns - 1) / 2), vdvr.recon(tomo, theta))
# Anybody's volume against F: iradon's rows count against our y.
audited = vdvr.audit(np.stack([theirs, theirs]), vdvr.Scan(tomo, np.rad2deg(theta)))
print(f"audit of iradon: {audited['registration']['found']}")
assert audited["registration"]["found"][0] == "mirrored along y"  # its blur is a window's too
figures = audited["registered"]
assert figures["rms"] < figures["largest"] <= figures["lower"] <= figures["upper"] < audited["as_is"]["lower"]
raises(vdvr.InputError, "none of nearest, linear, cubic", lambda: vdvr.audit(theirs, None, interpolate="sinc"))
# The axis elsewhere: iradon has it in column n // 2 of n, so it gets the same rays with air beside them.
off, wide = 24, 2 * 24 + 1
aside = np.zeros((views, columns))
for x, y, radius, density in ((4, 3, 4, 1.0), (-6, 2, 3, 0.6)):
    away = np.arange(columns)[None, :] - off - (x * np.cos(theta) - y * np.sin(theta))[:, None]
    aside += 2 * density * np.sqrt(np.maximum(0, radius**2 - away**2))
padded = np.pad(aside, ((0, 0), (0, wide - columns)))
theirs_aside = iradon(padded.T, theta=np.rad2deg(theta), filter_name="ramp", interpolation="linear", circle=True)
cut = (wide - columns) // 2
theirs_aside = theirs_aside[cut:cut + columns, cut:cut + columns]
seen = xs**2 + ys**2 <= (columns - 1 - off)**2
aside_tomo = np.repeat(aside[:, None, :], 2, axis=1)
difference = np.abs(vdvr.recon(aside_tomo, theta, off, upsampling=1)[1] - theirs_aside)[seen].max()
rounding = 8 * (views + columns) * 2.0**-24 * np.abs(aside).max() * np.pi / 4
print(f"recon(center={off}) - iradon: at most {difference:.3g}; rounding allows {rounding:.3g}")
assert difference <= rounding
# The other reading of tomopy's centre, half a column off, is another picture.
assert np.abs(vdvr.recon(aside_tomo, theta, off + 0.5, upsampling=1)[1] - theirs_aside)[seen].max() > 0.01
assert np.array_equal(vdvr.recon(tomo.swapaxes(0, 1), theta, sinogram_order=True), vdvr.recon(tomo, theta))

# --- layouts: any of them is the same scan ---
noise = rng.random((12, 3, 13)).astype(np.float32)
angles = np.arange(12) * 15.0
scan = vdvr.Scan(noise, angles, center=6.0)
for other in (noise.astype(np.float64), np.asfortranarray(noise), noise[::-1][::-1], noise.astype(">f4")):
    assert vdvr.Scan(other, angles, center=6.0).sha256 == scan.sha256
assert not scan.data.flags.writeable and np.shares_memory(scan.data, noise)


def resident():
    return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGESIZE")


# What lies in memory as a scan has it is not copied, and is let go with the scan.
big = rng.random((16, 512, 1024), dtype=np.float32)
holders, before = sys.getrefcount(big), resident()
held = vdvr.Scan(big, np.arange(16) * 11.25, center=511.5)
grown = (resident() - before) / big.nbytes
print(f"a scan of {big.nbytes >> 20} MiB takes {100 * grown:.1f} % more")
assert grown < 0.1 and np.shares_memory(held.data, big)
view = held.data
del held
assert view[3, 4, 5] == big[3, 4, 5]
del view
assert sys.getrefcount(big) == holders, "the array is held after its scan is gone"
del big

# --- what is stated of an input ---
raises(vdvr.InputError, "whole numbers", lambda: vdvr.Scan(np.ones((12, 3, 13), np.uint16), angles, center=6.0))
assert vdvr.Scan(np.ones((12, 3, 13), np.uint16), angles, center=6.0, line_integrals=True).shape == (12, 3, 13)
scan.save("stated.h5")
for views in ("0:4,5:", [(0, 4), (5, 12)]):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the numbers are random: they look like transmissions
        part = vdvr.read_scan("stated.h5", views=views, center=6.0)
    assert np.array_equal(part.data, np.delete(noise, 4, 0))
raises(vdvr.InputError, "leave", lambda: vdvr.read_scan("stated.h5", darks="none"))
raises(vdvr.InputError, "none of degrees, radians", lambda: vdvr.read_scan("stated.h5", angle_unit="turns"))
raises(vdvr.FileError, "these are degrees", lambda: vdvr.read_scan("stated.h5", angle_unit="radians"))
raises(vdvr.InputError, "exclude", lambda: vdvr.read_scan("stated.h5", transmission=True, line_integrals=True))
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    doubtful = vdvr.Scan(-noise - 1, angles, center=6.0)
    doubtful.save("doubtful.h5")
    assert any("below 0" in w for w in vdvr.read_scan("doubtful.h5").warnings) and len(caught) == 1

# --- errors ---
bad = noise.copy()
bad[3, 1, 2] = np.nan
raises(vdvr.InputError, "view 3, row 1, column 2", lambda: vdvr.Scan(bad, angles, center=6.0))
raises(vdvr.InputError, "12 views", lambda: vdvr.Scan(noise[:11], angles, center=6.0))
raises(vdvr.InputError, "pitch", lambda: vdvr.Scan(noise, angles, center=6.0, pitch=-1))
raises(vdvr.InputError, "center", lambda: vdvr.Scan(noise, angles, center=99.0))
raises(vdvr.InputError, "300%", lambda: vdvr.build(scan, "300%"))
raises(vdvr.ToleranceError, "out of reach", lambda: vdvr.build(scan, 1e-9))
raises(vdvr.FileError, "no-such.h5", lambda: vdvr.read_scan("no-such.h5"))
for kind, usual in ((vdvr.InputError, ValueError), (vdvr.FileError, OSError), (vdvr.FileError, ValueError),
                    (vdvr.MismatchError, ValueError), (vdvr.ToleranceError, ValueError),
                    (vdvr.DeviceError, RuntimeError), (vdvr.ResourceError, MemoryError)):
    assert issubclass(kind, usual) and issubclass(kind, vdvr.Error)
raises(OSError, "no-such.h5", lambda: vdvr.read_scan("no-such.h5"))
raises(ValueError, "phase", lambda: vdvr.read_scan("no-such.h5", phase=(1, 2)))
raises(vdvr.InputError, "lies above", lambda: vdvr.build(scan, "20%", window=(2, 1)))
raises(vdvr.InputError, "closing", lambda: vdvr.build(scan, "20%", closing="tight"))
raises(TypeError, "windows", lambda: vdvr.build(scan, "20%", windows=(1, 2)))
raises(vdvr.InputError, "save", lambda: vdvr.build(scan, "20%", resume=True))
assert "window" in vdvr.build.__doc__ and "closing" in str(inspect.signature(vdvr.plan))
raises(vdvr.DeviceError, "no-such-device", lambda: vdvr.build(scan, "20%", device="no-such-device"))
volume = vdvr.build(scan, "20%")
raises(vdvr.InputError, "none of dvr", lambda: volume.render(mode="sideways"))
# Integrals and their greys, which run over the picture's own range unless another is given.
sums = volume.render(size=(9, 9), mode="integral", azimuth=0, elevation=0, values=True)
assert sums.shape == (9, 9) and np.isfinite(sums).all() and sums.max() > 0
greys = volume.render(size=(9, 9), mode="integral", azimuth=0, elevation=0)
assert greys.min() == 0 and greys.max() == 255 and (greys[..., 0] == greys[..., 2]).all()
window = volume.render(size=(9, 9), mode="integral", azimuth=0, elevation=0,
                       transfer_range=(float(sums.min()), float(sums.max())))
assert np.array_equal(window, greys)
raises(vdvr.InputError, "box", lambda: volume.to_numpy(box=(90, 90, 90, 99, 99, 99)))
raises(vdvr.InputError, "[..., 3]", lambda: volume([1.0, 2.0]))
# Certified pictures: those of `vdvr render --certify`, to the byte.
os.makedirs("by-program", exist_ok=True)
volume.save("pictured.vdvr")
for mode, array in (("dvr", (24, 32, 3)), ("slice", (24, 32, 3)), ("mip", (24, 32)), ("iso", (24, 32))):
    picture = volume.certify_picture(size=(32, 24), mode=mode, sampler="buffer")
    assert picture.image.shape == (24, 32, 3) and picture.low.shape == picture.high.shape == array
    assert (picture.levels is None) == (mode == "iso") and (picture.classes is None) == (mode != "iso")
    certificate = picture.save(f"{mode}.png")
    subprocess.run([sys.argv[1], "render", "pictured.vdvr", "--certify", "--mode", mode, "--size", "32x24", "--sampler", "buffer",
                    "-o", f"by-program/{mode}.png", "--quiet"] + (["--plain"] if mode == "slice" else []), check=True)
    for file in [f"{mode}.png", f"{mode}.certificate.json"] + ([] if mode == "iso" else [f"{mode}.bound.png"]):
        assert open(file, "rb").read() == open(f"by-program/{file}", "rb").read(), f"{file} differs"
    found = vdvr.verify_picture(f"{mode}.certificate.json", volume, scan, rays=3)
    assert found and found.same_pixels and found.rays_outside == 0 and not found.failures
    assert found.rays == (0 if certificate.get("light") == "as drawn" and certificate["picture"]["gradient"] != "central" else 3)
assert "surface" in repr(picture)
assert volume.certify_picture(size=(16, 16), shading=False, tolerance=0).worst <= volume.certify_picture(
    size=(16, 16), shading=False, step=1.0).worst
raises(vdvr.InputError, "exists already", lambda: picture.save("iso.png"))
raises(vdvr.InputError, ".png", lambda: picture.save("other.npy"))
raises(vdvr.InputError, "none of exact", lambda: volume.certify_picture(form="quick"))
raises(vdvr.InputError, "certified", lambda: volume.certify_picture(mode="error"))
raises(vdvr.FileError, "no-such", lambda: vdvr.verify_picture("no-such.json", volume))
with open("dvr.png", "ab") as changed:
    changed.write(b"x")
assert "is not the picture" in vdvr.verify_picture("dvr.certificate.json", "pictured.vdvr").failures[0]
# Sigma: a build that is held to it, at points, in pictures.
subprocess.run([sys.argv[1], "simulate", "--phantom", "sphere", "--detector", "33x5", "--angles", "40", "--photons", "2000",
                "-o", "counts.h5", "--quiet"], check=True)
counts = vdvr.read_scan("counts.h5")
told = counts.noise()
assert told.source == "flats" and abs(told.photons / 2000 - 1) < 0.1 and told.passed == 1 and "flats" in str(told)
assert 0.04 < vdvr.read_scan("counts.h5", gaussian=(1, 0)).noise().passed < 0.1
assert counts.noise(sigma_p=0.5).sigma_p == 0.5 and counts.noise(sigma_p=0.5).photons is None
assert vdvr.build(counts, "8sigma").certificate["noise"]["source"] == "flats"
of_counts = vdvr.build(counts, "20%")
own = of_counts.measure(mean=True, ball=(0, 0, 0, 1.5), scan=counts)
assert own["mean"][0] <= own["field_mean"] <= own["mean"][1] and 0 < own["sigma"] < of_counts.sigma([[0.0, 0, 0]])[0]
raises(vdvr.MismatchError, "", lambda: of_counts.measure(mean=True, scan=scan))
raises(vdvr.InputError, "mean=True", lambda: of_counts.measure(above=0.5, scan=counts))
raises(vdvr.InputError, "noise", lambda: vdvr.Scan(np.zeros((12, 3, 13), np.float32), angles, center=6.0).noise())
noisy = vdvr.build(scan, "4sigma", sigma_p=0.05)
middle = noisy.sigma([[0.0, 0.0, 0.0]])
assert middle.shape == (1,) and middle[0] > 0 and noisy.certificate["noise"]["tolerance_sigmas"] == 4
of_pixels = noisy.render(size=(20, 16), mode="mip", show="sigma", values=True)
in_sigma = noisy.render(size=(20, 16), mode="mip", show="error-in-sigma", values=True)
seen = of_pixels[np.isfinite(of_pixels)]  # of bricks that no view sees nothing is known
assert seen.size and seen.min() > 0 and seen.max() <= noisy.certificate["noise"]["sigma"]["largest"] * 1.000001
seen = in_sigma[np.isfinite(in_sigma)]
assert seen.size and seen.max() <= 4
assert noisy.render(size=(160, 120), mode="error", show="sigma").shape == (120, 160, 3)
raises(vdvr.InputError, "noise", lambda: volume.render(mode="error", show="sigma"))
raises(vdvr.InputError, "none of", lambda: volume.render(show="sigmas"))
volume.save("noise.vdvr", overwrite=True)
raises(vdvr.InputError, "exists already", lambda: volume.save("noise.vdvr"))
no_driver = subprocess.run([sys.executable, "-c", "import vdvr; vdvr.device()"], capture_output=True, text=True,
                           env={**os.environ, "OCL_ICD_VENDORS": "/nonexistent"})
assert "vdvr[cpu]" in no_driver.stderr and "pocl-opencl-icd" in no_driver.stderr, no_driver.stderr

# --- progress, and what it raises ---
stages = []
vdvr.build(scan, "20%", progress=lambda stage, fraction: stages.append((stage, fraction)))
assert stages and all(0 <= f <= 1 for _, f in stages)


class Enough(Exception):
    pass


def stop(stage, fraction):
    raise Enough


raises(Enough, "", lambda: vdvr.build(scan, "20%", progress=stop))
assert vdvr.build(scan, "20%").content_sha256 == volume.content_sha256, "a stop has left something behind"

# --- a journal beside the file: what was interrupted goes on ---
middle = vdvr.Scan(rng.random((60, 40, 49)).astype(np.float32), np.arange(60) * 3.0, center=24.0)


def stop_late(stage, fraction):
    if stage == "classify" and fraction > 0.5:
        raise Enough


raises(Enough, "", lambda: vdvr.build(middle, "10%", save="middle.vdvr", progress=stop_late))
assert os.path.getsize("middle.vdvr.journal") > 0 and not os.path.exists("middle.vdvr")
resumed = vdvr.build(middle, "10%", save="middle.vdvr", resume=True)
assert not os.path.exists("middle.vdvr.journal")
assert vdvr.open("middle.vdvr").content_sha256 == resumed.content_sha256 == vdvr.build(middle, "10%").content_sha256
raises(vdvr.InputError, "exists already", lambda: vdvr.build(middle, "10%", save="middle.vdvr"))

# --- an axis that leans: followed, found, certified, and upright in what is saved ---
roll, (rows_, columns_) = 2.0, (25, 61)
c_, s_ = np.cos(np.radians(roll)), np.sin(np.radians(roll))
along_u, along_v = np.meshgrid(np.arange(columns_) - 30.0, np.arange(rows_) - 12.0)
away, height = along_u * c_ - along_v * s_, along_u * s_ + along_v * c_
turned = np.arange(90) * 2.0
leaning = np.array([np.sqrt(np.maximum(0, 81 - (away - 6 * np.cos(t)) ** 2)) * 2 / (1 + np.exp(height - 6))
                    for t in np.radians(turned)], dtype=np.float32)
scan = vdvr.Scan(leaning, turned, axis_roll=roll)
assert scan.axis_roll == roll and scan.shape == (90, 22, 59) and abs(scan.center - 30) < 0.05, (scan.shape, scan.center)
found = vdvr.find_roll(vdvr.Scan(leaning, turned))
print(f"roll found: {found.roll_deg:.3f} +- {found.uncertainty_deg:.3f}, of {roll}")
assert found.significant and abs(found.roll_deg - roll) < 4 * found.uncertainty_deg
followed = vdvr.find_roll(scan)
print(f"roll found of what is followed: {followed.roll_deg:.3f} +- {followed.uncertainty_deg:.3f}")
assert not followed.significant and abs(followed.roll_deg - roll) < 4 * followed.uncertainty_deg
raises(vdvr.InputError, "from -10 to 10", lambda: vdvr.Scan(leaning, turned, axis_roll=10.5))
raises(vdvr.InputError, "not finite", lambda: vdvr.Scan(leaning, turned, axis_roll=float("nan")))
scan.save("upright.h5")
again = vdvr.read_scan("upright.h5")
assert again.axis_roll == 0 and np.array_equal(again.data, scan.data)
vdvr.Scan(leaning, turned).save("leaning.h5")
held = vdvr.read_scan("leaning.h5", axis_roll=roll)
assert np.array_equal(held.data, scan.data)
small = vdvr.build(held, "10%", size=(8, 8, 2))
assert vdvr.verify(small, held).holds

# --- stands of a ball that is taller than the detector: one scan of all heights ---
stand, moved_ = np.tile(np.arange(45) * 4.0, 3), np.repeat([-6.0, 0.0, 6.0], 45)
across, upright_ = np.arange(41) - 20.0, np.arange(9) - 4.0
ball = np.array([np.sqrt(np.maximum(0, 100 - (across - 3 * np.cos(t)) ** 2 - (upright_[:, None] - m) ** 2)) * 2
                 for t, m in zip(np.radians(stand), moved_)], dtype=np.float32)
pairs = np.stack([0 * moved_, moved_], 1)
scan = vdvr.Scan(ball, stand, center=20.0, shifts=pairs)
assert scan.shape == (45, 21, 41) and any("series of heights" in note for note in scan.notes), (scan.shape, scan.notes)
assert vdvr.Scan(ball[:90], stand[:90], center=20.0, shifts=pairs[:90], heights="common").shape == (90, 3, 41)
whole = vdvr.build(scan, "10%", size=(8, 8, 8))
assert vdvr.verify(whole, scan).holds
assert abs(float(whole.to_numpy().mean()) - 1) < 0.02
raises(vdvr.InputError, "by height", lambda: scan.save("stands.h5"))
raises(vdvr.InputError, "heights", lambda: vdvr.Scan(ball, stand, shifts=pairs, heights="some"))
vdvr.Scan(ball, stand, center=20.0).save("stands.h5")
np.savetxt("stands.txt", pairs)
held = vdvr.read_scan("stands.h5", shifts="stands.txt")
assert np.array_equal(held.data, scan.data)
assert vdvr.verify(vdvr.build(held, "10%", size=(8, 8, 8)), held).holds  # by rows that verify puts together itself

# --- VTK's boxes are V's own samples ---
boxes, seen = pyvista.wrap(volume.to_vtk()), {}
assert boxes.n_blocks > 0 and boxes.field_data["unit"][0] == "pixel"
assert boxes.field_data["epsilon_abs"][0] == volume.epsilon_abs
for box in boxes:
    if box.spacing not in seen:
        seen[box.spacing] = volume.to_numpy(spacing=box.spacing)
    first = np.rint((np.array(box.bounds[::2]) - volume.grid.origin) / box.spacing).astype(int)
    part = tuple(slice(f, f + n) for f, n in zip(first[::-1], box.dimensions[::-1]))
    assert np.array_equal(box["density"].reshape(box.dimensions[::-1]), seen[box.spacing][part])
assert np.isclose(boxes.volume, np.prod([n * s for n, s in zip(volume.grid.cells, volume.grid.spacing)]))

# --- Ctrl-C, and the interpreter's lock: other threads run meanwhile ---
large = vdvr.Scan(rng.random((180, 96, 129)).astype(np.float32), np.arange(180.0), center=64.0)
counted, sent = [0], [0.0, 0.0]


def count():
    # The build is well on its way after a second.
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        counted[0] += 1
        time.sleep(0.01)
    sent[:] = time.monotonic(), time.process_time()
    os.kill(os.getpid(), signal.SIGINT)


thread = threading.Thread(target=count)
thread.start()
try:
    vdvr.build(large, "10%")
    raise SystemExit("the build ended before it was interrupted")
except KeyboardInterrupt:
    waited, worked = time.monotonic() - sent[0], time.process_time() - sent[1]
thread.join()
print(f"interrupted after {waited:.2f} s and {worked:.2f} s of work; another thread ran {counted[0]} times meanwhile")
assert counted[0] > 10, "the interpreter's lock was held"
# A second of a machine that has nothing else to do: of the work that this process did meanwhile, on all cores.
assert worked < 1.0 * len(os.sched_getaffinity(0)), f"Ctrl-C took {worked} s of work"
print("module: recon, layouts, errors, progress and interruption are as documented")
